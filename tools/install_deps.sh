#!/usr/bin/env bash
# tools/install_deps.sh [films|complete|web|view|xr|python|tests]: installs the Debian packages that are missing for the program; with
# `films` also to read films; with `complete` also for live cameras, `tactus calibrate` and markers; with `web` also for `tactus run
# --web`, with `view` for `tactus view`, with `xr` for `tactus xr`, with `python` for the Python module, with `tests` for the tests, too.
# Elsewhere: names what is needed and goes on.
set -euo pipefail
# Parts of OpenCV, not libopencv-dev, which brings VTK, Qt and Tcl along. Its calib3d, imgcodecs and videoio bring Qt, GDAL and
# MySQL; FFmpeg brings 86 packages: boards are found, and films read, with `films` or `complete`.
packages=(cmake ninja-build g++ git libtbb-dev libspdlog-dev libyaml-cpp-dev nlohmann-json3-dev libcli11-dev
  libpugixml-dev libopencv-core-dev libopencv-imgproc-dev libspng-dev libturbojpeg0-dev libopenh264-dev
  libepoxy-dev libegl-dev libegl1 libegl-mesa0 libgl1-mesa-dri libtinygltf-dev zlib1g-dev)
case ${1:-} in films | complete | tests) packages+=(libavformat-dev libavcodec-dev libswscale-dev) ;; esac
case ${1:-} in complete | tests) packages+=(libtiff-dev libtomlplusplus-dev libopencv-video-dev pkg-config
  libzmq3-dev libaravis-dev libusb-1.0-0-dev liblz4-dev libceres-dev libopencv-contrib-dev) ;; esac
case ${1:-} in python | tests) packages+=(pybind11-dev python3-dev python3-numpy python3-pytest) ;; esac
if [ "${1:-}" = python ]; then packages+=(python3-scipy python3-setuptools python3-wheel python3-pip mypy); fi  # of examples, pip and tests of types
case ${1:-} in web | tests) packages+=(libcivetweb-dev) ;; esac
case ${1:-} in view | tests) packages+=(libglfw3-dev libimgui-dev libgl1 fonts-dejavu-core) ;; esac
case ${1:-} in xr | tests) packages+=(libopenxr-dev) ;; esac
if [ "${1:-}" = tests ]; then packages+=(xvfb xdotool imagemagick libgtest-dev libopencv-imgcodecs-dev libopencv-videoio-dev python3 python3-zmq xz-utils); fi
# The page's renderer, of npm: one file, which the build puts into the program.
three=0.170.0
case ${1:-} in web | tests) ;; *) three="" ;; esac
if [ -n "$three" ] && [ ! -e "$(dirname "$0")/../node_modules/three/build/three.module.min.js" ]; then
  if command -v npm >/dev/null; then
    npm install --prefix "$(dirname "$0")/.." --no-save --no-package-lock --ignore-scripts --no-audit --no-fund "three@$three" ||
      echo "npm could not get three: without it, --web has no page, and there is no --report." >&2
  elif [ "$1" = web ]; then
    echo "The page of --web is drawn by three, which npm brings. Install npm (https://nodejs.org, or: apt-get install npm), and run" \
      "this again." >&2
  fi
fi
if ! command -v apt-get >/dev/null; then
  echo "No apt-get here: make sure that the equivalents of these are installed: ${packages[*]}" >&2
  exit 0
fi
missing=()
for p in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$p" 2>/dev/null | grep -q 'ok installed' || missing+=("$p")
done
[ ${#missing[@]} -eq 0 ] && exit 0
echo "Installing ${#missing[@]} packages: ${missing[*]}"
sudo=()
if [ "$(id -u)" -ne 0 ]; then sudo=(sudo); fi
"${sudo[@]}" apt-get update -qq
DEBIAN_FRONTEND=noninteractive "${sudo[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
