#!/bin/sh
# Lint, C++ tests, Python tests. Stops at the first that fails, so the last lines say what happened.
set -eu
cd "$(dirname "$0")/.."
sh scripts/lint.sh
sh scripts/build.sh release
if [ -f build/release/CTestTestfile.cmake ]; then
  echo "== C++ tests (ctest, build/release)"
  ctest --test-dir build/release --output-on-failure --progress --parallel "$(nproc)" </dev/null
fi
echo "== Python tests (pytest:$(find tests -name 'test_*.py' -exec dirname {} \; | sort -u | tr '\n' ' ' | sed 's/^/ /'))"
exec .venv/bin/python -m pytest -q </dev/null
