#!/bin/sh
# sundials.sh [native|win64|aarch64-linux|darwin64|wasm|linux64]: builds the required parts of SUNDIALS, optimised for size, from the source package of
# the distribution into .sundials/TARGET. Does nothing if this exists. If the source is not available, it prints a message
# and succeeds: CMake then links the distribution's archives, and the library is larger.
set -eu
cd "$(dirname "$0")/.."
target="${1:-native}"
place="$PWD/.sundials"

case "$target" in
  native) compiler="${CC:-cc}" ;;
  win64) compiler=x86_64-w64-mingw32-gcc-posix ;;
  aarch64-linux) compiler=aarch64-linux-gnu-gcc ;;
  darwin64 | linux64) compiler="$PWD/build/$target/zig/cc" ;;  # as scripts/cross.sh creates it
  wasm) compiler=emcc ;;
  *) echo "usage: sundials.sh [native|win64|aarch64-linux|darwin64|wasm|linux64]" >&2; exit 2 ;;
esac

# one section per function, so that the linker removes unused functions; no exceptions pass through C code
flags="-Oz -ffunction-sections -fdata-sections -fno-asynchronous-unwind-tables -fvisibility=hidden"
# zig writes a file to the current folder
version="$(mkdir -p "$place" && cd "$place" && "$compiler" --version | sed -n 1p)"
stamp="$(printf '%s\n' "$version" "$flags" | cat - scripts/sundials.sh | cksum)"
[ "$(cat "$place/$target/stamp" 2>/dev/null || true)" != "$stamp" ] || exit 0

without() {
  echo "== SUNDIALS' source: $1; the distribution's archives are linked, the library is 0.3 MB larger" >&2
  exit 0
}

# The source package of the distribution's binary package, verified by apt. The lists and the cache of the system
# are not changed.
fetch() {
  rm -rf "$place/apt"
  mkdir -p "$place/apt/lists/partial" "$place/apt/cache/archives/partial" "$place/source"
  apt-cache madison libsundials-dev | awk -F' *[|] *' '$3 ~ /Packages$/ {
    split($3, part, " "); slash = match(part[2], "/[^/]*$")
    print "deb-src", part[1], substr(part[2], 1, slash - 1), substr(part[2], slash + 1); exit }' >"$place/apt/sources.list"
  [ -s "$place/apt/sources.list" ] || return 1
  set -- -q -o Dir::Etc::sourcelist="$place/apt/sources.list" -o Dir::Etc::sourceparts=- -o Dir::State::lists="$place/apt/lists" \
    -o Dir::Cache="$place/apt/cache" -o Acquire::http::Timeout=20 -o Acquire::https::Timeout=20 -o APT::Sandbox::User=root
  apt-get "$@" update </dev/null &&
    (cd "$place/source" && apt-get "$@" source --download-only sundials </dev/null)
}

archive="$(ls "$place"/source/sundials_*.orig.tar.xz 2>/dev/null | head -n 1)"
if [ -z "$archive" ]; then
  # without network, try once per day
  [ -z "$(find "$place/unavailable" -mtime -1 2>/dev/null)" ] || without "could not be fetched, see .sundials/fetch.log"
  command -v apt-get >/dev/null || without "apt is not here to fetch it"
  mkdir -p "$place"
  echo "== SUNDIALS' source" >&2
  if ! fetch >"$place/fetch.log" 2>&1; then
    rm -rf "$place/source" "$place/apt"
    touch "$place/unavailable"
    without "could not be fetched, see .sundials/fetch.log"
  fi
  rm -rf "$place/apt" "$place/unavailable"
  archive="$(ls "$place"/source/sundials_*.orig.tar.xz | head -n 1)"
fi

echo "== SUNDIALS for $target" >&2
work="$place/work-$target"
rm -rf "$work"
mkdir -p "$work/source"
tar -xJf "$archive" -C "$work/source" --strip-components=1
set -- -DCMAKE_C_COMPILER="$compiler" -DCMAKE_C_FLAGS="$flags" -DCMAKE_BUILD_TYPE=None
case "$target" in
  win64) set -- "$@" -DCMAKE_SYSTEM_NAME=Windows -DCMAKE_SYSTEM_PROCESSOR=AMD64 ;;
  darwin64 | aarch64-linux | wasm | linux64) set -- "$@" -DCMAKE_TOOLCHAIN_FILE="$PWD/scripts/$target.cmake" ;;
esac
{
  cmake -S "$work/source" -B "$work/build" -G Ninja "$@" -DCMAKE_INSTALL_PREFIX="$work/installed" -DCMAKE_INSTALL_LIBDIR=lib \
    -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DBUILD_SHARED_LIBS=OFF -DBUILD_STATIC_LIBS=ON \
    -DBUILD_CVODES=OFF -DBUILD_IDA=OFF -DBUILD_IDAS=OFF -DBUILD_KINSOL=OFF -DSUNDIALS_BUILD_WITH_MONITORING=OFF \
    -DEXAMPLES_ENABLE_C=OFF -DEXAMPLES_ENABLE_CXX=OFF -DEXAMPLES_INSTALL=OFF &&
    cmake --build "$work/build" --parallel "$(nproc)" --target install
} >"$place/$target.log" 2>&1 </dev/null || {
  tail -n 20 "$place/$target.log" >&2
  without "does not compile here, see .sundials/$target.log"
}
# the licence is part of every FMU
cat "$work/source/LICENSE" "$work/source/NOTICE" >"$work/installed/LICENSE"
printf '%s\n' "$stamp" >"$work/installed/stamp"
rm -rf "${place:?}/$target"
mv "$work/installed" "$place/$target"
rm -rf "$work"
