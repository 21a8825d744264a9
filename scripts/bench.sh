#!/bin/sh
# The figures and plots of docs/performance.md and docs/stability_peers.md, in one go: bench.sh [--docs]. All goes into out/bench;
# --docs puts it into docs/ as well. bench.sh core [OPTIONS OF bench/run.py]: the recursions alone.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh
[ "${1:-}" = core ] || sh scripts/peers.sh
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
sh scripts/build.sh bench
if [ "${1:-}" = core ]; then
  shift
  exec .venv/bin/python bench/run.py "$@"
fi
sh scripts/build.sh release redysim_fmu describe fmu_driver
mkdir -p out/bench
echo "== the recursions, two minutes"
.venv/bin/python bench/run.py >out/bench/core.txt
.venv/bin/python bench/do_step.py --core out/bench/core.txt | tee out/bench/do_step.txt
echo "== steps, starts and many instances"
.venv/bin/python bench/latency.py >out/bench/latency.txt
echo "== error against run time, beside other simulators"
.venv/bin/python bench/peers/work_precision.py -o out/bench
echo "== extreme cases, beside other simulators"
.venv/bin/python bench/peers/extreme.py -o out/bench
.venv/bin/python bench/document.py "$@"
