#!/bin/sh
# Lint, C++ tests, Python tests. Stops at the first failure, so the last lines show the reason.
set -eu
cd "$(dirname "$0")/.."
sh scripts/lint.sh
sh scripts/build.sh release
sh scripts/ctest.sh release
echo "== Python tests (pytest:$(find tests -name 'test_*.py' -exec dirname {} \; | sort -u | tr '\n' ' ' | sed 's/^/ /'))"
exec .venv/bin/python -m pytest -q --numprocesses "$(nproc)" --dist worksteal </dev/null
