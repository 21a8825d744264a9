#!/bin/sh
# Free fall of the KUKA KR5 for 1 s: FMU, CSV and plot in out/.
set -eu
cd "$(dirname "$0")/.."
sh scripts/build.sh release redysim_fmu describe
echo "== kuka_kr5: pack, simulate 1 s of free fall"
mkdir -p out
.venv/bin/python -m build_fmu build models/kuka_kr5.toml -o out/kuka_kr5.fmu
.venv/bin/python -m build_fmu simulate out/kuka_kr5.fmu --stop 1 --step 0.001 --csv out/kuka_kr5.csv --plot out/kuka_kr5.png
echo
echo "FMU, CSV and plot are in: $PWD/out"
