#!/bin/sh
# The C++ tests under the address and undefined-behaviour sanitizers.
set -eu
cd "$(dirname "$0")/.."
sh scripts/build.sh sanitize
echo "== C++ tests (ctest, build/sanitize)"
exec ctest --test-dir build/sanitize --output-on-failure --progress --parallel "$(nproc)" </dev/null
