"""The rows of a table: text with separators (CSV, also as Excel writes it) or the first sheet of an .xlsx workbook."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from zipfile import BadZipFile, ZipFile

from build_fmu.errors import UserError
from build_fmu.importers.fields import LARGEST, read_text
from build_fmu.importers.xml_lines import parse

MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
SEPARATORS = ";\t,|"


@dataclass
class Sheet:
    """Rows that are not empty, each with its line; `decimal_comma`: a comma in a number can only be a decimal one."""

    rows: list[tuple[int, list[str]]]
    decimal_comma: bool
    left_out: str = ""


def read(path: Path) -> Sheet:
    """Returns the rows; the first one is the head. Raises UserError with file and line."""
    if path.suffix.lower() in (".ods", ".xls", ".numbers", ".xlsb"):
        raise UserError(f"'{path}' cannot be read: save the table as .xlsx or .csv")
    try:
        with path.open("rb") as file:
            zipped = file.read(4) == b"PK\x03\x04"
    except OSError as error:
        raise UserError(f"cannot read '{path}': {error.strerror}") from None
    return _workbook(path) if zipped or path.suffix.lower() == ".xlsx" else _text(path)


def _text(path: Path) -> Sheet:
    text = read_text(path)
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise UserError(f"'{path}' is empty")
    # Excel's own word for the separator
    told = re.fullmatch(r"\"?sep=(.)\"?", lines[0].strip(" \r\n"))
    head = lines[1] if told and len(lines) > 1 else lines[0]
    # else the sign that is most frequent in the head separates the columns
    separator = told[1] if told else max(SEPARATORS, key=head.count)
    if head.count(separator) == 0:
        raise UserError(f"{path}:1: the head '{head.strip()[:40]}' has one column; separate columns by comma, semicolon or tab")
    rows = []
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            ruled = separator == "|" and all(re.fullmatch(r":?-*:?", cell) for cell in cells)
            if any(cells) and not cells[0].startswith(("#", "sep=")) and not ruled:
                rows.append((reader.line_num, cells))
    except csv.Error as error:
        raise UserError(f"{path}:{reader.line_num}: no CSV: {error}") from None
    return Sheet(rows, separator != ",")


def _workbook(path: Path) -> Sheet:
    try:
        with ZipFile(path) as archive:
            if sum(item.file_size for item in archive.infolist()) > LARGEST:
                raise UserError(f"'{path}' holds more than {LARGEST // 1_000_000} MB: that is no table of a mechanism")
            if "xl/workbook.xml" not in archive.namelist():
                raise UserError(f"'{path}' is an archive, but no .xlsx workbook: save the table as .xlsx or .csv")
            name, others = _first_sheet(path, archive)
            strings = _strings(path, archive)
            rows = _cells(path, archive.read(name), strings)
    except (BadZipFile, KeyError, OSError) as error:
        raise UserError(f"'{path}' is no .xlsx workbook: {error}") from None
    if not rows:
        raise UserError(f"'{path}' is empty: its first sheet has no rows")
    # `parse` has refused what is not finite or not whole
    return Sheet(rows, True, f"the sheets {', '.join(others)}: the first sheet is the table" if others else "")


def _first_sheet(path: Path, archive: ZipFile) -> tuple[str, list[str]]:
    """Returns the archive's name of the first sheet, and what the others are called."""
    book, _ = parse(path, archive.read("xl/workbook.xml"), names=True)
    sheets = book.findall(f"{{{MAIN}}}sheets/{{{MAIN}}}sheet")
    if not sheets:
        raise UserError(f"'{path}' has no sheet")
    key = next(value for name, value in sheets[0].attrib.items() if name.endswith("}id"))
    links, _ = parse(path, archive.read("xl/_rels/workbook.xml.rels"), names=True)
    target = next((link.attrib["Target"] for link in links if link.attrib.get("Id") == key), "worksheets/sheet1.xml")
    name = target.lstrip("/") if target.startswith("/") else str(PurePosixPath("xl") / target)
    return name, [sheet.attrib.get("name", "?") for sheet in sheets[1:]]


def _strings(path: Path, archive: ZipFile) -> list[str]:
    if "xl/sharedStrings.xml" not in archive.namelist():
        return []
    root, _ = parse(path, archive.read("xl/sharedStrings.xml"), names=True)
    return [_written(item) for item in root.findall(f"{{{MAIN}}}si")]


def _written(item) -> str:
    """The text of an element, without the readings that Excel keeps beside it."""
    return "".join(text.text or "" for run in (item, *item.findall(f"{{{MAIN}}}r")) for text in run.findall(f"{{{MAIN}}}t"))


def _cells(path: Path, content: bytes, strings: list[str]) -> list[tuple[int, list[str]]]:
    root, _ = parse(path, content, names=True)
    rows = []
    for count, row in enumerate(root.iterfind(f"{{{MAIN}}}sheetData/{{{MAIN}}}row"), 1):
        cells: list[str] = []
        for cell in row.findall(f"{{{MAIN}}}c"):
            place = re.match(r"[A-Z]+", cell.attrib.get("r", ""))
            column = _column(place[0]) if place else len(cells)
            if column > 1000:
                raise UserError(f"{path}:{row.attrib.get('r', count)}: more than 1000 columns")
            value = cell.find(f"{{{MAIN}}}v")
            text = value.text or "" if value is not None else ""
            if cell.attrib.get("t") == "s":
                text = strings[int(text)] if text.isdigit() and int(text) < len(strings) else ""
            elif cell.attrib.get("t") == "inlineStr":
                text = "".join(_written(item) for item in cell.findall(f"{{{MAIN}}}is"))
            cells += [""] * (column + 1 - len(cells))
            cells[column] = text.strip()
        if any(cells) and not cells[0].startswith("#"):
            rows.append((int(row.attrib.get("r", count)), cells))
    # rows end with their last filled cell
    width = max((len(cells) for _, cells in rows), default=0)
    return [(line, cells + [""] * (width - len(cells))) for line, cells in rows]


def _column(letters: str) -> int:
    index = 0
    for letter in letters:
        index = 26 * index + ord(letter) - ord("A") + 1
    return index - 1
