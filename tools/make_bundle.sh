#!/usr/bin/env bash
# tools/make_bundle.sh BUILD OUT: two folders in OUT, and an archive of each, that run on another Linux with the libraries in
# their lib/ (found through DT_RPATH, so no wrapper or environment is needed):
#   tactus-device  tactus-bench, the scenes, and every test that runs on devices: small enough to carry to a GPU host
#   tactus         that and the program itself, with the image and video codecs of this machine's OpenCV
# libc, the GPU's driver and OpenGL belong to the machine they run on; where that has NVIDIA's OpenGL but not the libraries
# that find it (containers), run-tests.sh takes those of gl/.
set -euo pipefail
build=$1 out=$2
from_the_host='/(libc|libm|libdl|librt|libpthread|libresolv|libutil|ld-linux[^/]*|libcuda|libGL|libEGL|libOpenGL)\.so'

add_libraries() {  # add_libraries FOLDER: what its programs need, and that it is found there and not here
  local folder=$1 wrong
  ldd "$folder"/bin/* "$folder"/tests/* | awk '/=> \//{print $3}' | sort -u | grep -vE "$from_the_host" |
    xargs -I{} cp -L {} "$folder/lib/"
  wrong=$(env -i /usr/bin/ldd "$folder"/bin/* "$folder"/tests/* | grep '=>' | grep -v "=> $(realpath "$folder")/" |
    awk '{print $1, $2, $3}' | grep -vE "$from_the_host" | sort -u || true)
  if [ -n "$wrong" ]; then
    echo "$folder: not found in its own lib/:" && echo "$wrong"
    exit 1
  fi >&2
}

# Programs share most of their code, so a window that holds several of them makes the archive a fifth.
pack() {  # pack FOLDER: archive and sizes
  tar -C "$out" -cf - "$(basename "$1")" | xz --memlimit=0 --lzma2=preset=3,dict=256MiB >"$1.tar.xz"
  du -sh "$1" "$1.tar.xz"
}

device=$out/tactus-device all=$out/tactus
rm -rf "$out"
mkdir -p "$device/bin" "$device/tests" "$device/lib"
cp "$build/tactus-bench-devices" "$device/bin/tactus-bench"
for t in "$build"/tests/*_test; do
  # Those that read recordings would bring all image and video codecs along.
  if grep -q '^Devices/' <<<"$("$t" --gtest_list_tests)" && ! grep -q libopencv <<<"$(ldd "$t")"; then cp "$t" "$device/tests/"; fi
done
strip "$device"/bin/* "$device"/tests/*
cp -r scenes rigs "$device/"
mkdir "$device/gl"
for l in libEGL.so.1 libOpenGL.so.0 libGLdispatch.so.0; do
  cp -L "$(ldconfig -p | awk -v l="$l" '$1 == l && /x86-64|AArch64/ {print $NF; exit}')" "$device/gl/"
done
echo '{"file_format_version": "1.0.0", "ICD": {"library_path": "libEGL_nvidia.so.0"}}' >"$device/gl/10_nvidia.json"
cat >"$device/run-tests.sh" <<'S'
#!/bin/sh
# Runs all tests of this bundle, those for GPUs where there is one. Arguments go to every test (--gtest_filter=...).
cd "$(dirname "$0")" && failed=0
known=$(ldconfig -p 2>/dev/null || /sbin/ldconfig -p)
case $known in *libEGL.so.1*) ;; *) export LD_LIBRARY_PATH="$PWD/gl${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}" ;; esac
case $known in
  *libEGL_nvidia.so.0*)
    ls /usr/share/glvnd/egl_vendor.d/*nvidia* /etc/glvnd/egl_vendor.d/*nvidia* >/dev/null 2>&1 ||
      export __EGL_VENDOR_LIBRARY_FILENAMES="${__EGL_VENDOR_LIBRARY_FILENAMES:-$PWD/gl/10_nvidia.json}" ;;
esac
for t in tests/*_test; do
  echo "== $t"
  "$t" --gtest_brief=1 "$@" || failed=1
done
exit $failed
S
chmod +x "$device/run-tests.sh"

cp -r "$device" "$all"
cp "$build/tactus" "$all/bin/"
cp "$build/tests/cli_test" "$all/tests/"
strip "$all/bin/tactus" "$all/tests/cli_test"
add_libraries "$device"
add_libraries "$all"
pack "$device"
pack "$all"

limit_mib=64
if [ "$(stat -c %s "$device.tar.xz")" -gt $((limit_mib * 1024 * 1024)) ]; then
  echo "$device.tar.xz is larger than $limit_mib MiB" >&2
  exit 1
fi
