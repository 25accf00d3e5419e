#!/usr/bin/env bash
# tools/sanitize.sh asan|tsan [PROGRAM ...]: builds tests under ASan and UBSan, or under TSan, and runs them. Without programs: asan
# all of them, tsan those of the threads that share loops. Once a night (.github/workflows/nightly.yml), and before a release.
set -euo pipefail
cd "$(dirname "$0")/.."
kind=${1:?asan or tsan}
shift
case $kind in
  asan | tsan) preset=cpu-$kind ;;
  *) echo "tools/sanitize.sh: '$kind', expected asan or tsan" >&2; exit 2 ;;
esac
cmake --preset "$preset" -DTACTUS_TESTS=ON >/dev/null
programs=("$@")
if [ $# -eq 0 ] && [ "$kind" = tsan ]; then programs=(compute_test); fi
cmake --build --preset "$preset" -j "$(nproc)" ${programs[@]:+--target "${programs[@]}"}
if [ ${#programs[@]} -eq 0 ]; then
  mapfile -t programs < <(find "build-$preset/tests" -maxdepth 1 -name '*_test' -type f -executable -printf '%f\n' | sort)
fi
# Two tests step bodies for a simulated minute, one looks at all pairs of 10,000 particles: minutes under sanitizers, and no line
# of code that others don't run.
run_program() {
  local log=build-$1/$2.log
  "build-$1/tests/$2" --gtest_brief=1 --gtest_filter="-*ForAMinute*:*AtAnyStep*:*AllInOneCell*" >"$log" 2>&1 && return
  echo "== $2"
  tail -60 "$log"
  return 1
}
export -f run_program
printf '%s\n' "${programs[@]}" | xargs -P "$(nproc)" -I{} bash -c "run_program $preset {}"
echo "$kind: ${#programs[@]} programs, clean"
