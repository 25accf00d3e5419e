#!/usr/bin/env bash
# tools/lint.sh [--all]: format, titles of commits, include direction, kernels' rules, prose, every header on its own, clang-tidy. Looks at what
# differs from the branch that this one came from (LINT_BASE, else origin/main, else main), and at what is not committed; with
# --all at everything, but for clang-tidy of tests that didn't change: minutes. Where a tool is missing: "SKIPPED", but an error with CI=true.
set -euo pipefail
cd "$(dirname "$0")/.."
failed=0
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

base=""
if [ "${1:-}" != --all ]; then
  for name in "${LINT_BASE:-origin/main}" main; do
    base=$(git merge-base HEAD "$name" 2>/dev/null) && break
  done
fi
chosen() {  # chosen PATTERN...: files to look at
  if [ -z "$base" ]; then
    git ls-files "$@"
  else
    { git diff --name-only --diff-filter=d "$base" -- "$@"; git ls-files --others --exclude-standard -- "$@"; } | sort -u
  fi
}

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
  chosen '*.h' '*.cpp' '*.cu' '*.cuh' >"$scratch/sources"
  if xargs -r clang-format --dry-run -Werror <"$scratch/sources" >"$scratch/format" 2>&1; then
    echo "format: $(wc -l <"$scratch/sources") files, clean"
  else
    grep error "$scratch/format" | head -20
    echo "format: run make format"
    failed=1
  fi
fi

# (Those before the rule stay as they are.)
if [ -n "$base" ] && long=$(git log --since=2026-11-27T09:00Z --format=%s "$base..HEAD" | awk 'length > 72') && [ -n "$long" ]; then
  printf 'commits: titles of more than 72 characters:\n%s\n' "$long"
  failed=1
fi
python3 tools/lint_includes.py || failed=1
python3 tools/class_sizes.py || failed=1
python3 tools/lint_prose.py || failed=1

# Headers around CUDA's own need its toolkit; nvcc compiles those.
export scratch
header_alone() {
  local log name=${1#include/}
  log=$scratch/$(echo "$1" | tr / _).log
  echo "#include \"${name#src/}\"" | g++ -std=c++20 -fsyntax-only -Wall -Wextra -Iinclude -Isrc -Ibench -isystem /usr/include/opencv4 -isystem /usr/include/imgui \
    -march=x86-64-v3 -x c++ - 2>"$log" || { echo "header $1 does not compile alone:"; head -3 "$log"; return 1; }
}
export -f header_alone
# A source includes its own header first, so where there is one, building it shows that the header compiles alone.
own_source_shows_it() {
  local name=${1#include/}
  name=${name#src/}
  local source=src/${name%.h}.cpp
  [ -f "$source" ] && [ "$(grep -m1 '^#include' "$source")" = "#include \"$name\"" ]
}
export -f own_source_shows_it
echo "inline std::string text();" >"$scratch/bad.h"
if (cd "$scratch" && header_alone bad.h >/dev/null); then
  echo "headers: one without its includes was accepted"
  failed=1
fi
if chosen 'include/*.h' 'src/tactus/*.h' 'bench/*.h' | { xargs -r grep -L 'cuda_runtime' || true; } |
  xargs -r -P "$(nproc)" -I{} bash -c 'own_source_shows_it {} || header_alone {}'; then
  echo "headers: each compiles alone"
else
  failed=1
fi

# Sources of libraries that a build may lack, as such a build compiles them: CI has all libraries, so nothing else would see it.
without_libraries() {
  g++ -std=c++20 -fsyntax-only -Iinclude -Isrc -isystem /usr/include/opencv4 -isystem /usr/include/imgui -march=x86-64-v3 "$1" 2>"$scratch/without-$(basename "$1").log" ||
    { echo "without its library, $1 does not compile:"; grep -m3 error "$scratch/without-$(basename "$1").log"; return 1; }
}
export -f without_libraries
mapfile -t optional < <(git grep -lE 'TACTUS_WITH_[A-Z0-9]+' -- 'src/*.cpp')
if printf '%s\n' "${optional[@]}" | xargs -P "$(nproc)" -I{} bash -c 'without_libraries {}'; then
  echo "optional libraries: ${#optional[@]} sources compile without theirs"
else
  failed=1
fi

if have clang-tidy tidy; then
  if [ -z "$base" ]; then
    tools/tidy.py src bench || failed=1
  else
    read -ra folders <<<"${LINT_TIDY:-src bench tests}"
    mapfile -t sources < <(chosen "${folders[@]/%//*.cpp}")
    if [ ${#sources[@]} -gt 0 ]; then tools/tidy.py "${sources[@]}" || failed=1; else echo "tidy: no source changed"; fi
  fi
fi
exit $failed
