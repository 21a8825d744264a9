#!/bin/sh
# The library for 64-bit Windows in build/win64, cross-compiled by mingw-w64; then three models run under Wine and are
# compared with the Linux library. `build-fmu build --platforms linux64,win64` puts both into an FMU.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh g++-mingw-w64-x86-64-posix wine wine64
sh scripts/build.sh release redysim_fmu describe
sh scripts/sundials.sh win64
[ -d .sundials/win64/lib ] || {
  echo "the win64 library needs SUNDIALS' source, see .sundials/fetch.log and .sundials/win64.log" >&2
  exit 1
}

# a folder of its own for the host's headers: /usr/include as a whole is glibc's
mkdir -p build/win64/include
ln -sfn /usr/include/toml++ build/win64/include/toml++

headers="$(.venv/bin/python -c 'import fmpy, os; print(os.path.join(os.path.dirname(fmpy.__file__), "c-code"))')"
echo "== build build/win64"
cmake -S . -B build/win64 -G Ninja -DCMAKE_TOOLCHAIN_FILE="$PWD/scripts/win64.cmake" -DCMAKE_BUILD_TYPE=Release -DREDYSIM_TESTS=OFF \
  -DREDYSIM_SUNDIALS="$PWD/.sundials/win64" -DTOMLPLUSPLUS_INCLUDE_DIR="$PWD/build/win64/include" \
  -DEigen3_DIR=/usr/share/eigen3/cmake -DREDYSIM_FMI_HEADERS="$headers" >build/win64.log 2>&1 || {
  cat build/win64.log >&2
  exit 1
}
cmake --build build/win64 --parallel "$(nproc)" --target redysim_fmu
exec .venv/bin/python -m pytest -q -m slow tests/packager/test_win64.py </dev/null
