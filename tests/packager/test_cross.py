"""Cross-compiled libraries: what they export and need; the win64 library runs under Wine and the aarch64-linux library under QEMU like the
library for x86-64. A machine without macOS cannot run the darwin64 library. Slow; `make win64` and so on build what is needed."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.fmu.build import build
from build_fmu.model.describe import describe

ROOT = Path(__file__).parents[2]
CROSS = "x86_64-w64-mingw32-gcc-posix"
ARM = "aarch64-linux-gnu"
WINDOWS = {"KERNEL32.dll", "msvcrt.dll"}
pytestmark = pytest.mark.slow


def command(*words, **more) -> str:
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False, timeout=500, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def library(request) -> Path:
    try:
        return native.library(request.param)
    except UserError as error:
        pytest.skip(str(error))


win64 = pytest.mark.parametrize("library", ["win64"], indirect=True)
aarch64 = pytest.mark.parametrize("library", ["aarch64-linux"], indirect=True)
darwin64 = pytest.mark.parametrize("library", ["darwin64"], indirect=True)


def dumped(program: str, *options: object) -> str:
    if not shutil.which(program):
        pytest.skip(f"{program} is not installed")
    return command(program, *options)


def macho(*options: object) -> str:
    return dumped("llvm-objdump", "--macho", *options)


def exports_fmi_alone(names: set[str], prefix: str) -> bool:
    return {f"{prefix}2DoStep", f"{prefix}3DoStep"} < names and all(re.match(rf"{prefix}[23]", name) for name in names)


def both(name: str, platform: str, folder: Path) -> Path:
    """Returns an FMU with the Linux library and another one."""
    file = ROOT / "models" / f"{name}.toml"
    build(describe(file), file, folder / "both.fmu", platforms=["linux64", platform])
    return folder / "both.fmu"


@pytest.fixture(scope="module")
def players(tmp_path_factory) -> tuple[list[str], list[str]]:
    """Returns the command that plays a library here and the one that plays a DLL under Wine."""
    if not shutil.which("wine") or not shutil.which(CROSS):
        pytest.skip("Wine or mingw-w64 is not installed")
    folder = tmp_path_factory.mktemp("players")
    headers = Path(fmpy.__file__).parent / "c-code"
    source = ROOT / "tests" / "packager" / "play.c"
    command("cc", "-O1", f"-I{headers}", source, "-o", folder / "play", "-ldl")
    command(CROSS, "-O1", f"-I{headers}", source, "-o", folder / "play.exe", "-static")
    return [str(folder / "play")], ["wine", str(folder / "play.exe")]


@pytest.fixture(scope="module")
def wine(tmp_path_factory) -> dict[str, str]:
    return {**os.environ, "WINEPREFIX": str(tmp_path_factory.mktemp("wine")), "WINEDEBUG": "-all", "DISPLAY": "", "LC_ALL": "C.UTF-8"}


@win64
def test_exports_fmi_and_needs_windows_alone(library):
    text = dumped("x86_64-w64-mingw32-objdump", "-p", library)
    assert exports_fmi_alone(set(re.findall(r"^\s*\[ *\d+\] (?:\+base\[ *\d+\]\s+[0-9a-f]+ )?(\w+)$", text, re.MULTILINE)), "fmi")
    assert set(re.findall(r"DLL Name: (\S+)", text)) <= WINDOWS


@win64
@pytest.mark.parametrize(("name", "step", "steps"), [("kuka_kr5", 1e-3, 300), ("four_bar", 1e-3, 300), ("stiff_strut", 1e-3, 100)])
def test_runs_like_the_linux_library(library, players, wine, tmp_path, name, step, steps):
    model = describe(ROOT / "models" / f"{name}.toml")
    folder = tmp_path / "unpacked fmu ü"
    with zipfile.ZipFile(both(name, "win64", tmp_path)) as archive:
        archive.extractall(folder)
    inputs = ",".join(str(v.value_reference) for v in model.select("input") if v.type == "Real")
    shown = [v for v in model.select("output") if v.type == "Real" and re.search(r"\.(q|qd)$|^energy\.(kinetic|potential)$", v.name)]
    outputs = ",".join(str(v.value_reference) for v in shown)
    arguments = [model.guid, repr(step), str(steps), inputs, outputs]
    here, there = players
    linux = command(*here, folder / "binaries" / "linux64" / f"{name}.so", (folder / "resources").as_uri(), *arguments)
    # Wine's drive Z is the root of this machine
    windows = command(
        *there,
        f"Z:{folder}/binaries/win64/{name}.dll".replace("/", "\\"),
        f"file:///Z:{(folder / 'resources').as_uri()[7:]}",
        *arguments,
        env=wine,
    )
    ours, theirs = (np.array([[float(word) for word in line.split()] for line in text.splitlines()]) for text in (linux, windows))
    assert ours.shape == (steps, len(shown)) and theirs.shape == ours.shape
    assert np.ptp(ours, axis=0).max() > 1e-3, "the model must move"
    scale = np.maximum(1, np.abs(ours).max(axis=0))
    assert (np.abs(theirs - ours) / scale).max() < 1e-9


@pytest.fixture(scope="module")
def arm(tmp_path_factory) -> list[str]:
    """Returns the command that plays a library for Arm."""
    if not shutil.which("qemu-aarch64-static") or not shutil.which(f"{ARM}-gcc"):
        pytest.skip("QEMU or the compiler for Arm is not installed")
    program = tmp_path_factory.mktemp("arm") / "play"
    command(
        f"{ARM}-gcc", "-O1", f"-I{Path(fmpy.__file__).parent / 'c-code'}", ROOT / "tests" / "packager" / "play.c", "-o", program, "-ldl"
    )
    return ["qemu-aarch64-static", "-L", f"/usr/{ARM}", str(program)]


@pytest.fixture(scope="module")
def here(tmp_path_factory) -> list[str]:
    program = tmp_path_factory.mktemp("here") / "play"
    command("cc", "-O1", f"-I{Path(fmpy.__file__).parent / 'c-code'}", ROOT / "tests" / "packager" / "play.c", "-o", program, "-ldl")
    return [str(program)]


def on_both(name: str, here: list[str], arm: list[str], shown: str, step: float, steps: int, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Returns the variables that match `shown`, of both processors."""
    model = describe(ROOT / "models" / f"{name}.toml")
    with zipfile.ZipFile(both(name, "aarch64-linux", folder)) as archive:
        archive.extractall(folder / "unpacked")
    inputs, read = (
        ",".join(str(v.value_reference) for v in chosen[:200])
        for chosen in (
            [v for v in model.select("input") if v.type == "Real"],
            [v for v in model.variables if v.type == "Real" and v.causality in ("output", "local") and re.search(shown, v.name)],
        )
    )
    rows = []
    for player, platform in ((here, "linux64"), (arm, "aarch64-linux")):
        library = folder / "unpacked" / "binaries" / platform / f"{model.model_identifier}.so"
        text = command(*player, library, (folder / "unpacked" / "resources").as_uri(), model.guid, repr(step), steps, inputs, read)
        rows.append(np.array([[float(word) for word in line.split()] for line in text.splitlines()]))
    assert rows[0].shape == rows[1].shape and rows[0].shape[0] == steps and rows[0].size
    return rows[0], rows[1]


