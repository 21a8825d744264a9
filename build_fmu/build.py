"""Puts an FMU together from a model file: describe, write the pages, copy the library, zip."""

from __future__ import annotations

from pathlib import Path

from build_fmu import native
from build_fmu.archive import Entry, write_archive
from build_fmu.describe import Description
from build_fmu.description import model_description
from build_fmu.documentation import documentation
from build_fmu.drawing import draw
from build_fmu.errors import UserError
from build_fmu.licences import licence_files


def build(model: Description, model_file: Path, target: Path, show: bool = False) -> str:
    """Writes the FMU of a described model file; no compiler is needed and a failure leaves no half file.

    With `show` it carries a page that plays its default experiment. Returns why there is none, or an empty string.
    """
    if target.suffix != ".fmu":
        raise UserError(f"'{target}' is no name for an FMU: it must end in .fmu")
    picture = draw(model.drawing, model.model_name)
    played, reason = None, ""
    if show:
        from build_fmu.show.attached import attached_page

        played, reason = attached_page(model, contents(model, model_file, picture))
    write_archive(target, contents(model, model_file, picture, played))
    return reason


def contents(model: Description, model_file: Path, picture: bytes, played: bytes | None = None) -> list[Entry]:
    """Returns the files of the FMU in the order in which they are stored."""
    return [
        Entry("modelDescription.xml", model_description(model)),
        Entry("model.png", picture),
        Entry(f"binaries/linux64/{model.model_identifier}.so", native.library().read_bytes(), executable=True),
        Entry("resources/model.toml", model_file.read_bytes()),
        Entry("documentation/index.html", documentation(model, played is not None)),
        *([Entry("documentation/run.html", played)] if played else []),
        *(Entry(f"documentation/licenses/{name}", text) for name, text in licence_files().items()),
    ]
