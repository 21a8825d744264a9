#!/bin/sh
# The library for macOS (x86-64, 11 and newer) in build/darwin64, cross-compiled by zig from the package `ziglang` of PyPI, which
# brings clang, libc++ and the names in macOS' own library. Nothing here can run it: its symbols and needs are checked.
# `build-fmu build --platforms linux64,darwin64` puts it into an FMU.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh llvm
sh scripts/build.sh release describe
.venv/bin/python -c 'import ziglang' 2>/dev/null ||
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --retries 5 ziglang </dev/null

# zig is one program with words for its parts; CMake wants a program for each
zig="$(.venv/bin/python -c 'import ziglang, os; print(os.path.join(os.path.dirname(ziglang.__file__), "zig"))')"
mkdir -p build/darwin64/zig build/darwin64/include
for part in cc c++ ar ranlib; do
  case "$part" in
    c*) target="-target x86_64-macos.11.0-none" ;;
    *) target= ;;
  esac
  printf '#!/bin/sh\nexec "%s" %s %s "$@"\n' "$zig" "$part" "$target" >"build/darwin64/zig/$part"
  chmod +x "build/darwin64/zig/$part"
done
cp "$(dirname "$zig")/lib/libcxx/LICENSE.TXT" build/darwin64/zig/libcxx.txt

sh scripts/sundials.sh darwin64
[ -d .sundials/darwin64/lib ] || {
  echo "the darwin64 library needs SUNDIALS' source, see .sundials/fetch.log and .sundials/darwin64.log" >&2
  exit 1
}

# a folder of its own for the host's headers: /usr/include as a whole is glibc's
ln -sfn /usr/include/toml++ build/darwin64/include/toml++

headers="$(.venv/bin/python -c 'import fmpy, os; print(os.path.join(os.path.dirname(fmpy.__file__), "c-code"))')"
echo "== build build/darwin64"
cmake -S . -B build/darwin64 -G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/scripts/darwin64.cmake" -DCMAKE_BUILD_TYPE=Release -DREDYSIM_TESTS=OFF \
  -DREDYSIM_SUNDIALS="$PWD/.sundials/darwin64" -DTOMLPLUSPLUS_INCLUDE_DIR="$PWD/build/darwin64/include" \
  -DEigen3_DIR=/usr/share/eigen3/cmake -DREDYSIM_FMI_HEADERS="$headers" >build/darwin64.log 2>&1 || {
  cat build/darwin64.log >&2
  exit 1
}
cmake --build build/darwin64 --parallel "$(nproc)" --target redysim_fmu
exec .venv/bin/python -m pytest -q -m slow tests/packager/test_darwin64.py </dev/null
