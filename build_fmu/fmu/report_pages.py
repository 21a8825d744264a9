"""Adds a report to the documentation of an FMU."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from build_fmu.fmu.archive import Entry, write_archive
from build_fmu.fmu.documentation import documentation
from build_fmu.model.describe import Description
from build_fmu.report.make import Wish, make_report, write
from build_fmu.report.pages import Report


def put_into(fmu: Path, model: Description, source: Path, progress: Callable[[str, int, int], None], note: str = "") -> Report:
    """Makes the report of an FMU and adds its pages, with a note, to the documentation."""
    table = model.report.get("reference")
    report = replace(make_report(fmu, Wish(reference=source.parent / table if table else None), progress), note=note)
    with zipfile.ZipFile(fmu) as archive:
        entries = [Entry(i.filename, archive.read(i), bool(i.external_attr >> 16 & 0o100)) for i in archive.infolist()]
    page = "documentation/index.html"
    played = any(entry.name == "documentation/run.html" for entry in entries)
    entries = [Entry(page, documentation(model, played, has_report=True)) if entry.name == page else entry for entry in entries]
    with tempfile.TemporaryDirectory() as folder:
        files = write(report, Path(folder), "report")
        entries += [Entry(f"documentation/{file.name}", file.read_bytes()) for file in files if file.suffix != ".png"]
    write_archive(fmu, entries)
    return report
