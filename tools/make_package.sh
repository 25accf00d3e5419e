#!/usr/bin/env bash
# tools/make_package.sh BUILD OUT: the program for people who don't compile, from a build of `tactus`:
#   OUT/tactus_VERSION_ARCH.deb                  for this Debian; its libraries are packages it depends on
#   OUT/python3-tactus_VERSION_ARCH.deb          likewise, where the module was built: make_python_package.sh
#   OUT/tactus-VERSION-linux-MACHINE.tar.gz      for any Linux with this libc or a newer one; libraries and their licences inside
# The first and the last hold LICENSE, README, the list of parts (SPDX), the documents, scenes, rigs, the man page, completions, and the benchmarks where they were built. OpenGL belongs to the machine: without it the
# program runs with --view none, and says so.
set -euo pipefail
build=$1 out=$2
version=$(sed -n 's/^project(tactus VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
from_the_host='/(libc|libm|libdl|librt|libpthread|libresolv|libutil|ld-linux[^/]*|libcuda|libGL|libEGL|libOpenGL)\.so'
mkdir -p "$out"

. "$(dirname "$0")/package_of.sh"

programs=("$build/tactus")
if [ -x "$build/tactus-bench" ]; then programs+=("$build/tactus-bench"); fi

share() {  # share FOLDER DOCUMENTS: what goes with the program
  mkdir -p "$1" "$2/docs"
  cp -r scenes rigs "$1/"
  cp LICENSE README.md CHANGELOG.md CITATION.cff SECURITY.md "$2/"
  cp -r docs/*.md docs/images "$2/docs/"
}

# --- the archive
name=tactus-$version-linux-$(uname -m)
archive=$out/$name
rm -rf "$archive"
mkdir -p "$archive/bin" "$archive/lib" "$archive/completions" "$archive/man" "$archive/licenses"
cp "${programs[@]}" "$archive/bin/"
strip "$archive"/bin/*
share "$archive" "$archive"
cp "$build"/help/{tactus.bash,_tactus,tactus.fish} "$archive/completions/"
cp "$build/help/tactus.1" "$archive/man/"
ldd "$archive"/bin/* | awk '/=> \//{print $3}' | sort -u | grep -vE "$from_the_host" | while read -r library; do
  cp -L "$library" "$archive/lib/"
  package=$(package_of "$library")
  if [ -z "$package" ]; then
    echo "$library: of no package, so its licence is not known" >&2
    exit 1
  fi
  cp "/usr/share/doc/$package/copyright" "$archive/licenses/$package"
done
# The headers that are compiled in.
for package in libcli11-dev nlohmann-json3-dev libtinygltf-dev; do
  if [ -e "/usr/share/doc/$package/copyright" ]; then cp "/usr/share/doc/$package/copyright" "$archive/licenses/$package"; fi
done
tools/make_sbom.py "${programs[@]}" >"$archive/tactus.spdx.json"
wrong=$(env -i /usr/bin/ldd "$archive"/bin/* | grep '=>' | grep -v "=> $(realpath "$archive")/" | grep -vE "$from_the_host" || true)
if [ -n "$wrong" ]; then
  echo "not found in the archive's own lib/:" && echo "$wrong"
  exit 1
fi >&2
tar -C "$out" -czf "$archive.tar.gz" "$name"

# --- the package
if command -v dpkg-deb >/dev/null; then
  stage=$(mktemp -d)
  trap 'rm -rf "$stage"' EXIT
  chmod 755 "$stage"
  mkdir -p "$stage/DEBIAN" "$stage/usr/bin" "$stage"/usr/share/{man/man1,bash-completion/completions,zsh/vendor-completions,fish/vendor_completions.d}
  cp "$archive"/bin/* "$stage/usr/bin/"
  share "$stage/usr/share/tactus" "$stage/usr/share/doc/tactus"
  cp LICENSE "$stage/usr/share/doc/tactus/copyright"
  cp "$archive/tactus.spdx.json" "$stage/usr/share/doc/tactus/"
  gzip -9nc "$build/help/tactus.1" >"$stage/usr/share/man/man1/tactus.1.gz"
  cp "$build/help/tactus.bash" "$stage/usr/share/bash-completion/completions/tactus"
  cp "$build/help/_tactus" "$stage/usr/share/zsh/vendor-completions/"
  cp "$build/help/tactus.fish" "$stage/usr/share/fish/vendor_completions.d/"
  depends=$(packages_of "${programs[@]}")
  architecture=$(dpkg --print-architecture)
  # FFmpeg is loaded when the first film is opened, in the version that the program was compiled with.
  suggests=$(for part in avformat swscale avdevice; do
    package_of "$(ls /usr/lib/*/lib$part.so.* 2>/dev/null | head -1)"
  done | grep . | paste -sd, | sed 's/,/, /g')
  suggests=${suggests:-ffmpeg}
  cat >"$stage/DEBIAN/control" <<C
Package: tactus
Version: $version
Architecture: $architecture
Maintainer: the authors of Tactus <noreply@example.org>
Section: graphics
Priority: optional
Installed-Size: $(du -sk "$stage/usr" | cut -f1)
Depends: $depends
Recommends: libegl1, libegl-mesa0, libgl1-mesa-dri
Suggests: $suggests
Description: real objects, seen by cameras, touch virtual soft bodies
 Tactus rebuilds what calibrated cameras see in 3D, as it moves, and lets it push virtual soft bodies, in real time.
 Pictures and films need OpenGL 4.5; Mesa's software driver is enough. Films of cameras are read by FFmpeg, where it is.
C
  deb=$out/tactus_${version}_$architecture.deb
  dpkg-deb --build --root-owner-group "$stage" "$deb" >/dev/null
  du -h "$deb"
  if compgen -G "$build/python/tactus/_tactus.*.so" >/dev/null; then "$(dirname "$0")/make_python_package.sh" "$build" "$out"; fi
fi
du -h "$archive.tar.gz"
