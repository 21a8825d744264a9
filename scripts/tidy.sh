#!/bin/sh
# tidy.sh [FILE...]: clang-tidy 14 with the checks of .clang-tidy, on all C++ files of fmu_src or on those named. Takes minutes.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh clang-tidy-14
sh scripts/build.sh release redysim_fmu
# clang does not know this option of GCC, nor its precompiled headers
mkdir -p build/tidy
sed 's/-fvect-cost-model=dynamic//; s/-Winvalid-pch -include [^ ]*//' build/release/compile_commands.json >build/tidy/compile_commands.json
[ $# -gt 0 ] || set -- $(find fmu_src -name '*.cpp' ! -name unload.cpp)
printf '%s\0' "$@" | xargs -0 -n 1 -P "$(nproc)" clang-tidy-14 -p build/tidy --quiet --warnings-as-errors='*'
