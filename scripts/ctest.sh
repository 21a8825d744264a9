#!/bin/sh
# ctest.sh PRESET: runs the C++ tests of build/PRESET. Prints the failures and the number of passed tests of each kind; all
# names are in build/PRESET/ctest.log.
set -eu
cd "$(dirname "$0")/.."
folder="build/$1"
log="$folder/ctest.log"
echo "== C++ tests (ctest, $folder)"
code=0
ctest --test-dir "$folder" --verbose --quiet --timeout 900 --output-log "$log" --parallel "$(nproc)" </dev/null || code=$?
# In the log, lines of test program 1 begin with "1: ", and "11/11 Test #1: unit ... Passed" follows them. Of a program that
# failed, all lines but those of its passed tests are shown. Programs without GoogleTest count as one test.
awk '
  split_line { $0 = split_line $0; split_line = "" }  # before CMake 4 the result is on the next line
  / Test +#[0-9]+:/ && !/ sec *$/ { split_line = $0; next }
  $1 ~ /^[0-9]+:$/ {
    if (/\[ RUN  /) { running[$1] = $0 "\n"; next }
    if (/\[       OK /) { running[$1] = ""; ++passed[$1]; next }
    shown[$1] = shown[$1] running[$1] $0 "\n"; running[$1] = ""
  }
  / Test +#[0-9]+:/ {
    line = $0
    sub(/^.*#/, ""); split($2, kind, ".")
    if (/ Passed /) count[kind[1]] += $1 in passed ? passed[$1] : 1
    else printf "%s%s%s\n", shown[$1], running[$1], line
  }
  END {
    for (name in count) { printf "%s%s %d", separator, name, count[name]; separator = ", " }
    print (separator ? " passed" : "no test passed")
  }' "$log"
exit "$code"
