#!/bin/sh
# lint.sh [--fix]: the project's own rules (scripts/lint.py), ruff for Python, clang-format for C++. --fix repairs what it can.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh
echo "== lint"
.venv/bin/python scripts/lint.py

python="build_fmu tests scripts bench examples docs models"
ruff=".venv/bin/ruff"
if [ "${1:-}" = --fix ]; then
  $ruff check --quiet --fix $python
  $ruff format --quiet $python
else
  $ruff check --quiet $python
  $ruff format --quiet --check $python
fi

# releases of clang-format disagree on details: the layout is that of release 14, others only advise
if command -v clang-format >/dev/null; then
  mode="--dry-run"
  clang-format --version | grep -q 'version 14\.' && mode="--dry-run --Werror"
  [ "${1:-}" = --fix ] && mode=-i
  find fmu_src tests $([ ! -d bench ] || echo bench) \( -name '*.hpp' -o -name '*.cpp' \) -print0 | xargs -0r clang-format $mode
fi
