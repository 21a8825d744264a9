"""Files of ROS packages: `package://` addresses, and xacro macros, which the package `xacro` expands."""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stderr
from pathlib import Path
from types import ModuleType

from build_fmu.errors import InvalidArgument, UserError, did_you_mean
from build_fmu.importers.fields import read_text


def places_of(package: str, folder: Path) -> list[Path]:
    """Returns where a package may be: above a folder, beside a folder above it, in ROS_PACKAGE_PATH and in AMENT_PREFIX_PATH."""
    above = (folder, *folder.parents)
    found = [parent for parent in above if parent.name == package] + [parent / package for parent in above]
    for variable, inner in (("ROS_PACKAGE_PATH", "."), ("AMENT_PREFIX_PATH", "share")):
        found += [Path(place) / inner / package for place in os.environ.get(variable, "").split(os.pathsep) if place]
    return found


def expanded(path: Path, arguments: Sequence[str]) -> bytes:
    """Returns the URDF of a xacro file; raises UserError without the package `xacro` and for an error in the file."""
    try:
        import xacro
    except ImportError:
        if not has_macros(Path(), read_text(path)):
            return path.read_bytes()  # its name ends in .xacro only
        raise UserError(
            f"'{path}' contains xacro macros: install the package xacro (pip install 'build-fmu[xacro]'), "
            f"or run `xacro {path.name} > robot.urdf` and import the result"
        ) from None
    values = _Arguments()
    for text in arguments:
        name, equals, value = text.partition("=")
        if not equals or not name.strip(":"):
            raise InvalidArgument(f"--arg: '{text}' must be NAME=VALUE")
        values[name.removesuffix(":")] = value
    missing: list[str] = []
    given = set(values)
    try:
        with _finds_packages(path.resolve().parent, missing), redirect_stderr(io.StringIO()):
            text = xacro.process_file(str(path), mappings=values).toprettyxml(indent=" ", encoding="utf-8")
    except (Exception, SystemExit) as error:  # xacro raises exceptions of many kinds
        why = " ".join((str(error) or type(error).__name__).split())
        if missing:
            why = f"package '{missing[0]}' is not found above '{path}', in ROS_PACKAGE_PATH or in AMENT_PREFIX_PATH"
        raise UserError(f"'{path}' cannot be expanded by xacro: {why}") from None
    if unknown := sorted(given - values.read):
        raise UserError(f"--arg {unknown[0]}: '{path}' has no argument of this name{did_you_mean(unknown[0], values.read)}")
    return text


class _Arguments(dict):
    """The arguments of a xacro file, and the names that it reads; xacro adds defaults."""

    def __init__(self) -> None:
        self.read: set[str] = set()

    def __contains__(self, name: object) -> bool:
        self.read.add(str(name))
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        self.read.add(name)
        return super().__getitem__(name)


@contextmanager
def _finds_packages(folder: Path, missing: list[str]) -> Iterator[None]:
    """Answers $(find PACKAGE) by the folders around the file where ROS is not installed; adds packages that are not found."""
    names = ("ament_index_python", "ament_index_python.packages")
    try:
        import ament_index_python.packages  # noqa: F401
    except ImportError:
        pass
    else:
        yield
        return

    def share(package: str) -> str:
        place = next((place for place in places_of(package, folder) if place.is_dir()), None)
        if place is None:
            missing.append(package)
            raise LookupError(package)
        return str(place)

    index = ModuleType(names[1])
    vars(index).update(get_package_share_directory=share)
    sys.modules.update({names[0]: ModuleType(names[0]), names[1]: index})
    try:
        yield
    finally:
        for name in names:
            sys.modules.pop(name, None)


def has_macros(path: Path, text: str) -> bool:
    """Returns whether a file needs xacro. Expanded files often keep macros in comments."""
    text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
    prefix = re.search(r"""xmlns:([\w.-]+)\s*=\s*["'][^"']*/xacro/?["']""", text)
    return path.suffix.lower() == ".xacro" or "<xacro:" in text or bool(prefix and (f"<{prefix[1]}:" in text or "${" in text))
