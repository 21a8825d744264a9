"""The shared library: what it shows, what it needs, how big it is."""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

import fmpy
import pytest

from build_fmu import native

FMI3_HEADER = Path(fmpy.__file__).parent / "c-code" / "fmi3Functions.h"

FUNCTIONS = """
GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment EnterInitializationMode
ExitInitializationMode Terminate Reset GetReal GetInteger GetBoolean GetString SetReal SetInteger SetBoolean SetString
GetFMUstate SetFMUstate FreeFMUstate SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate
GetDirectionalDerivative SetRealInputDerivatives GetRealOutputDerivatives DoStep CancelStep GetStatus GetRealStatus
GetIntegerStatus GetBooleanStatus GetStringStatus EnterEventMode NewDiscreteStates EnterContinuousTimeMode
CompletedIntegratorStep SetTime SetContinuousStates GetContinuousStates GetDerivatives GetNominalsOfContinuousStates
GetEventIndicators
""".split()


@pytest.fixture(scope="module")
def library(fmu_file):  # fmu_file skips when nothing is built
    return native.library()


def tool(*command) -> str:
    if not shutil.which(command[0]):
        pytest.skip(f"{command[0]} is not installed")
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, check=True).stdout


def test_exports_the_standard_and_nothing_else(library):
    symbols = {line.split()[-1].split("@")[0] for line in tool("nm", "-D", "--defined-only", library).splitlines()}
    declared = re.findall(r"^FMI3_Export (fmi3\w+)TYPE\s+fmi3\w+;", FMI3_HEADER.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(declared) == 75
    assert symbols == {f"fmi2{name}" for name in FUNCTIONS} | set(declared)


def test_needs_libc_and_libm_only(library):
    needed = re.findall(r"NEEDED.*\[(.*?)\]", tool("readelf", "-d", library))
    assert set(needed) <= {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}


def test_loads_with_the_glibc_of_older_systems(library):
    if tuple(int(part) for part in platform.libc_ver()[1].split(".")) > (2, 36):
        pytest.skip("built with a newer glibc than that of Debian 12, which the released library is built with")
    versions = re.findall(r"GLIBC_(\d+)\.(\d+)", tool("objdump", "-T", library))
    assert max((int(major), int(minor)) for major, minor in versions) <= (2, 17)


def test_is_hardened(library):
    headers, dynamic = tool("readelf", "-lW", library), tool("readelf", "-d", library)
    assert re.search(r"GNU_STACK.* RW ", headers), "the stack must not be executable"
    assert "GNU_RELRO" in headers and "BIND_NOW" in dynamic
    assert "RPATH" not in dynamic and "RUNPATH" not in dynamic
    assert "UNIQUE" not in tool("readelf", "-sW", library)


def test_is_at_most_1_3_megabytes(library):
    cache = library.parents[2] / "CMakeCache.txt"  # build/release of the source tree
    place = re.search(r"^REDYSIM_SUNDIALS:PATH=(.*)$", cache.read_text(encoding="utf-8") if cache.is_file() else "", re.MULTILINE)
    if place and not (Path(place[1]) / "lib" / "libsundials_arkode.a").is_file():
        pytest.skip("linked with the distribution's SUNDIALS: the source for scripts/sundials.sh was not available")
    assert library.stat().st_size <= 1_300_000


def test_version_and_platform(fmu):
    library = fmu("pendulum").library
    assert library.fmi2GetVersion() == b"2.0"
    assert library.fmi2GetTypesPlatform() == b"default"


def test_loading_and_unloading_from_new_paths_leaves_nothing_behind(library, tmp_path):
    program = """
import _ctypes, ctypes, os, shutil, sys
library, folder = sys.argv[1:]

def kilobytes():
    return int(open("/proc/self/statm").read().split()[1]) * 4

for k in range(700):
    path = os.path.join(folder, f"l{k}.so")
    shutil.copy(library, path)
    handle = ctypes.CDLL(path)
    handle.fmi2GetVersion.restype = ctypes.c_char_p
    assert handle.fmi2GetVersion() == b"2.0"
    _ctypes.dlclose(handle._handle)
    os.remove(path)
    if k == 100:
        before = kilobytes()
print(kilobytes() - before)
"""
    run = subprocess.run([sys.executable, "-c", program, str(library), str(tmp_path)], capture_output=True, text=True)
    assert int(run.stdout) < 600, run.stderr
