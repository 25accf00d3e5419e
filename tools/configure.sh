#!/usr/bin/env bash
# tools/configure.sh BUILD [-DX=Y ...]: configures once, and again only when an option changes.
set -euo pipefail
build=$1
shift
if [ ! -f "$build/build.ninja" ] || [ "$*" != "$(cat "$build/.options" 2>/dev/null)" ]; then
  log=$(mktemp)
  cmake -S . -B "$build" -G Ninja "$@" >"$log" 2>&1 || { cat "$log"; exit 1; }
  rm -f "$log"
  echo "$*" >"$build/.options"
fi
