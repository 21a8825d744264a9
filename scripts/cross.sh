#!/bin/sh
# cross.sh win64|aarch64-linux|darwin64|wasm|linux64: the library for another system in build/SYSTEM, cross-compiled, then its tests.
# win64: 64-bit Windows by mingw-w64; three models run under Wine and are compared with the Linux library.
# aarch64-linux: Linux on 64-bit Arm processors by gcc; models run under QEMU and are compared likewise.
# darwin64: macOS on x86-64, 11 and newer, by zig from the package `ziglang` of PyPI, which contains clang, libc++ and the symbols of
# macOS' own library. It cannot run here: its symbols and dependencies are checked.
# wasm: WebAssembly for the page of `build-fmu show --live`, by Emscripten; Node runs all models and compares them likewise, then
# Chromium opens pages.
# linux64: not a library, but the programs `describe` and `fmu_driver` of a wheel for Linux on x86-64 with glibc 2.17 or newer, by zig, which
# contains the symbol versions of each glibc; they are compared with those of gcc.
# `build-fmu build --platforms linux64,SYSTEM` packs the library into an FMU.
set -eu
cd "$(dirname "$0")/.."
system="${1:-}"
case "$system" in
  win64) packages="g++-mingw-w64-x86-64-posix wine wine64" ;;
  aarch64-linux) packages="g++-aarch64-linux-gnu qemu-user-static" ;;
  darwin64) packages=llvm ;;
  wasm) packages="emscripten nodejs chromium" ;;
  linux64) packages=binutils ;;
  *) echo "usage: cross.sh win64|aarch64-linux|darwin64|wasm|linux64" >&2; exit 2 ;;
esac
sh scripts/setup.sh $packages
sh scripts/build.sh release redysim_fmu describe

mkdir -p "build/$system/include"
case "$system" in
  darwin64) triple=x86_64-macos.11.0-none ;;
  linux64) triple=x86_64-linux-gnu.2.17 ;;
  *) triple= ;;
esac
if [ -n "$triple" ]; then
  .venv/bin/python -c 'import ziglang' 2>/dev/null ||
    .venv/bin/python -m pip install --quiet --disable-pip-version-check --retries 5 ziglang </dev/null
  # zig is one program with subcommands; CMake needs one program for each
  zig="$(.venv/bin/python -c 'import ziglang, os; print(os.path.join(os.path.dirname(ziglang.__file__), "zig"))')"
  mkdir -p "build/$system/zig"
  for part in cc c++ ar ranlib; do
    case "$part" in
      c*) target="-target $triple" ;;
      *) target= ;;
    esac
    printf '#!/bin/sh\nexec "%s" %s %s "$@"\n' "$zig" "$part" "$target" >"build/$system/zig/$part"
    chmod +x "build/$system/zig/$part"
  done
  cp "$(dirname "$zig")/lib/libcxx/LICENSE.TXT" "build/$system/zig/libcxx.txt"
fi

sh scripts/sundials.sh "$system"
[ -d ".sundials/$system/lib" ] || {
  echo "the $system library needs the source of SUNDIALS, see .sundials/fetch.log and .sundials/$system.log" >&2
  exit 1
}

# a separate folder for the host's headers: /usr/include as a whole belongs to glibc
ln -sfn /usr/include/toml++ "build/$system/include/toml++"

headers="$(.venv/bin/python -c 'import fmpy, os; print(os.path.join(os.path.dirname(fmpy.__file__), "c-code"))')"
echo "== build build/$system"
cmake -S . -B "build/$system" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/scripts/$system.cmake" -DCMAKE_BUILD_TYPE=Release -DREDYSIM_TESTS=OFF \
  -DREDYSIM_SUNDIALS="$PWD/.sundials/$system" -DTOMLPLUSPLUS_INCLUDE_DIR="$PWD/build/$system/include" \
  -DEigen3_DIR=/usr/share/eigen3/cmake -DREDYSIM_FMI_HEADERS="$headers" >"build/$system.log" 2>&1 || {
  cat "build/$system.log" >&2
  exit 1
}
case "$system" in
  win64) targets="redysim_fmu describe fmu_driver" ;;  # for build_fmu there
  linux64) targets="describe fmu_driver" ;;
  *) targets=redysim_fmu ;;
esac
cmake --build "build/$system" --parallel "$(nproc)" --target $targets
[ "$system" != wasm ] || exec .venv/bin/python -m pytest -q -s -m slow tests/packager/test_live.py </dev/null
# a name of a test has no hyphen
exec .venv/bin/python -m pytest -q -m slow tests/packager/test_cross.py -k "${system%-linux}" </dev/null
