#!/usr/bin/env bash
# Installs the Debian packages that are missing. Elsewhere: names what is needed and goes on.
# install_deps.sh all: also what `tactus calibrate` is made of, which the rest can do without.
set -euo pipefail
packages=(cmake ninja-build g++ ccache git python3 libtbb-dev libspdlog-dev libyaml-cpp-dev nlohmann-json3-dev libcli11-dev
  libpugixml-dev libtomlplusplus-dev libopencv-dev libepoxy-dev libegl-dev libegl1 libegl-mesa0 libgl1-mesa-dri libtinygltf-dev zlib1g-dev libgtest-dev)
if [ "${1:-}" = all ]; then packages+=(libceres-dev libopencv-contrib-dev); fi
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
