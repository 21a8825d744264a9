#!/bin/sh
# ctest.sh PRESET: runs the C++ tests of build/PRESET. Prints the failures and the number of passed tests of each kind; all
# names are in build/PRESET/ctest.log.
set -eu
cd "$(dirname "$0")/.."
folder="build/$1"
log="$folder/ctest.log"
echo "== C++ tests (ctest, $folder)"
code=0
ctest --test-dir "$folder" --output-on-failure --quiet --output-log "$log" --parallel "$(nproc)" </dev/null || code=$?
[ "$code" -eq 0 ] || grep -v -e '^ *Start ' -e ' Passed ' "$log" || true
sed -n 's/^ *[0-9]*\/[0-9]* Test.*: \([a-z]*\)\..* Passed .*/\1/p' "$log" | sort | uniq -c |
  awk '{ printf "%s%s %d", (NR > 1 ? ", " : ""), $2, $1 } END { print (NR ? " passed" : "no test passed") }'
exit "$code"
