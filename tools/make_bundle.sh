#!/usr/bin/env bash
# tools/make_bundle.sh BUILD OUT: programs, tests and the shared libraries they need, in a folder that runs on another
# Linux (libc, the GPU driver and OpenGL come from there).
set -euo pipefail
build=$1 out=$2
rm -rf "$out" "$out.tar.gz"
mkdir -p "$out/bin" "$out/tests" "$out/lib"
cp "$build/tactus" "$build/tactus-bench" "$out/bin/"
# The tests of what runs on devices; the others test files and programs of the source tree.
for t in compute cell_list visual_hull surface_texture view_scores flsm contact simulation; do cp "$build/tests/${t}_test" "$out/tests/"; done
cp -r scenes rigs "$out/"
strip "$out"/bin/* "$out"/tests/*
ldd "$out"/bin/* "$out"/tests/* | awk '/=> \//{print $3}' | sort -u |
  grep -vE '/(libc|libm|libdl|librt|libpthread|ld-linux[^/]*|libcuda|libGL|libGLX|libGLdispatch|libEGL|libOpenGL|libdrm|libX[^/]*|libxcb[^/]*|libwayland[^/]*)\.so' |
  xargs -I{} cp -L {} "$out/lib/"
cat >"$out/run-tests.sh" <<'S'
#!/usr/bin/env bash
# Runs all tests of this bundle, GPU ones where there is a GPU.
cd "$(dirname "$0")" && failed=0
for t in tests/*_test; do
  echo "== $t"
  LD_LIBRARY_PATH=$PWD/lib "$t" --gtest_brief=1 || failed=1
done
exit $failed
S
cat >"$out/tactus" <<'S'
#!/usr/bin/env bash
here=$(cd "$(dirname "$0")" && pwd)
LD_LIBRARY_PATH=$here/lib exec "$here/bin/tactus" "$@"
S
chmod +x "$out/run-tests.sh" "$out/tactus"
tar czf "$out.tar.gz" "$out"
du -sh "$out" "$out.tar.gz"
