"""Builds an FMU from a described model file: XML, pages, library, archive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from build_fmu import native
from build_fmu.draw.drawing import draw
from build_fmu.draw.shapes import with_solids
from build_fmu.errors import UserError
from build_fmu.fmu import description, description3
from build_fmu.fmu.archive import Entry, write_archive
from build_fmu.fmu.arrays import with_arrays
from build_fmu.fmu.documentation import documentation
from build_fmu.fmu.licences import licence_files
from build_fmu.fmu.terminals import terminals
from build_fmu.model.describe import Description
from build_fmu.report.target import with_chosen_tolerance


@dataclass(frozen=True)
class Built:
    """The result of a build: the description, the reason for a missing page of the run, the specialisation of the library."""

    model: Description
    no_page: str = ""
    specialised: str = ""
    undrawn: Sequence[str] = ()  # warnings about shapes


def build(
    model: Description,
    model_file: Path,
    target: Path,
    show: bool = False,
    specialised: bool = False,
    platforms: Sequence[str] = ("linux64",),
    fmi: int = 2,
    arrays: bool = False,
) -> Built:
    """Writes the FMU of a described model file, with the tolerance for its target_error.

    With `show` the FMU has a page that plays its default experiment. With `specialised` a library is compiled for this model; otherwise no
    compiler is needed. `fmi` is the version of the standard, 2 or 3; `arrays` replaces scalars by arrays in 3.
    On failure no file is written.
    """
    libraries = {platform: native.library(platform) for platform in platforms}
    if model.needs_own_library and not specialised:
        raise UserError(f"'{model_file}': method taylor requires --specialise; or choose another method in [solver]")
    if target.suffix != ".fmu":
        raise UserError(f"'{target}' is not an FMU name: it must end in .fmu")
    drawn, undrawn = with_solids(model)
    picture = draw(drawn.drawing, model.model_name)
    played, reason = None, ""
    with with_chosen_tolerance(model, model_file) as (packed, file), ExitStack() as until_written:
        own, how = {native.HOST: native.library(native.HOST)}, ""
        if specialised:
            from build_fmu.fmu.specialise import specialised_library

            special = until_written.enter_context(specialised_library(packed, file))
            own, how = {"linux64": special.library}, special.summary()
            libraries |= own
        if show:
            from build_fmu.fmu.run_page import attached_page

            played, reason = attached_page(replace(packed, drawing=drawn.drawing), lambda: contents(packed, file, picture, own))
        write_archive(target, contents(packed, file, picture, libraries, played, fmi, arrays))
    return Built(packed, reason, how, undrawn)


def build_for_run(model: Description, model_file: Path, target: Path) -> None:
    """Writes an FMU of this machine for a simulation, without picture."""
    with with_chosen_tolerance(model, model_file) as (packed, file):
        write_archive(target, contents(packed, file, None, {native.HOST: native.library(native.HOST)}))


def contents(
    model: Description,
    model_file: Path,
    picture: bytes | None,
    libraries: Mapping[str, Path],
    played: bytes | None = None,
    fmi: int = 2,
    arrays: bool = False,
) -> list[Entry]:
    """Returns the files of the FMU, with a library for each platform, in the order in which they are stored."""
    is_fmi3 = fmi == 3
    model = with_arrays(model) if arrays else model
    grouped = terminals(model) if is_fmi3 else None
    return [
        Entry("modelDescription.xml", (description3 if is_fmi3 else description).model_description(model)),
        *([Entry("documentation/diagram.png" if is_fmi3 else "model.png", picture)] if picture else []),
        *(
            Entry(f"binaries/{folder}/{model.model_identifier}{native.LIBRARIES[platform][1]}", library.read_bytes(), True)
            for platform, library in libraries.items()
            for folder in _folders(platform, libraries, is_fmi3)
        ),
        Entry("resources/model.toml", model_file.read_bytes()),
        *(Entry(f"resources/{name}", (model_file.parent / name).read_bytes()) for name in model.resources),
        Entry("documentation/index.html", documentation(model, played is not None, fmi=fmi)),
        *([Entry("terminalsAndIcons/terminalsAndIcons.xml", grouped)] if grouped else []),
        *([Entry("documentation/run.html", played)] if played else []),
        *(Entry(f"documentation/licenses/{name}", text) for name, text in licence_files(libraries).items()),
    ]


def _folders(platform: str, libraries: Mapping[str, Path], is_fmi3: bool) -> list[str]:
    """Returns the folders of a library. On Arm, importers of FMI 2.0 look into `linux64`, which is left to them where it is free."""
    if is_fmi3:
        return [native.PLATFORM_TUPLES[platform]]
    return [platform, *(["linux64"] if platform == "aarch64-linux" and "linux64" not in libraries else [])]
