#!/usr/bin/env bash
# tools/gpu_report.sh BUNDLE OUT [BENCH ...]: what this machine's GPUs say, in one go. BUNDLE is an unpacked tactus-device
# (make bundle). Every test that runs on devices runs on all GPUs; then each benchmark on one GPU, on two, and on all of
# them. OUT gets tests.log and one JSON a benchmark and number of GPUs, as in bench/results. Exits 1 if a test failed.
#   tools/gpu_report.sh bundle/tactus-device /tmp/report
#   tools/gpu_report.sh bundle/tactus-device /tmp/report hull fig20
set -uo pipefail
[ $# -ge 2 ] || { sed -n '2,6s/^# //p' "$0"; exit 2; }
bundle=$(realpath "$1")
mkdir -p "$2"
out=$(realpath "$2")
shift 2
benches=("$@")
[ ${#benches[@]} -gt 0 ] || benches=(frame tissue fig20 fluid cut hull table2 table3 table4 table5)
count=$(nvidia-smi -L 2>/dev/null | grep -c '^GPU')
[ "$count" -gt 0 ] || { echo "no GPU here (nvidia-smi -L lists none)" >&2; exit 2; }
model=$(nvidia-smi --query-gpu=name --format=csv,noheader | head -1 | awk '{print tolower($NF)}')

failed=0
"$bundle/run-tests.sh" --gtest_filter='*cuda*' >"$out/tests.log" 2>&1 || failed=1
grep -E '^== |PASSED|FAILED' "$out/tests.log"

sets=("cuda:0")
[ "$count" -ge 2 ] && sets+=("cuda:0-1")
[ "$count" -ge 3 ] && sets+=("cuda:0-$((count - 1))")
cd "$bundle" || exit 2
for set in "${sets[@]}"; do
  case $set in
    cuda:0) name=$model ;;
    cuda:0-1) name=${model}x2 ;;
    *) name=${model}x$count ;;
  esac
  for bench in "${benches[@]}"; do
    file=$out/$(date +%F)-$name-$bench.json
    echo "== $bench on $set"
    timeout 240 bin/tactus-bench bench "$bench" --devices "$set" --json "$file" || echo "$bench on $set: no result"
  done
done
exit $failed
