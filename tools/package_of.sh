# Sourced by scripts that make Debian packages.

package_of() {  # package_of LIBRARY: the Debian package that it is from; "" for none
  # Packages from before the merge of /lib and /usr/lib know their files by either name.
  local file
  file=$(readlink -f "$1")
  { dpkg -S "$file" 2>/dev/null || dpkg -S "${file#/usr}" 2>/dev/null || true; } | head -1 | cut -d: -f1
}

packages_of() {  # packages_of FILE ...: those that programs and libraries need directly, with commas between
  local needed library
  readelf -d "$@" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p' | while read -r needed; do
    library=$(ldd "$@" | awk -v n="$needed" '$1 == n {print $3; exit}')
    if [ -n "$library" ]; then package_of "$library"; fi
  done | sort -u | grep . | paste -sd, | sed 's/,/, /g'
}
