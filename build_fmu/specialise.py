"""Compiles a library for one scene: unused parts left out, forward dynamics as straight-line code where that is faster.

Needs the source tree, CMake and a C++ compiler; what is built stays in `build/specialised/NAME` for the next time.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

from build_fmu import native
from build_fmu.describe import Description
from build_fmu.errors import UserError


@dataclass(frozen=True)
class Specialised:
    """A library for one scene, and what was done for it."""

    library: Path
    features: list[str]
    no_straight_line: str  # why not; empty: there is one

    def summary(self) -> str:
        """Returns a line that says what the library holds and how large it is."""
        line = f"no straight line: {self.no_straight_line}" if self.no_straight_line else "forward dynamics as a straight line"
        size, general = self.library.stat().st_size, native.library().stat().st_size
        return f"specialised: parts {', '.join(self.features) or 'none'}; {line}; {size / 1e3:.0f} kB instead of {general / 1e3:.0f} kB"


def specialise(model: Description, model_file: Path) -> Specialised:
    """Compiles the library of a described model; raises UserError where the tools for it are missing or fail."""
    source = native.SOURCE_TREE
    if not (source / "CMakeLists.txt").is_file() or not (source / "fmu_src").is_dir():
        raise UserError("--specialise compiles a library and needs build_fmu's source tree: install it from there")
    for tool in ("cmake", "ninja"):
        if not shutil.which(tool):
            raise UserError(f"--specialise compiles a library and needs {tool}, which is not installed")
    folder = source / "build" / "specialised" / model.model_identifier
    folder.mkdir(parents=True, exist_ok=True)
    line, reason = _straight_line(model_file, folder)
    settings = {
        "CMAKE_BUILD_TYPE": "Release",
        "REDYSIM_TESTS": "OFF",
        "REDYSIM_FEATURES": ";".join(model.features) or "none",
        "REDYSIM_STRAIGHT_LINE": str(line or ""),
        "REDYSIM_FMI_HEADERS": str(_fmi_headers()),
    }
    _run(["cmake", "-S", str(source), "-B", str(folder), "-G", "Ninja", *(f"-D{key}={value}" for key, value in settings.items())], folder)
    _run(["cmake", "--build", str(folder), "--target", "redysim_fmu", "--parallel", str(os.cpu_count() or 1)], folder)
    return Specialised(folder / "fmu_src" / "fmi" / "libredysim_fmu.so", model.features, reason)


def _straight_line(model_file: Path, folder: Path) -> tuple[Path | None, str]:
    """Returns the C++ file with the scene's forward dynamics, or why there is none."""
    run = subprocess.run([str(native.describe_program()), "--straight-line", str(model_file)], capture_output=True, text=True, check=False)
    if run.returncode != 0:
        return None, run.stderr.strip().removeprefix("describe: ")
    file = folder / "straight_line.cpp"
    # an unchanged file needs no new build
    if not file.is_file() or file.read_text(encoding="utf-8") != run.stdout:
        file.write_text(run.stdout, encoding="utf-8")
    return file, ""


def _fmi_headers() -> Path:
    import fmpy

    return Path(fmpy.__file__).parent / "c-code"


def _run(command: list[str], folder: Path) -> None:
    """Runs a step of the build; its output goes to a log, whose end is the error."""
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    log = folder / "build.log"
    with log.open("a", encoding="utf-8") as file:
        file.write(" ".join(command) + "\n" + run.stdout + run.stderr)
    if run.returncode != 0:
        end = "\n".join((run.stdout + run.stderr).strip().splitlines()[-15:])
        raise UserError(f"the specialised library was not built, see '{log}':\n{end}")
