#!/bin/sh
# Builds every model as an FMU in out/, which FMPy validates and simulates with its defaults.
set -eu
cd "$(dirname "$0")/.."
sh scripts/build.sh release redysim_fmu describe
mkdir -p out
for model in models/*.toml; do
  name="$(basename "$model" .toml)"
  echo "== $name"
  .venv/bin/python -m build_fmu build "$model" -o "out/$name.fmu"
  .venv/bin/python -m fmpy validate "out/$name.fmu"
  .venv/bin/python -m build_fmu simulate "out/$name.fmu" --csv "out/$name.csv" --plot "out/$name.png"
done