@aarch64
def test_exports_fmi_and_needs_the_c_library_alone(library):
    text = dumped(f"{ARM}-objdump", "-Tp", library)
    needed = set(re.findall(r"NEEDED +(\S+)", text))
    assert needed <= {"libc.so.6", "libm.so.6", "ld-linux-aarch64.so.1"}
    assert exports_fmi_alone(set(re.findall(r" g +DF .text\s+\w+\s+(?:Base|FMI\w*)?\s*(\w+)$", text, re.MULTILINE)), "fmi")
    assert {version for version in re.findall(r"GLIBC_([\d.]+)", text)} == {"2.17"}, "the first glibc for these processors"


@aarch64
@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "models").glob("*.toml") if not path.stem.startswith("redysim_")))
def test_accelerations_are_those_of_the_other_processor(library, here, arm, tmp_path, name):
    # after a step that moves nothing
    ours, theirs = on_both(name, here, arm, r"\.(qdd|alpha\[\d\])$", 1e-9, 1, tmp_path)
    assert np.isfinite(ours).all()
    assert np.abs(theirs - ours).max() < 1e-12 * max(1, np.abs(ours).max())


@aarch64
@pytest.mark.parametrize("name", ["kuka_kr5", "four_bar", "stiff_strut", "series_elastic_leg", "rolling_ball", "mimic_hand", "quadruped"])
def test_trajectories_are_those_of_the_other_processor(library, here, arm, tmp_path, name):
    ours, theirs = on_both(name, here, arm, r"\.(q|qd|omega\[\d\])$", 1e-3, 100, tmp_path)
    assert np.ptp(ours, axis=0).max() > 1e-4, "the model must move"
    rtol = next(v.start for v in describe(ROOT / "models" / f"{name}.toml").variables if v.name == "solver.rtol")
    assert np.abs(theirs - ours).max() < 100 * rtol * max(1, np.abs(ours).max())


@darwin64
def test_exports_fmi_alone(library):
    exported = re.findall(r"^0x[0-9A-F]+\s+(\S+)", macho("--exports-trie", library), re.MULTILINE)
    # the last two are the linker's own
    assert exports_fmi_alone(set(exported) - {"___dso_handle", "__mh_dylib_header"}, "_fmi")


@darwin64
def test_needs_the_system_library_alone(library):
    needed = re.findall(r"^\t(\S+) \(", macho("--dylibs-used", library), re.MULTILINE)
    assert needed == ["@rpath/libredysim_fmu.dylib", "/usr/lib/libSystem.B.dylib"], "its own name, and what it needs"
    assert re.search(r"platform macos\s+sdk \S+\s+minos 11\.0\s", macho("--private-headers", library))


@darwin64
def test_shares_nothing_with_other_libraries(library):
    # a weak definition, such as operator new, would be one for the whole process
    flags = macho("--private-header", library)
    assert "DYLIB" in flags and "WEAK_DEFINES" not in flags and "BINDS_TO_WEAK" not in flags


@darwin64
def test_lies_beside_the_linux_library(library, tmp_path):
    with zipfile.ZipFile(both("pendulum", "darwin64", tmp_path)) as archive:
        assert archive.read("binaries/darwin64/pendulum.dylib") == library.read_bytes()
        assert "binaries/linux64/pendulum.so" in archive.namelist()
