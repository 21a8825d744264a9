#!/bin/sh
# build.sh PRESET [TARGET...]: configures build/PRESET if necessary and builds it. Presets: see CMakePresets.json.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh
sh scripts/sundials.sh
preset="${1:-release}"
[ $# -eq 0 ] || shift
cache="build/$preset/CMakeCache.txt"

# the FMI headers come with FMPy
headers="$(.venv/bin/python -c 'import fmpy, os; print(os.path.join(os.path.dirname(fmpy.__file__), "c-code"))')"

# a cache from another folder cannot be used
if [ -f "$cache" ] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$PWD" "$cache"; then
  rm -rf "build/$preset"
fi
# nor can one with another SUNDIALS
sundials="$(cat .sundials/native/stamp 2>/dev/null || echo none)"
if [ ! -f "build/$preset/build.ninja" ] || ! grep -F "REDYSIM_FMI_HEADERS:" "$cache" | grep -qF "=$headers" ||
  [ "$(cat "build/$preset/sundials" 2>/dev/null || true)" != "$sundials" ]; then
  echo "== configure build/$preset"
  mkdir -p build
  cmake --preset "$preset" -DREDYSIM_FMI_HEADERS="$headers" >"build/$preset.log" 2>&1 || {
    cat "build/$preset.log" >&2
    exit 1
  }
  echo "$sundials" >"build/$preset/sundials"
fi
echo "== build build/$preset"
cmake --build "build/$preset" --parallel "$(nproc)" ${1:+--target "$@"}
