#!/bin/sh
# Installs the simulators of the comparison into a separate environment, build/peers. Unavailable ones are skipped.
set -eu
cd "$(dirname "$0")/.."
[ -x build/peers/bin/python ] || python3 -m venv build/peers
for package in numpy scipy pin mujoco drake exudyn heyoka casadi; do
  build/peers/bin/python -m pip show --quiet "$package" >/dev/null 2>&1 && continue
  echo "== install $package"
  build/peers/bin/python -m pip install --quiet --disable-pip-version-check "$package" </dev/null >build/peers/pip.log 2>&1 ||
    echo "$package cannot be installed here and is skipped (build/peers/pip.log)"
done
