#!/usr/bin/env bash
# Format, include direction, kernels' rules, and every public header on its own.
set -euo pipefail
cd "$(dirname "$0")/.."
failed=0
if command -v clang-format >/dev/null; then
  if git ls-files '*.h' '*.cpp' '*.cu' '*.cuh' | xargs clang-format --dry-run -Werror >/tmp/tactus_format.log 2>&1; then
    echo "format: clean"
  else
    grep error /tmp/tactus_format.log | head -20
    echo "format: run make format"
    failed=1
  fi
else
  echo "format: SKIPPED, no clang-format here"
fi
python3 tools/lint_includes.py || failed=1
headers=$(git ls-files 'src/tactus/base/*.h' 'src/tactus/compute/*.h' 'src/tactus/multi_device/*.h' 'src/tactus/geom/*.h' \
  'src/tactus/rig/*.h' 'src/tactus/reconstruct/*.h' 'src/tactus/tissue/*.h' 'src/tactus/contact/*.h' 'src/tactus/sim/*.h')
bad=0
for h in $headers; do
  grep -q 'yaml-cpp\|opencv2\|cuda_runtime' "$h" && continue  # internal headers around one library
  echo "#include \"${h#src/}\"" | g++ -std=c++20 -fsyntax-only -Wall -Wextra -Isrc -march=x86-64-v3 -x c++ - 2>/tmp/tactus_header.log ||
    { echo "header $h does not compile alone:"; head -3 /tmp/tactus_header.log; bad=1; }
done
[ $bad -eq 0 ] && echo "headers: each compiles alone" || failed=1
exit $failed
