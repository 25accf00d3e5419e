#!/usr/bin/env bash
# tools/sanitize.sh asan|tsan [PROGRAM ...]: builds tests under ASan and UBSan, or under TSan, and runs them. Without programs: asan
# all of them, tsan those of the threads that share loops. `tools/sanitize.sh python [TEST ...]`: the Python module under ASan and UBSan.
# Once a night (.github/workflows/nightly.yml), and before a release.
set -euo pipefail
cd "$(dirname "$0")/.."
kind=${1:?asan, tsan or python}
shift
case $kind in
  asan | tsan) preset=cpu-$kind ;;
  python) preset=cpu-asan ;;
  *) echo "tools/sanitize.sh: '$kind', expected asan, tsan or python" >&2; exit 2 ;;
esac
if [ "$kind" = python ]; then
  cmake --preset "$preset" -DTACTUS_TESTS=ON -DTACTUS_PYTHON=ON >/dev/null
  cmake --build "build-$preset" -j "$(nproc)" --target tactus_python
  # Python itself isn't instrumented: what it never frees is no leak of ours. Exceptions are thrown by a libstdc++ that has to be there
  # when ASan looks for it. Left out: times, memory, types and torch, which say nothing here.
  compiler=$(sed -n 's/^CMAKE_CXX_COMPILER:[^=]*=//p' "build-$preset/CMakeCache.txt")
  tests=("$@")
  if [ ${#tests[@]} -eq 0 ]; then tests=(python/tests); fi
  LD_PRELOAD="$("$compiler" -print-file-name=libasan.so) $("$compiler" -print-file-name=libstdc++.so)" \
    ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=halt_on_error=1:print_stacktrace=1 \
    PYTHONPATH=build-$preset/python TACTUS_SOURCE_DIR=. TACTUS_PROGRAM= \
    /usr/bin/python3 -m pytest -q -p no:cacheprovider "${tests[@]}" \
    -k "not quick and not memory and not mypy and not torch and not threads_run and not killed_worker and not stiffness_is_identified"
  echo "$kind: clean"
  exit
fi
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
