#!/bin/sh
# The wheel for this system in out/wheel, tested in an empty environment.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh
sh scripts/sundials.sh
rm -rf out/wheel
.venv/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps -w out/wheel . </dev/null
REDYSIM_FMU_WHEEL="$(echo out/wheel/*.whl)" .venv/bin/python -m pytest -q -m slow tests/packager/test_wheel.py </dev/null
echo "The wheel is in: $PWD/out/wheel"
