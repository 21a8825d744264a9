"""Cross-compiled libraries: what they export and need; the win64 library runs under Wine and the aarch64-linux library under QEMU like the
library for x86-64. A machine without macOS cannot run the darwin64 library. The programs of a wheel for Linux agree with those of gcc. Slow;
`make win64` and so on build what is needed."""

from __future__ import annotations

import itertools
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
from build_fmu.library.batch import simulate_batch
from build_fmu.model.describe import describe
from build_fmu.run.driver import Task, drive, staged

ROOT = Path(__file__).parents[2]
CROSS = "x86_64-w64-mingw32-gcc-posix"
ARM = "aarch64-linux-gnu"
WINDOWS = {"KERNEL32.dll", "msvcrt.dll"}
KINDS = ["2cs", "2me", "3cs", "3me"]  # of play.c
STIFF = ["stiff_strut", "series_elastic_leg", "rolling_ball", "mimic_hand", "quadruped"]
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


@pytest.fixture(scope="module")
def player(tmp_path_factory):
    """Compiles the player of libraries; skips where the compiler or the program that runs its result is missing."""

    def compiled(compiler: str, *runner: str, options: tuple[str, ...] = ("-ldl",), name: str = "play") -> list[str]:
        for program in (compiler, *runner[:1]):
            if not shutil.which(program):
                pytest.skip(f"{program} is not installed")
        target = tmp_path_factory.mktemp("player") / name
        headers = Path(fmpy.__file__).parent / "c-code"
        command(compiler, "-O1", f"-I{headers}", ROOT / "tests" / "packager" / "play.c", "-o", target, *options)
        return [*runner, str(target)]

    return compiled


@pytest.fixture(scope="module")
def here(player) -> list[str]:
    return player("cc")


@pytest.fixture(scope="module")
def arm(player) -> list[str]:
    return player(f"{ARM}-gcc", "qemu-aarch64-static", "-L", f"/usr/{ARM}")


@pytest.fixture(scope="module")
def windows(player) -> list[str]:
    return player(CROSS, "wine", options=("-static",), name="play.exe")


@pytest.fixture(scope="module")
def wine(tmp_path_factory) -> dict[str, str]:
    return {**os.environ, "WINEPREFIX": str(tmp_path_factory.mktemp("wine")), "WINEDEBUG": "-all", "DISPLAY": "", "LC_ALL": "C.UTF-8"}


class Job:
    """Runs an FMU with the libraries of two systems; `kind` as in play.c."""

    def __init__(self, name: str, platform: str, kind: str, shown: str, folder: Path, *causalities: str) -> None:
        file = ROOT / "models" / f"{name}.toml"
        self.model, self.kind, self.folder = describe(file), kind, folder / "unpacked fmu ü"
        build(self.model, file, folder / "both.fmu", platforms=["linux64", platform], fmi=int(kind[0]))
        with zipfile.ZipFile(folder / "both.fmu") as archive:
            archive.extractall(self.folder)
        real = [v for v in self.model.variables if v.type == "Real"]
        inputs = [v for v in real if v.causality == "input"]
        outputs = [v for v in real if v.causality in (causalities or ("output",)) and re.search(shown, v.name)]
        self.references = [",".join(str(v.value_reference) for v in chosen[:200]) for chosen in (inputs, outputs)]

    def rows(self, player: list[str], platform: str, step: float, steps: int, **more) -> np.ndarray:
        """Returns the outputs after each step, with the library of one platform."""
        fmi3, wine = self.kind[0] == "3", platform == "win64"
        binaries = self.folder / "binaries" / (native.PLATFORM_TUPLES[platform] if fmi3 else platform)
        library, place = str(binaries / f"{self.model.model_identifier}.{'dll' if wine else 'so'}"), f"{self.folder}/resources/"
        if wine:  # drive Z is the root of this machine
            library, place = (f"Z:{path}".replace("/", "\\") for path in (library, place))
        if not fmi3:
            place = f"file:///{'Z:/' if wine else ''}{(self.folder / 'resources').as_uri().removeprefix('file:///')}"
        states = len(self.model.derivatives)
        text = command(*player, library, self.kind, place, self.model.guid, states, repr(step), steps, *self.references, **more)
        rows = np.array([[float(word) for word in line.split()] for line in text.splitlines()])
        assert len(rows) == steps and rows.size and np.isfinite(rows).all()
        return rows


@win64
def test_exports_fmi_and_needs_windows_alone(library):
    text = dumped("x86_64-w64-mingw32-objdump", "-p", library)
    assert exports_fmi_alone(set(re.findall(r"^\s*\[ *\d+\] (?:\+base\[ *\d+\]\s+[0-9a-f]+ )?(\w+)$", text, re.MULTILINE)), "fmi")
    assert set(re.findall(r"DLL Name: (\S+)", text)) <= WINDOWS


