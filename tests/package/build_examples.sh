#!/usr/bin/env bash
# build_examples.sh BUILD EXAMPLES SCRATCH: installs BUILD, then configures, builds and runs the examples against it. EXAMPLES are
# in the sources, whose scenes they run.
set -euo pipefail
build=$(realpath "$1") examples=$(realpath "$2") scratch=$3
rm -rf "$scratch"
cmake --install "$build" --prefix "$scratch/prefix" >/dev/null
documents=$(dirname "$(find "$scratch/prefix" -name ARCHITECTURE.md)")
"$(dirname "$0")/installed_links.py" "$documents"
diff -r "$examples" "$documents/examples"
use() {  # use EXAMPLE [cmake options]
  local example=$1
  shift
  cmake -S "$examples/$example" -B "$scratch/$example" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DCMAKE_PREFIX_PATH="$scratch/prefix" "$@" >"$scratch/log" 2>&1 || { cat "$scratch/log"; return 1; }
  cmake --build "$scratch/$example" >"$scratch/log" 2>&1 || { cat "$scratch/log"; return 1; }
}

# As on a machine without what only recordings, scenes and pictures need.
without=(-DCMAKE_DISABLE_FIND_PACKAGE_{OpenCV,yaml-cpp,nlohmann_json,ZLIB}=ON)
use hello_hull "${without[@]}"
"$scratch/hello_hull/hello_hull"
use own_kernel "${without[@]}"
"$scratch/own_kernel/own_kernel"
"$scratch/own_kernel/own_kernel" cpu:2
if grep -q 'ZMQ_LIBRARY:FILEPATH=/' "$build/CMakeCache.txt"; then
  use own_camera -DCMAKE_DISABLE_FIND_PACKAGE_OpenCV=ON
  "$scratch/own_camera/own_camera"
fi

# Scenes, recordings and pictures need more.
use hello_loop
use hello_touch
use hello_haptic
(cd "$scratch" && hello_touch/hello_touch "$examples/../scenes/touch.yaml" >/dev/null && test -s touched.ply)
"$scratch/hello_haptic/hello_haptic" "$examples/../scenes/touch.yaml"
(cd "$scratch" && hello_loop/hello_loop "$examples/../scenes/demo.yaml" | tail -1 | grep -q '^30 frames')

# A component that doesn't exist, or one whose packages are missing, is said so.
for wrong in "hul|tactus has no component 'hul'" "recordings|OpenCV"; do
  mkdir -p "$scratch/wrong"
  printf 'cmake_minimum_required(VERSION 3.25)\nproject(wrong LANGUAGES CXX)\nfind_package(tactus REQUIRED COMPONENTS %s)\n' \
    "${wrong%%|*}" >"$scratch/wrong/CMakeLists.txt"
  if cmake -S "$scratch/wrong" -B "$scratch/wrong/build" -DCMAKE_PREFIX_PATH="$scratch/prefix" "${without[@]}" >"$scratch/log" 2>&1; then
    echo "COMPONENTS ${wrong%%|*} was accepted"
    exit 1
  fi
  grep -q "${wrong#*|}" "$scratch/log" || { cat "$scratch/log"; exit 1; }
  rm -rf "$scratch/wrong"
done

# What is exported holds nothing that a build has for itself, as warnings and sanitizers.
cmake -S "$examples/.." -B "$scratch/sanitized" -G Ninja -DTACTUS_SANITIZE=address -DTACTUS_CUDA=OFF -DTACTUS_TESTS=OFF >/dev/null
grep -q -- '-fsanitize=address' "$scratch/sanitized/compile_commands.json"
exported=$(find "$scratch/sanitized/CMakeFiles/Export" -name tactusTargets.cmake)
grep -q -- '-ffp-contract=off' $exported
if grep -nE 'fsanitize|-Werror|-Wall' $exported; then
  echo "the package exports flags of the build"
  exit 1
fi
echo "package: examples built and ran"
