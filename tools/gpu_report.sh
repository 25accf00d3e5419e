#!/usr/bin/env bash
# tools/gpu_report.sh BUNDLE OUT [BENCH ...]: what this machine's GPUs say, in one go. BUNDLE is an unpacked tactus-device
# (make testbundle). Every test that runs on devices runs on all GPUs, with the build's machine code and again from its PTX, as
# on GPUs that it has no machine code for; then each benchmark on one GPU, on two, and on all of them, and `frame` from PTX.
# OUT gets tests.log, tests-ptx.log and one JSON a benchmark and number of GPUs, as in bench/results. `sanitize` among the
# benchmarks looks for bad memory accesses and races instead, with logs in OUT. Exits 1 if a test failed.
#   tools/gpu_report.sh bundle/tactus-device /tmp/report
#   tools/gpu_report.sh bundle/tactus-device /tmp/report hull fig20 sanitize
set -uo pipefail
[ $# -ge 2 ] || { sed -n '2,7s/^# //p' "$0"; exit 2; }
bundle=$(realpath "$1")
mkdir -p "$2"
out=$(realpath "$2")
shift 2
benches=("$@")
[ ${#benches[@]} -gt 0 ] || benches=(frame tissue fig20 fluid cut hull table2 table3 table4 table5)
count=$(nvidia-smi -L 2>/dev/null | grep -c '^GPU')
[ "$count" -gt 0 ] || { echo "no GPU here (nvidia-smi -L lists none)" >&2; exit 2; }
# "NVIDIA H100 80GB HBM3" is h100, "NVIDIA GeForce RTX 4090" is rtx4090.
model=$(nvidia-smi --query-gpu=name --format=csv,noheader | head -1 | tr '[:upper:]' '[:lower:]' |
  sed -E 's/nvidia|geforce|tesla//g; s/ *([0-9]+ ?gb|pcie|sxm|hbm|nvl).*//; s/-.*//; s/ //g')

failed=0
"$bundle/run-tests.sh" --gtest_filter='*cuda*' >"$out/tests.log" 2>&1 || failed=1
grep -E '^== |PASSED|FAILED' "$out/tests.log"
from_ptx=(env CUDA_FORCE_PTX_JIT=1 CUDA_CACHE_PATH="$out/../ptx-cache")
"${from_ptx[@]}" "$bundle/run-tests.sh" --gtest_filter='*cuda_0' >"$out/tests-ptx.log" 2>&1 || failed=1
echo "== from PTX: $(grep -c 'PASSED' "$out/tests-ptx.log") programs, $(grep -c 'FAILED  \]' "$out/tests-ptx.log") failures"
grep -E 'FAILED  \]' "$out/tests-ptx.log"

# Side by side: each waits for its own kernels most of the time.
sanitize() {
  local tool test log
  for tool in memcheck racecheck; do
    for test in contact_test touching_bodies_test liquid_test wound_test cut_test; do
      log=$out/$tool-$test.log
      timeout 900 compute-sanitizer --tool "$tool" --error-exitcode 3 "$bundle/tests/$test" \
        --gtest_filter='*cuda_0' --gtest_brief=1 >"$log" 2>&1 || echo "rc $?" >>"$log" &
    done
  done
  wait
  for log in "$out"/memcheck-*.log "$out"/racecheck-*.log; do
    echo "== $(basename "$log" .log): $(grep -hE 'SUMMARY|^rc ' "$log" | tr '\n' ' ')"
    grep -q '^rc ' "$log" && failed=1
  done
}
sets=("cuda:0")
[ "$count" -ge 2 ] && sets+=("cuda:0-1")
[ "$count" -ge 3 ] && sets+=("cuda:0-$((count - 1))")
cd "$bundle" || exit 2
case " ${benches[*]} " in *' sanitize '*) sanitize ;; esac
for set in "${sets[@]}"; do
  case $set in
    cuda:0) name=$model ;;
    cuda:0-1) name=${model}x2 ;;
    *) name=${model}x$count ;;
  esac
  for bench in "${benches[@]}"; do
    [ "$bench" != sanitize ] || continue
    file=$out/$(date +%F)-$name-$bench.json
    echo "== $bench on $set"
    timeout 240 bin/tactus-bench bench "$bench" --devices "$set" --json "$file" || echo "$bench on $set: no result"
    [ "$bench $set" = "frame cuda:0" ] || continue
    echo "== $bench on $set from PTX"
    timeout 240 "${from_ptx[@]}" bin/tactus-bench bench "$bench" --devices "$set" --json "${file%.json}-ptx.json" ||
      echo "$bench from PTX: no result"
  done
done
exit $failed
