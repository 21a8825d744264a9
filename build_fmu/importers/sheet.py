"""Reads the rows of a table: a text file with separators (CSV) or the first sheet of an .xlsx workbook."""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from pathlib import Path
from zipfile import ZipFile

from build_fmu.errors import UserError
from build_fmu.importers.fields import LARGEST, read_text

MOST_COLUMNS = 1000
SEPARATORS = ";\t,|"


@dataclass
class Sheet:
    """The non-empty rows with their line numbers; `decimal_comma`: a comma in a number is a decimal comma."""

    rows: list[tuple[int, list[str]]]
    decimal_comma: bool
    left_out: str = ""


def read(path: Path) -> Sheet:
    """Returns the rows; the first one is the header. Raises UserError with file and line."""
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
    # Excel writes the separator in the first line
    told = re.fullmatch(r"\"?sep=(.)\"?", lines[0].strip(" \r\n"))
    head = lines[1] if told and len(lines) > 1 else lines[0]
    # otherwise the most frequent separator of the header is used
    separator = told[1] if told else max(SEPARATORS, key=head.count)
    if head.count(separator) == 0:
        raise UserError(f"{path}:1: the header '{head.strip()[:40]}' has one column; separate columns by comma, semicolon or tab")
    rows = []
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            ruled = separator == "|" and all(re.fullmatch(r":?-*:?", cell) for cell in cells)
            if any(cells) and not cells[0].startswith(("#", "sep=")) and not ruled:
                rows.append((reader.line_num, cells))
    except csv.Error as error:
        raise UserError(f"{path}:{reader.line_num}: invalid CSV: {error}") from None
    return Sheet(rows, separator != ",")


def _workbook(path: Path) -> Sheet:
    try:
        with ZipFile(path) as archive:
            if sum(item.file_size for item in archive.infolist()) > LARGEST:
                raise UserError(f"'{path}' contains more than {LARGEST // 1_000_000} MB: too large for a table of a mechanism")
        values, others, outdated = _first_sheet(path, formulas=False)
        _refuse_uncomputed(path, values, _first_sheet(path, formulas=True)[0], outdated)
    except UserError:
        raise
    except Exception as error:  # a damaged archive or XML fails in many ways
        raise UserError(f"'{path}' is not a readable .xlsx workbook: {error}") from None
    rows = [(line, [_text_of(value) for value in row]) for line, row in enumerate(values, 1)]
    rows = [(line, cells) for line, cells in rows if any(cells) and not _is_comment(path, line, cells[0])]
    if not rows:
        raise UserError(f"'{path}' is empty: its first sheet has no rows")
    # rows end with their last filled cell
    width = max(len(cells) for _, cells in rows)
    if width > MOST_COLUMNS:
        raise UserError(f"'{path}' has more than {MOST_COLUMNS} columns")
    rows = [(line, cells + [""] * (width - len(cells))) for line, cells in rows]
    return Sheet(rows, True, f"the sheets {', '.join(others)}: only the first sheet is read" if others else "")


def _first_sheet(path: Path, formulas: bool) -> tuple[list[tuple], list[str], bool]:
    """Returns the rows, with formulas or their values, the names of the other sheets, and whether the values are to be computed."""
    from openpyxl import load_workbook

    with path.open("rb") as file:
        book = load_workbook(file, read_only=True, data_only=not formulas)
        first, *others = book.worksheets
        first.reset_dimensions()  # the file may state them wrongly
        rows = list(first.iter_rows(values_only=True))
        return rows, [sheet.title for sheet in others], bool(book.calculation and book.calculation.fullCalcOnLoad)


def _refuse_uncomputed(path: Path, values: list[tuple], written: list[tuple], outdated: bool) -> None:
    """Raises UserError if formulas have no values, as in workbooks that a program wrote; single blank results are valid."""
    formulas = [
        (line, value)
        for line, row in enumerate(zip(values, written, strict=True), 1)
        for value, cell in zip(*row, strict=True)
        if cell != value
    ]
    if formulas and (outdated or all(value is None for _, value in formulas)):
        raise UserError(f"{path}:{formulas[0][0]}: a formula without a computed value: save the workbook with a spreadsheet program")


def _is_comment(path: Path, line: int, cell: str) -> bool:
    from openpyxl.cell.cell import ERROR_CODES

    if cell in ERROR_CODES:
        raise UserError(f"{path}:{line}: the first cell contains the error {cell}")
    return cell.startswith("#")


def _text_of(value: object) -> str:
    """Returns the text of a cell; whole numbers have no decimal point, so that they can be names."""
    if value is None:
        return ""
    return (
        str(int(value))
        if isinstance(value, bool) or isinstance(value, float) and value.is_integer() and abs(value) < 1e15
        else str(value).strip()
    )
