#!/bin/sh
# Builds and runs the benchmarks: bench.sh [OPTIONS OF bench/run.py]. Where `.venv/bin/pip install pin` has put Pinocchio, it
# is measured in the same process.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh
REDYSIM_PINOCCHIO="$(.venv/bin/python -c 'import sysconfig; print(sysconfig.get_path("purelib"))')/cmeel.prefix"
[ -d "$REDYSIM_PINOCCHIO/include/pinocchio" ] || REDYSIM_PINOCCHIO=
export REDYSIM_PINOCCHIO
# the preset reads it when the build folder is configured
[ "$(sed -n 's/^REDYSIM_PINOCCHIO:[A-Z]*=//p' build/bench/CMakeCache.txt 2>/dev/null)" = "$REDYSIM_PINOCCHIO" ] || rm -f build/bench/build.ninja
sh scripts/build.sh bench
exec .venv/bin/python bench/run.py "$@"
