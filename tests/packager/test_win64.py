"""The win64 library under Wine: its runs are those of the Linux library. Slow; `make win64` builds what it needs."""

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
SYSTEM = {"KERNEL32.dll", "msvcrt.dll"}
pytestmark = pytest.mark.slow


def command(*words, **more) -> str:
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False, timeout=500, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def library() -> Path:
    try:
        return native.library("win64")
    except UserError as error:
        pytest.skip(str(error))


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


def test_shows_fmi_alone_and_needs_windows_alone(library):
    if not shutil.which("x86_64-w64-mingw32-objdump"):
        pytest.skip("mingw-w64 is not installed")
    text = command("x86_64-w64-mingw32-objdump", "-p", library)
    exported = set(re.findall(r"^\s*\[ *\d+\] (?:\+base\[ *\d+\]\s+[0-9a-f]+ )?(\w+)$", text, re.MULTILINE))
    assert "fmi2DoStep" in exported and len(exported) == 34
    assert all(name.startswith("fmi2") for name in exported)
    assert set(re.findall(r"DLL Name: (\S+)", text)) <= SYSTEM


@pytest.mark.parametrize(("name", "step", "steps"), [("kuka_kr5", 1e-3, 300), ("four_bar", 1e-3, 300), ("stiff_strut", 1e-3, 100)])
def test_runs_like_the_linux_library(library, players, wine, tmp_path, name, step, steps):
    file = ROOT / "models" / f"{name}.toml"
    model = describe(file)
    build(model, file, tmp_path / "both.fmu", platforms=["linux64", "win64"])
    folder = tmp_path / "unpacked fmu ü"
    with zipfile.ZipFile(tmp_path / "both.fmu") as archive:
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
