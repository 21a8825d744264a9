"""Programs of the benchmarks and the Python of the other simulators; a script that lacks one ends with the command that makes it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PYTHON = ROOT / "build" / "peers" / "bin" / "python"


def program(name: str, build: str | Path | None = None) -> Path:
    """Returns a program in a build folder, by default build/bench or build/release."""
    folders = [Path(build)] if build else [ROOT / "build" / preset for preset in ("bench", "release")]
    places = [folder / "bench" / name for folder in folders]
    return existing(next((place for place in places if place.exists()), places[0]))


def existing(file: Path) -> Path:
    """Returns the file of a program."""
    if not file.exists():
        sys.exit(f"'{file}' is not built: run `sh scripts/build.sh bench {file.name}`")
    return file


def imports(python: Path, modules: str) -> bool:
    """Returns whether an interpreter exists and has these modules."""
    return python.exists() and not subprocess.run([python, "-c", f"import {modules}"], capture_output=True).returncode


def python_with(module: str) -> Path:
    """Returns the interpreter of the simulators' environment, with this module."""
    if not imports(PYTHON, module):
        sys.exit(f"build/peers has no Python that imports {module}: run `sh scripts/peers.sh`")
    return PYTHON
