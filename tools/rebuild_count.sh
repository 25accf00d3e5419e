#!/usr/bin/env bash
# Counts how many objects of a build are compiled again after an edit of a header. ninja keeps the headers of each object that it
# compiled, so nothing is touched or compiled; what was never built doesn't count.
# usage: tools/rebuild_count.sh BUILD [HEADER ...]
set -euo pipefail
build=${1:?usage: tools/rebuild_count.sh BUILD [HEADER ...]}
shift
if [ $# -eq 0 ]; then set -- tactus/tissue/tled/element_forces.h tactus/sim/scene.h; fi
deps=$(ninja -C "$build" -t deps)
printf '%4d  objects in all\n' "$(grep -c '#deps' <<<"$deps")"
for header in "$@"; do
  printf '%4d  %s\n' "$(grep -c "^ .*/$header\$" <<<"$deps" || true)" "$header"
done
