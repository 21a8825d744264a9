#!/bin/sh
# The C++ tests under the address and undefined-behaviour sanitizers, then many threads with one instance each under the
# thread sanitizer.
set -eu
cd "$(dirname "$0")/.."
sh scripts/build.sh sanitize
sh scripts/ctest.sh sanitize
sh scripts/build.sh threads many_threads
echo "== threads (build/threads)"
cd models
exec ../build/threads/tests/many_threads gripper.toml kuka_kr5.toml four_bar.toml stiff_strut.toml stick_slip.toml </dev/null
