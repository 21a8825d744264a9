"""FMUs for the methods of a model: the same file with other outputs, tunable parameters or start, without drawing and pages."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path, PurePath

import tomlkit

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.fmu.archive import Entry, write_archive
from build_fmu.fmu.description import model_description
from build_fmu.model.describe import Description, describe
from build_fmu.model.inverse import inverse_of


@dataclass(frozen=True)
class Source:
    """A model file as it was when it was loaded: its absolute path, and its content and that of the attached files by relative path."""

    path: Path
    files: Mapping[str, bytes]

    @property
    def text(self) -> str:
        """The text of the model file."""
        return self.files[self.path.name].decode("utf-8-sig").replace("\r\n", "\n")

    @property
    def document(self) -> dict:
        """The tables of the model file."""
        return tomlkit.parse(self.text).unwrap()

    def write(self, folder: Path) -> Path:
        """Writes the files into a folder and returns the model file there."""
        for name, content in self.files.items():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        return folder / self.path.name


def source_of(file: Path, description: Description) -> Source:
    """Reads a described model file."""
    path = file.absolute()
    names = [path.name, *description.resources]
    # only reports use the reference; one outside the folder stays where it is
    reference = PurePath(description.report.get("reference") or "")
    if reference.name and not reference.is_absolute() and ".." not in reference.parts and (path.parent / reference).is_file():
        names.append(str(reference))
    return Source(path, {name: (path.parent / name).read_bytes() for name in names})


@dataclass(frozen=True)
class Variant:
    """What differs from the model file; None: as in the file."""

    outputs: Sequence[str] | None = None
    tunable: Sequence[str] = ()
    start: str | None = None
    inverse: bool = False
    without: Sequence[str] = ()  # tables that are omitted


def stage(source: Source, resources: list[str], variant: Variant, folder: Path) -> Path:
    """Writes the FMU of a variant into an empty folder; raises UserError with the name of the user's file."""
    copy, fmu, ending = source.write(folder), folder / "model.fmu", native.LIBRARIES[native.HOST][1]
    copy.write_text(_changed(source.text, variant), encoding="utf-8", newline="\n")
    try:
        with inverse_of(copy) if variant.inverse else nullcontext((describe(copy), copy)) as (table, file):
            entries = [
                Entry("modelDescription.xml", model_description(table)),
                Entry(f"binaries/{native.HOST}/{table.model_identifier}{ending}", native.library(native.HOST).read_bytes(), True),
                Entry("resources/model.toml", file.read_bytes()),
                *(Entry(f"resources/{name}", (folder / name).read_bytes()) for name in resources),
            ]
            write_archive(fmu, entries)
    except UserError as error:
        raise UserError(str(error).replace(str(copy), str(source.path))) from None
    return fmu


def sample_time_of(source: Source) -> float:
    """Returns the period (s) of a sampled controller; 0: there is none."""
    return float(source.document.get("controller", {}).get("sample_time", 0))


def _changed(text: str, variant: Variant) -> str:
    """Returns the model file with the changes, everything else untouched."""
    document = tomlkit.parse(text)
    for table in variant.without:
        document.pop(table, None)
    if variant.without:
        document.get("fmu", {}).pop("tunable", None)  # some may belong to these tables
    if variant.start:
        document["start"] = variant.start
    if variant.outputs is not None or variant.tunable:
        section = document.setdefault("fmu", tomlkit.table())
        if variant.outputs is not None:
            section["outputs"] = list(variant.outputs)
        if variant.tunable:
            section["tunable"] = list(dict.fromkeys([*section.get("tunable", []), *variant.tunable]))
    return tomlkit.dumps(document)
