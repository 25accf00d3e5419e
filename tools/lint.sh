#!/usr/bin/env bash
# Format, include direction, kernels' rules, every header on its own, clang-tidy. Where a tool is missing: "SKIPPED", but an
# error with CI=true.
set -euo pipefail
cd "$(dirname "$0")/.."
failed=0
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

have() {  # have TOOL CHECK
  command -v "$1" >/dev/null && return 0
  if [ "${CI:-}" = true ]; then
    echo "$2: FAILED, $1 is not here"
    failed=1
  else
    echo "$2: SKIPPED, $1 is not here"
  fi
  return 1
}

if have clang-format format; then
  if git ls-files '*.h' '*.cpp' '*.cu' '*.cuh' | xargs clang-format --dry-run -Werror >"$scratch/format" 2>&1; then
    echo "format: clean"
  else
    grep error "$scratch/format" | head -20
    echo "format: run make format"
    failed=1
  fi
fi

python3 tools/lint_includes.py || failed=1

# Headers around CUDA's own need its toolkit; nvcc compiles those.
export scratch
header_alone() {
  local log
  log=$scratch/$(echo "$1" | tr / _).log
  echo "#include \"${1#src/}\"" | g++ -std=c++20 -fsyntax-only -Wall -Wextra -Isrc -Ibench -isystem /usr/include/opencv4 \
    -march=x86-64-v3 -x c++ - 2>"$log" || { echo "header $1 does not compile alone:"; head -3 "$log"; return 1; }
}
export -f header_alone
echo "inline std::string text();" >"$scratch/bad.h"
if (cd "$scratch" && header_alone bad.h >/dev/null); then
  echo "headers: one without its includes was accepted"
  failed=1
fi
if git ls-files 'src/tactus/*.h' 'bench/*.h' | xargs grep -L 'cuda_runtime' |
  xargs -P "$(nproc)" -I{} bash -c 'header_alone {}'; then
  echo "headers: each compiles alone"
else
  failed=1
fi

if have clang-tidy tidy; then tools/tidy.py || failed=1; fi
exit $failed
