#!/bin/sh
# Complete instance lifetimes under Valgrind's memcheck: no errors, no leaks. Takes some minutes.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh valgrind
sh scripts/build.sh release whole_life
for model in kuka_kr5 four_bar stiff_strut stick_slip gripper_pd kuka_kr5_computed_torque; do
  echo "== memcheck $model"
  valgrind --quiet --leak-check=full --show-leak-kinds=all --errors-for-leak-kinds=all --error-exitcode=9 \
    build/release/tests/whole_life "models/$model.toml" </dev/null
done
