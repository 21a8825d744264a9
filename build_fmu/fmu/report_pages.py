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
from build_fmu.report.html import write_html
from build_fmu.report.make import Wish, make_report
from build_fmu.report.pages import Report, write_csv, write_page, write_pictures


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
        files = [Path(folder) / f"report{ending}" for ending in (".md", ".csv", ".svg", ".html")]
        write_page(files[0], report, "report.svg")
        write_csv(files[1], report)
        write_pictures(files[2:3], report)
        write_html(files[3], report, files[2])
        entries += [Entry(f"documentation/{file.name}", file.read_bytes()) for file in files]
    write_archive(fmu, entries)
    return report
