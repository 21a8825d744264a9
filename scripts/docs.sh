#!/bin/sh
# The docs as a site in out/site, with the pages of the C++ headers in out/site/api. A broken link or a warning of Doxygen is an error.
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh doxygen
.venv/bin/python -c "import material" 2>/dev/null || {
  echo "== install mkdocs"
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --retries 5 "mkdocs>=1.6" "mkdocs-material>=9.5" </dev/null
}
echo "== pages of docs/"
NO_MKDOCS_2_WARNING=1 .venv/bin/python -m mkdocs build --strict --quiet
echo "== pages of the C++ headers"
rm -rf build/headers
.venv/bin/python scripts/doxygen_filter.py fmu_src build/headers
VERSION="$(.venv/bin/python -c 'import build_fmu; print(build_fmu.__version__)')" doxygen docs/Doxyfile
echo "The site is in: $PWD/out/site (open index.html)"
