"""FMUs for the methods of a model: the same file with other outputs, tunable parameters or start, without drawing and pages."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

import tomlkit

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.fmu.archive import Entry, write_archive
from build_fmu.fmu.description import model_description
from build_fmu.model.describe import describe
from build_fmu.model.inverse import inverse_of
from build_fmu.model.resources import attach


@dataclass(frozen=True)
class Variant:
    """What differs from the model file; None: as in the file."""

    outputs: Sequence[str] | None = None
    tunable: Sequence[str] = ()
    start: str | None = None
    inverse: bool = False
    without: Sequence[str] = ()  # tables that are omitted


def stage(model: Path, resources: list[str], variant: Variant, folder: Path) -> Path:
    """Writes the FMU of a variant into an empty folder; raises UserError with the name of the user's file."""
    copy, fmu, ending = folder / model.name, folder / "model.fmu", native.LIBRARIES[native.HOST][1]
    copy.write_text(_changed(model.read_text(encoding="utf-8-sig"), variant), encoding="utf-8", newline="\n")
    attach(resources, model, folder)
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
        raise UserError(str(error).replace(str(copy), str(model))) from None
    return fmu


def sample_time_of(model: Path) -> float:
    """Returns the period (s) of a sampled controller; 0: there is none."""
    return float(tomlkit.parse(model.read_text(encoding="utf-8-sig")).get("controller", {}).get("sample_time", 0))


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
