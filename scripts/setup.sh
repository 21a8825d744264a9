#!/bin/sh
# Set-up of a fresh Debian or Ubuntu machine: system packages, then the Python environment in .venv.
# Does nothing if everything is installed. The other scripts call it first. Arguments: additional packages of a script.
set -eu
cd "$(dirname "$0")/.."

packages="cmake ninja-build g++ libeigen3-dev libsundials-dev libtomlplusplus-dev libgtest-dev libbenchmark-dev
  clang-format python3-venv xz-utils $*"

missing=
if command -v dpkg >/dev/null; then
  for package in $packages; do
    dpkg -s "$package" 2>/dev/null | grep -q '^Status: .* installed$' || missing="$missing $package"
  done
else
  echo "This is not Debian or Ubuntu; these packages are needed:" $packages >&2
fi

if [ -n "$missing" ]; then
  as_root=
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || {
      echo "Please install these packages as root, or install sudo:$missing" >&2
      exit 1
    }
    as_root=sudo
  fi
  echo "== system packages:$missing"
  # package scripts must never wait for input
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get update -q </dev/null
  $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $missing </dev/null
fi

# a moved folder, a changed pyproject.toml or another version requires a new environment
stamp="$PWD $( (cat pyproject.toml && grep '^__version__' build_fmu/__init__.py) | cksum)"
if [ "$(cat .venv/stamp 2>/dev/null || true)" != "$stamp" ]; then
  echo "== Python environment in .venv"
  [ "$(cut -d' ' -f1 .venv/place 2>/dev/null || true)" = "$(printf %s "$PWD" | cksum | cut -d' ' -f1)" ] || rm -rf .venv
  [ -x .venv/bin/python ] || python3 -m venv .venv
  pip=".venv/bin/python -m pip install --quiet --disable-pip-version-check --retries 5"
  # editable install: no wheel, and no compilation that `build.sh` would repeat
  $pip "scikit-build-core>=0.10" </dev/null
  $pip --no-build-isolation --config-settings wheel.cmake=false --config-settings editable.mode=inplace -e '.[test]' </dev/null
  printf %s "$PWD" | cksum >.venv/place
  echo "$stamp" >.venv/stamp
fi
