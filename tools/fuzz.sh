#!/usr/bin/env bash
# tools/fuzz.sh SECONDS [FAMILY ...]: fuzzes the readers of files (tests/fuzz) so long each, as many at once as there are cores.
# After a change of a reader: 10. Before a release: 600. What they find lies in build-fuzz/findings; mended, it belongs into tests/fuzz/inputs.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:?seconds for each fuzzer, for example 10}
shift
families=("$@")
[ ${#families[@]} -gt 0 ] || families=(mesh volume scene calibration image checkpoint recording packet viewer)
if command -v apt-get >/dev/null && ! { command -v clang++ && ls /usr/lib/llvm-*/lib/clang/*/lib/linux/libclang_rt.fuzzer-*.a; } >/dev/null 2>&1; then
  sudo=()
  if [ "$(id -u)" -ne 0 ]; then sudo=(sudo); fi
  { "${sudo[@]}" apt-get update -qq &&
    DEBIAN_FRONTEND=noninteractive "${sudo[@]}" apt-get install -y -qq --no-install-recommends clang libclang-rt-dev; } >/dev/null
fi
build=build-fuzz
log=$(mktemp)
cmake --preset fuzz >"$log" 2>&1 || { cat "$log"; exit 1; }
cmake --build $build -j "$(nproc)" --target "${families[@]/#/fuzz_}" >"$log" 2>&1 || { tail -40 "$log"; exit 1; }
mkdir -p $build/findings

fuzz() {  # fuzz FAMILY SECONDS: seeds are read, never written
  local corpus=build-fuzz/corpus/$1 log=build-fuzz/fuzz-$1.log most=3000
  case $1 in recording | packet | viewer) most=256 ;; esac  # no single allocation above that, whatever strangers send
  mkdir -p "$corpus"
  if build-fuzz/fuzz/fuzz_"$1" -max_total_time="$2" -timeout=10 -rss_limit_mb=3000 -malloc_limit_mb="$most" -max_len=20000 \
    -artifact_prefix="build-fuzz/findings/$1-" "$corpus" tests/fuzz/inputs/"$1" >"$log" 2>&1; then
    echo "fuzz $1: $(sed -n 's/^Done \([0-9]*\) runs in \([0-9]*\) second.*/\1 runs in \2 s, nothing found/p' "$log")"
  else
    echo "fuzz $1: FOUND"
    tail -60 "$log"
    return 1
  fi
}
export -f fuzz
export UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1
printf '%s\n' "${families[@]}" | xargs -P "$(nproc)" -I{} bash -c "fuzz {} $seconds"
