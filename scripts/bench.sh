#!/bin/sh
# The figures and plots that bench/all.py lists, in one run: bench.sh [OPTIONS OF bench/all.py];
# --docs also updates docs/. bench.sh core [OPTIONS OF bench/run.py]: the recursions only.
set -eu
cd "$(dirname "$0")/.."
if [ "${1:-}" = core ]; then
  sh scripts/setup.sh
else
  sh scripts/setup.sh valgrind ccache
  sh scripts/peers.sh
fi
# the benchmarks, the library and its variants share object files
! command -v ccache >/dev/null || export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER:-ccache}"
place='import sysconfig; print(sysconfig.get_path("purelib"))'
packages="$(build/peers/bin/python -c "$place" 2>/dev/null || .venv/bin/python -c "$place")"
REDYSIM_PINOCCHIO="$packages/cmeel.prefix"
[ -d "$REDYSIM_PINOCCHIO/include/pinocchio" ] || REDYSIM_PINOCCHIO=
REDYSIM_MUJOCO="$packages/mujoco"
[ -d "$REDYSIM_MUJOCO/include" ] || REDYSIM_MUJOCO=
export REDYSIM_PINOCCHIO REDYSIM_MUJOCO
# the preset reads them when the build folder is configured
for name in REDYSIM_PINOCCHIO REDYSIM_MUJOCO; do
  eval "wanted=\$$name"
  [ "$(sed -n "s/^$name:[A-Z]*=//p" build/bench/CMakeCache.txt 2>/dev/null)" = "$wanted" ] || rm -f build/bench/build.ninja
done
sh scripts/build.sh bench benchmarks
if [ "${1:-}" = core ]; then
  shift
  exec .venv/bin/python bench/run.py "$@"
fi
sh scripts/build.sh release redysim_fmu describe fmu_driver
exec .venv/bin/python bench/all.py "$@"