@win64
@pytest.mark.parametrize(("name", "kind"), [*itertools.product(["kuka_kr5", "four_bar"], KINDS), ("stiff_strut", "2cs")])
def test_runs_like_the_linux_library(library, here, windows, wine, tmp_path, name, kind):
    job = Job(name, "win64", kind, r"\.(q|qd)$|^energy\.(kinetic|potential)$", tmp_path)
    # the method of a stiff model corrects its fast motion to the tolerance only
    steps, bound = (100, 1e-8) if name == "stiff_strut" else (300, 1e-9)
    ours, theirs = job.rows(here, "linux64", 1e-3, steps), job.rows(windows, "win64", 1e-3, steps, env=wine)
    assert np.ptp(ours, axis=0).max() > 1e-3, "the model must move"
    assert (np.abs(theirs - ours) / np.maximum(1, np.abs(ours).max(axis=0))).max() < bound


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
    # after a step that moves nothing; of loops without outputs of acceleration the forces
    job = Job(name, "aarch64-linux", "2cs", r"\.(qdd|alpha\[\d\]|lambda\[\d\])$", tmp_path, "output", "local")
    ours, theirs = job.rows(here, "linux64", 1e-9, 1), job.rows(arm, "aarch64-linux", 1e-9, 1)
    assert np.abs(theirs - ours).max() < 1e-12 * max(1, np.abs(ours).max())


@aarch64
@pytest.mark.parametrize(("name", "kind"), [*itertools.product(["kuka_kr5", "four_bar"], KINDS), *((name, "2cs") for name in STIFF)])
def test_trajectories_are_those_of_the_other_processor(library, here, arm, tmp_path, name, kind):
    job = Job(name, "aarch64-linux", kind, r"\.(q|qd|omega\[\d\])$", tmp_path, "output", "local")
    ours, theirs = job.rows(here, "linux64", 1e-3, 100), job.rows(arm, "aarch64-linux", 1e-3, 100)
    assert np.ptp(ours, axis=0).max() > 1e-4, "the model must move"
    rtol = next(v.start for v in job.model.variables if v.name == "solver.rtol")
    assert np.abs(theirs - ours).max() < 100 * rtol * max(1, np.abs(ours).max())


@pytest.fixture
def linux64(request) -> Path:
    """A program that scripts/linux64.cmake has compiled for a wheel."""
    name = request.param
    path = ROOT / "build" / "linux64" / "fmu_src" / native.ROOMS[name] / name
    if not path.is_file():
        pytest.skip(f"'{name}' is not built: run `make wheel`")
    return path


@pytest.mark.parametrize("linux64", ["describe", "fmu_driver"], indirect=True)
def test_linux64_needs_glibc_2_17(linux64):
    needed = set(re.findall(r"\(NEEDED\).*\[(\w+)", dumped("readelf", "-d", linux64)))
    assert needed <= {"libc", "libm", "libpthread", "libdl", "librt", "ld"}
    assert max(int(n) for n in re.findall(r"GLIBC_2\.([0-9]+)", dumped("readelf", "-V", linux64))) <= 17


@pytest.mark.parametrize("linux64", ["describe"], indirect=True)
@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "models").glob("*.toml")))
def test_linux64_describes_like_gcc(linux64, name):
    file = ROOT / "models" / f"{name}.toml"
    assert command(linux64, file) == command(native.describe_program(), file)


@pytest.mark.parametrize("linux64", ["fmu_driver"], indirect=True)
def test_linux64_drives_like_gcc(linux64, monkeypatch):
    with staged(ROOT / "models" / "kuka_kr5.toml") as fmu:
        task = Task(1e-3, 100, outputs=fmu.reals())
        theirs = drive(fmu, task)
        monkeypatch.setenv("REDYSIM_FMU_DRIVER", str(linux64))
        ours = drive(fmu, task)
        batch = simulate_batch(fmu, task, None, {"solver.rtol": [1e-4, 1e-6, 1e-8]}, 2)
    assert ours.status == "ok" and ours.health == theirs.health and np.array_equal(ours.values, theirs.values)
    assert batch.status == ["ok"] * 3 and np.isfinite(batch.values).all()


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
    file = ROOT / "models" / "pendulum.toml"
    build(describe(file), file, tmp_path / "both.fmu", platforms=["linux64", "darwin64"])
    with zipfile.ZipFile(tmp_path / "both.fmu") as archive:
        assert archive.read("binaries/darwin64/pendulum.dylib") == library.read_bytes()
        assert "binaries/linux64/pendulum.so" in archive.namelist()
