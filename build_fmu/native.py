"""Finds the compiled files: the programs `describe` and `fmu_driver`, and the shared library of the FMUs.

Search order: environment variable, the package's `native/` folder (in a wheel), the build folder of the source tree.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from build_fmu.errors import UserError

PACKAGE = Path(__file__).resolve().parent
SOURCE_TREE = PACKAGE.parent
BUILT = SOURCE_TREE / "build" / "release" / "fmu_src"
# for each FMI platform: the file name of the library and its extension in an FMU
LIBRARIES = {
    "linux64": ("libredysim_fmu.so", ".so"),
    "win64": ("libredysim_fmu.dll", ".dll"),
    "aarch64-linux": ("libredysim_fmu.so", ".so"),
    "darwin64": ("libredysim_fmu.dylib", ".dylib"),
}
# names in FMI 3.0; FMI 2.0.5 has them, too, for what it does not name itself
PLATFORM_TUPLES = {"linux64": "x86_64-linux", "win64": "x86_64-windows", "aarch64-linux": "aarch64-linux", "darwin64": "x86_64-darwin"}
HOST = "win64" if os.name == "nt" else "linux64"  # the system of this process
TRIED = ("win64", "aarch64-linux")  # tests run models with these, so FMUs contain them
ROOMS = {"describe": "fmi", "libredysim_fmu.so": "fmi", "fmu_driver": "drive"}


def describe_program() -> Path:
    """Returns the program that prints a model file's variable table; raises UserError if it is not built."""
    return _program("REDYSIM_FMU_DESCRIBE", "describe")


def driver_program() -> Path:
    """Returns the program that runs an FMU without Python; raises UserError if it is not built."""
    return _program("REDYSIM_FMU_DRIVER", "fmu_driver")


def library(platform: str = "linux64") -> Path:
    """Returns the shared library of a platform; raises UserError if it is not built."""
    if platform == "linux64":
        return _find("REDYSIM_FMU_LIBRARY", "libredysim_fmu.so")
    name = LIBRARIES[platform][0]
    places = _of_system(platform, name)
    return _find(f"REDYSIM_FMU_LIBRARY_{platform.upper().replace('-', '_')}", name, places, f"make {platform}")


def web_library() -> Path:
    """Returns the library for web pages (WebAssembly); raises UserError if it is not built or older than the library for this machine."""
    name = "libredysim_fmu.wasm"
    places = _of_system("wasm", name)
    found = _find("REDYSIM_FMU_LIBRARY_WASM", name, places, "make wasm")
    # value references may have changed
    if found == places[1] and found.stat().st_mtime < library().stat().st_mtime:
        raise UserError(f"'{name}' is older than the library for this machine: run `make wasm` in the source tree")
    return found


def platforms() -> list[str]:
    """Returns the platforms of an FMU by default: this one, and those with a tested library that is not older."""
    found = ["linux64"]
    for platform in TRIED:
        try:
            other = library(platform)
        except UserError:
            continue
        # one that was built before the last change
        if SOURCE_TREE not in other.parents or PACKAGE in other.parents or other.stat().st_mtime >= library().stat().st_mtime:
            found.append(platform)
    return found


def licence_text() -> str:
    """Returns the licence of the library."""
    for path in (PACKAGE / "native" / "LICENSE", SOURCE_TREE / "LICENSE"):
        if path.is_file():
            return path.read_text(encoding="utf-8")
    raise UserError("the file LICENSE is missing: reinstall build_fmu")


def licences_of_parts(platforms: Iterable[str] = ("linux64",)) -> dict[str, str]:
    """Returns the licence terms of the parts of the libraries, by name; empty if they were not available at build time."""
    texts = {}
    for platform in platforms:
        found = web_library() if platform == "wasm" else library(platform)
        for path in sorted((found.parent / "licenses").glob("*.txt")):
            texts.setdefault(path.stem, path.read_text(encoding="utf-8"))
    return texts


def _program(variable: str, name: str) -> Path:
    if HOST == "win64":
        file = f"{name}.exe"
        return _find(variable, file, _of_system("win64", file, ROOMS[name]), "make win64")
    return _find(variable, name)


def _of_system(system: str, name: str, room: str = "fmi") -> list[Path]:
    return [PACKAGE / "native" / system / name, SOURCE_TREE / "build" / system / "fmu_src" / room / name]


def _is_filled(path: Path) -> bool:
    """Returns whether the file exists and is not empty: an interrupted build leaves empty files."""
    return path.is_file() and path.stat().st_size > 0


def _find(variable: str, name: str, places: Sequence[Path] = (), how: str = "make build") -> Path:
    given = os.environ.get(variable)
    if given:
        if _is_filled(Path(given)):
            return Path(given)
        raise UserError(f"{variable}: file '{given}' does not exist or is empty")
    for path in places or (PACKAGE / "native" / name, BUILT / ROOMS[name] / name):
        if _is_filled(path):
            return path
    if not (SOURCE_TREE / "CMakeLists.txt").is_file():
        raise UserError(f"this package does not contain '{name}': build it with `{how}` in the source tree and set {variable} to its path")
    raise UserError(f"'{name}' is not built: run `{how}` in the source tree or set {variable}")
