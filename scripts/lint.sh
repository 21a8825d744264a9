#!/bin/sh
# lint.sh [--fix]: the project's own rules (scripts/lint.py), then the layout of the C++ files.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh
echo "== lint"
python3 scripts/lint.py

# releases of clang-format disagree on details: the layout is that of release 14, others only advise
if command -v clang-format >/dev/null; then
  mode="--dry-run"
  clang-format --version | grep -q 'version 14\.' && mode="--dry-run --Werror"
  [ "${1:-}" = --fix ] && mode=-i
  find fmu_src tests $([ ! -d bench ] || echo bench) \( -name '*.hpp' -o -name '*.cpp' \) -print0 | xargs -0r clang-format $mode
fi
