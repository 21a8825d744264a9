"""The darwin64 library as far as a machine without macOS can tell: what it shows, what it needs, where it lies. Slow;
`make darwin64` builds what it needs."""

from __future__ import annotations

import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.fmu.build import build
from build_fmu.model.describe import describe

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def library() -> Path:
    try:
        return native.library("darwin64")
    except UserError as error:
        pytest.skip(str(error))


def told(*options: object) -> str:
    program = shutil.which("llvm-objdump")
    if not program:
        pytest.skip("llvm-objdump is not installed")
    done = subprocess.run([program, "--macho", *map(str, options)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_shows_fmi_alone(library):
    exported = re.findall(r"^0x[0-9A-F]+\s+(\S+)", told("--exports-trie", library), re.MULTILINE)
    # the last two are the linker's own
    shown = set(exported) - {"___dso_handle", "__mh_dylib_header"}
    assert "_fmi2DoStep" in shown and len(shown) == 34
    assert all(name.startswith("_fmi2") for name in shown)


def test_needs_the_system_library_alone(library):
    needed = re.findall(r"^\t(\S+) \(", told("--dylibs-used", library), re.MULTILINE)
    assert needed == ["@rpath/libredysim_fmu.dylib", "/usr/lib/libSystem.B.dylib"], "its own name, and what it needs"
    assert re.search(r"platform macos\s+sdk \S+\s+minos 11\.0\s", told("--private-headers", library))


def test_shares_nothing_with_other_libraries(library):
    # a weak definition, such as operator new, would be one for the whole process
    flags = told("--private-header", library)
    assert "DYLIB" in flags and "WEAK_DEFINES" not in flags and "BINDS_TO_WEAK" not in flags


def test_lies_beside_the_linux_library(library, tmp_path):
    file = ROOT / "models" / "pendulum.toml"
    build(describe(file), file, tmp_path / "both.fmu", platforms=["linux64", "darwin64"])
    with zipfile.ZipFile(tmp_path / "both.fmu") as archive:
        assert archive.read("binaries/darwin64/pendulum.dylib") == library.read_bytes()
        assert "binaries/linux64/pendulum.so" in archive.namelist()
