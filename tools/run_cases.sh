#!/usr/bin/env bash
# tools/run_cases.sh [BUILD [NAME ...]]: reported cases, one after the other: runs NAME/cmd.sh of each folder with TACTUS set, in a copy,
# and prints what came beside NAME/expected.txt. The folder of cases is TACTUS_CASES, or ../shared/cases beside the checkout.
# A person compares; the exit code is 1 only where a case was ended by a signal or took longer than five minutes.
set -uo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
build=$(realpath "${1:-$root/build}")
shift || true
cases=${TACTUS_CASES:-$root/../shared/cases}
[ -d "$cases" ] || { echo "no cases here: $cases (TACTUS_CASES names another folder)"; exit 0; }
[ -x "$build/tactus" ] || { echo "no program here: $build/tactus" >&2; exit 2; }
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export TACTUS=$build/tactus TMPDIR=$scratch/tmp PATH=$build:$PATH
mkdir "$TMPDIR"

names=("$@")
[ ${#names[@]} -gt 0 ] || mapfile -t names < <(find -L "$cases" -mindepth 2 -maxdepth 2 -name cmd.sh -printf '%h\n' | xargs -n1 basename | sort)
failed=0
for name in "${names[@]}"; do
  [ -f "$cases/$name/cmd.sh" ] || { echo "no case '$name' in $cases" >&2; failed=1; continue; }
  cp -rL "$cases/$name" "$scratch/$name" && chmod -R u+w "$scratch/$name"
  echo "== $name"
  (cd "$scratch/$name" && timeout 300 bash cmd.sh) 2>&1 | sed 's/^/  | /'
  code=${PIPESTATUS[0]}
  echo "  exit $code; expected:"
  sed 's/^/  > /' "$cases/$name/expected.txt"
  if [ "$code" -ge 124 ]; then failed=1; fi
  rm -rf "${scratch:?}/$name"
done
# Scenes without a command: they must run to their end, or be refused with a message.
if [ $# -eq 0 ]; then
  while read -r scene; do
    echo "== ${scene#"$cases"/}"
    folder=$scratch/scene && rm -rf "$folder" && cp -rL "$(dirname "$scene")" "$folder" && chmod -R u+w "$folder"
    (cd "$folder" && timeout 300 "$TACTUS" run "$(basename "$scene")" --view none --frames 30 2>&1 | grep -E '^(error|warning)|frames on' | cut -c1-240 | sed 's/^/  | /')
  done < <(find -L "$cases" -mindepth 2 -maxdepth 2 -name '*.yaml' | sort | while read -r s; do [ -f "$(dirname "$s")/cmd.sh" ] || echo "$s"; done)
fi
exit $failed
