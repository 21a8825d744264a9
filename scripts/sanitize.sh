#!/bin/sh
# The C++ tests under the address and undefined-behaviour sanitizers.
set -eu
cd "$(dirname "$0")/.."
sh scripts/build.sh sanitize
exec sh scripts/ctest.sh sanitize
