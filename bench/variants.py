"""The library without some of its parts, and the corresponding `describe`.

Two builds run in parallel, because linking occupies one processor for a long time. ccache, if installed, shares the objects that do not
depend on the parts. Each library has a folder in build/parts, which is updated incrementally.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "build" / "parts"


@dataclass(frozen=True)
class Build:
    """A library and the `describe` of the same parts."""

    library: Path
    program: Path


def _build(name: str, features: tuple[str, ...], processors: int) -> Build:
    """Configures and builds one library; on failure exits with the end of the compiler's output."""
    import fmpy

    folder = FOLDER / name
    folder.mkdir(parents=True, exist_ok=True)
    settings = {
        "CMAKE_BUILD_TYPE": "Release",
        "REDYSIM_TESTS": "OFF",
        "REDYSIM_FEATURES": ";".join(features) or "none",
        "REDYSIM_FMI_HEADERS": str(Path(fmpy.__file__).parent / "c-code"),
    }
    if shutil.which("ccache") and "CMAKE_CXX_COMPILER_LAUNCHER" not in os.environ:
        settings["CMAKE_CXX_COMPILER_LAUNCHER"] = "ccache"
    commands = [
        ["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", *(f"-D{key}={value}" for key, value in settings.items())],
        ["cmake", "--build", folder, "--parallel", str(processors), "--target", "redysim_fmu", "describe"],
    ]
    for command in commands:
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"the library without {name} could not be built:\n{(done.stdout + done.stderr)[-2000:]}")
    return Build(folder / "fmu_src" / "fmi" / "libredysim_fmu.so", folder / "fmu_src" / "fmi" / "describe")


def build_each(wanted: dict[str, tuple[str, ...]]) -> dict[str, Build]:
    """Builds a library for each set of features and prints the progress; failures are reported and omitted."""
    processors = os.cpu_count() or 1
    found: dict[str, Build] = {}
    begin = time.monotonic()
    with ThreadPoolExecutor(min(2, processors)) as pool:
        running = {
            pool.submit(_build, name, features, max(1, processors // min(2, len(wanted)))): name for name, features in wanted.items()
        }
        for number, done in enumerate(as_completed(running), 1):
            name, passed = running[done], time.monotonic() - begin
            try:
                found[name] = done.result()
                print(f"  {number} of {len(wanted)} libraries: without {name}, {passed:.0f} s elapsed", file=sys.stderr, flush=True)
            except RuntimeError as error:
                print(f"  {number} of {len(wanted)} libraries: {error}", file=sys.stderr, flush=True)
    return found
