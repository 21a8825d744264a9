#!/bin/sh
# coverage.sh [python]: line coverage of build_fmu by its own tests and those of built FMUs and, without an argument, of fmu_src by the C++ tests
# and the tests of built FMUs. Tables and pages are left in out/coverage.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh
.venv/bin/python -c "import coverage, gcovr" 2>/dev/null ||
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --retries 5 "coverage>=7.10" "gcovr>=8" </dev/null
if [ "${1:-}" = python ]; then
  preset=release
  sh scripts/build.sh release redysim_fmu describe fmu_driver
else
  preset=coverage
  sh scripts/build.sh coverage
  find build/coverage -name '*.gcda' -delete
  sh scripts/ctest.sh coverage
fi
rm -rf out/coverage
mkdir -p out/coverage

REDYSIM_FMU_LIBRARY="$PWD/build/$preset/fmu_src/fmi/libredysim_fmu.so"
REDYSIM_FMU_DESCRIBE="$PWD/build/$preset/fmu_src/fmi/describe"
REDYSIM_FMU_DRIVER="$PWD/build/$preset/fmu_src/drive/fmu_driver"
COVERAGE_FILE="$PWD/out/coverage/data"
export REDYSIM_FMU_LIBRARY REDYSIM_FMU_DESCRIBE REDYSIM_FMU_DRIVER COVERAGE_FILE
# not the tests of the released library's own properties: size, symbols, speed
.venv/bin/python -m coverage run -m pytest -q tests/packager tests/fmi tests/library --ignore=tests/fmi/test_library.py </dev/null
.venv/bin/python -m coverage combine --quiet
.venv/bin/python -m coverage html --quiet -d out/coverage/python
.venv/bin/python -m coverage report --sort=cover >out/coverage/python.txt
echo "== Python (build_fmu)"
tail -1 out/coverage/python.txt
if [ "$preset" = coverage ]; then
  .venv/bin/python -m gcovr --root . --filter fmu_src/ --exclude-throw-branches --merge-mode-functions=merge-use-line-0 \
    --html-details out/coverage/cpp.html --txt out/coverage/cpp.txt build/coverage
  echo "== C++ (fmu_src)"
  tail -3 out/coverage/cpp.txt
fi
echo "Tables and pages are in: $PWD/out/coverage"
