#!/bin/sh
# Builds and runs the benchmarks: bench/run.py if there is one, else each program of build/bench/bench.
set -eu
cd "$(dirname "$0")/.."
[ -f bench/CMakeLists.txt ] || {
  echo "there are no benchmarks in bench/ yet" >&2
  exit 1
}
sh scripts/build.sh bench
if [ -f bench/run.py ]; then
  exec .venv/bin/python bench/run.py "$@"
fi
find build/bench/bench -maxdepth 1 -type f -perm -u+x | sort | while read -r program; do
  echo "== $program"
  "$program" "$@" </dev/null
done
