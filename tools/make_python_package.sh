#!/usr/bin/env bash
# tools/make_python_package.sh BUILD OUT: OUT/python3-tactus_VERSION_ARCH.deb, `import tactus` for Debian's Python, from a build of
# `tactus_python`. It needs no other package of Tactus: the library is in the module.
set -euo pipefail
build=$1 out=$2
cd "$(dirname "$0")/.."
. tools/package_of.sh
version=$(sed -n 's/^project(tactus VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
module=$(ls "$build"/python/tactus/_tactus.cpython-*.so)
# cpython-311: it runs with 3.11 alone.
minor=$(basename "$module" | sed -n 's/^_tactus\.cpython-3\([0-9]*\)-.*/\1/p')
architecture=$(dpkg --print-architecture)
mkdir -p "$out"
stage=$(mktemp -d)
trap 'rm -rf "$stage"' EXIT
chmod 755 "$stage"
package=$stage/usr/lib/python3/dist-packages/tactus documents=$stage/usr/share/doc/python3-tactus
mkdir -p "$stage/DEBIAN" "$package" "$documents/examples"
cp "$module" python/tactus/*.py python/tactus/*.pyi python/tactus/py.typed "$package/"
strip --strip-unneeded "$package"/_tactus.*.so
cp LICENSE "$documents/copyright"
cp docs/python.md docs/python_coming_from.md "$documents/"
cp python/examples/*.py "$documents/examples/"
chmod -R u=rwX,go=rX "$stage/usr"
cat >"$stage/DEBIAN/control" <<C
Package: python3-tactus
Version: $version
Architecture: $architecture
Maintainer: the authors of Tactus <noreply@example.org>
Section: python
Priority: optional
Installed-Size: $(du -sk "$stage/usr" | cut -f1)
Depends: python3 (>= 3.$minor), python3 (<< 3.$((minor + 1))), python3-numpy, $(packages_of "$module")
Recommends: libegl1, libegl-mesa0, libgl1-mesa-dri
Suggests: tactus, python3-scipy, python3-distributed
Description: real objects, seen by cameras, touch virtual soft bodies: Python
 The module tactus: scenes, soft bodies and contact, hulls from silhouettes, calibration, and environments to learn in. Arrays are
 numpy's. Same bits as the program's, on every device.
C
cat >"$stage/DEBIAN/postinst" <<'C'
#!/bin/sh
set -e
if command -v py3compile >/dev/null; then py3compile -p python3-tactus; fi
C
cat >"$stage/DEBIAN/prerm" <<'C'
#!/bin/sh
set -e
if command -v py3clean >/dev/null; then py3clean -p python3-tactus; fi
C
chmod 755 "$stage/DEBIAN/postinst" "$stage/DEBIAN/prerm"
deb=$out/python3-tactus_${version}_$architecture.deb
dpkg-deb --build --root-owner-group "$stage" "$deb" >/dev/null
du -h "$deb"
