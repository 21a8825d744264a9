"""Reads a DH table from a CSV file or a workbook, one link per row, in modified (Craig, Khalil) or standard (distal) form (docs/import.md).

The conversion from standard to modified DH is exact: frame i of the distal form without its last Tx(a) Rx(alpha) is our frame i. These
two transforms move to the children. Masses and inertias are transformed from the distal frame.
"""

from __future__ import annotations

import math
import re
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError, did_you_mean, listed
from build_fmu.importers import sheet
from build_fmu.importers.draft import GROUND, DhFrame, Draft, DraftLink, Names, legal
from build_fmu.importers.masses import add_masses
from build_fmu.importers.rigid import matrix_of, rotation_x, six_of, transform
from build_fmu.importers.toml_writer import number
from build_fmu.run.expressions import Expression, compile_expression

ANGLES = ("alpha", "theta", "gamma")
LENGTHS = ("a", "d", "b")
INERTIA = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
COM = ("com_x", "com_y", "com_z")
QUANTITIES = {"angle": ANGLES, "length": (*LENGTHS, *COM), "mass": ("mass",), "inertia": (*INERTIA, "Jm")}
PLAIN = ("mass", "damping", "stiffness", "armature", "friction", "static_friction", "stop_stiffness", "stop_damping")
JOINT_VALUES = ("q", "qd", "rest", "friction_velocity", "stop_width", "lower", "upper")  # rad or m, depending on the joint
TEXTS = ("name", "parent", "type", "joint_name")
MOTOR = ("Jm", "G")  # rotor inertia and gear ratio: armature = Jm G^2
COLUMNS = (*TEXTS, *ANGLES, *LENGTHS, *COM, *INERTIA, *PLAIN, *JOINT_VALUES, *MOTOR)
ALIASES = {
    "link": "name", "body": "name", "joint": "joint_name", "joint_type": "type", "kind": "type", "sigma": "type", "on": "parent",
    "alp": "alpha", "α": "alpha", "twist": "alpha", "link_twist": "alpha", "θ": "theta", "th": "theta", "joint_angle": "theta",
    "γ": "gamma", "length": "a", "link_length": "a", "r": "a", "offset": "d", "link_offset": "d", "m": "mass", "cx": "com_x",
    "cy": "com_y", "cz": "com_z", "comx": "com_x", "comy": "com_y", "comz": "com_z", "dx": "com_x", "dy": "com_y", "dz": "com_z",
    "q0": "q", "qd0": "qd", "inertia_xx": "Ixx", "inertia_yy": "Iyy", "inertia_zz": "Izz", "b_joint": "damping", "q_min": "lower",
    "qmin": "lower", "limit_lower": "lower", "lower_limit": "lower", "min": "lower", "q_max": "upper", "qmax": "upper",
    "limit_upper": "upper", "upper_limit": "upper", "max": "upper", "coulomb": "friction", "coulomb_friction": "friction",
    "viscous": "damping", "viscous_friction": "damping", "rotor_inertia": "Jm", "motor_inertia": "Jm", "gear_ratio": "G", "gear": "G",
}  # fmt: skip
UNITS = {
    "rad": ("angle", 1.0), "deg": ("angle", math.pi / 180), "°": ("angle", math.pi / 180), "degrees": ("angle", math.pi / 180),
    "radians": ("angle", 1.0), "m": ("length", 1.0), "mm": ("length", 1e-3), "cm": ("length", 1e-2), "kg": ("mass", 1.0),
    "g": ("mass", 1e-3), "kgm2": ("inertia", 1.0), "kgm^2": ("inertia", 1.0), "kgm²": ("inertia", 1.0), "kgmm2": ("inertia", 1e-6),
    "gmm2": ("inertia", 1e-9),
}  # fmt: skip
# SI units of the fields that depend on the joint; others are refused
PLAIN_UNITS = {
    "damping": ("Nms/rad", "Nms", "Nm/(rad/s)", "Ns/m", "N/(m/s)"), "stiffness": ("Nm/rad", "Nm", "N/m"),
    "armature": ("kgm2", "kgm^2", "kgm²", "kg"), "friction": ("Nm", "N"), "static_friction": ("Nm", "N"),
    "stop_stiffness": ("Nm/rad", "Nm", "N/m"), "stop_damping": ("s/rad", "s/m", "s"), "G": ("1", "-"),
}  # fmt: skip
RATES = {
    "rad/s": ("angle", 1.0),
    "deg/s": ("angle", math.pi / 180),
    "°/s": ("angle", math.pi / 180),
    "m/s": ("length", 1.0),
    "mm/s": ("length", 1e-3),
}
KINDS = {"revolute": "revolute", "r": "revolute", "hinge": "revolute", "prismatic": "prismatic", "p": "prismatic", "slider": "prismatic",
         "fixed": "fixed", "f": "fixed", "0": "revolute", "1": "prismatic"}  # fmt: skip
WORDS = {kind for kind in KINDS if kind.isalpha()}
# a joint variable in a cell, in the notations of textbooks: q1, theta_2, θ3*, d4
VARIABLE = re.compile(r"(?<![A-Za-z0-9_.])(?:q|th|theta|θ|d)_?\{?\d*\}?\*?(?![A-Za-z0-9_.(])|(?<=[\d.])\*$")


@dataclass
class Column:
    """One column of the file: its field and the factor to SI units."""

    field: str
    factor: float | None  # None: an angle without a unit in the header
    title: str = ""
    kind: str = ""  # of the unit: "angle", "length", …


@dataclass
class Row:
    """One row with its location for messages."""

    where: str
    cells: dict[str, str]
    decimal_comma: bool


def read(path: Path, options: Namespace) -> Draft:
    """Returns the draft; raises UserError with file, line and column."""
    if options.stops == "none":
        options.stops = None
    if options.stops is not None and not 0 < options.stops < math.inf:
        raise UserError(f"--stops: the stiffness must be > 0 and finite, got {options.stops:g}")
    draft = Draft(name=legal(path.stem), source=path.name)
    columns, rows = _table(path, draft)
    columns = _with_angle_unit(draft, columns, rows, options.angles)
    standard = options.dh == "standard"
    if standard and any(c.field in ("gamma", "b") for c in columns.values()):
        raise UserError(f"'{path}': standard DH has no gamma and b; use the column 'parent' for branches")
    if options.dh is None:
        draft.doubts.append(
            "the table was read as modified DH (Craig, Khalil: alpha and a before theta and d); for the distal form use --dh standard"
        )
    names = Names()
    _check_variables(rows)
    for index, row in enumerate(rows):
        draft.links.append(_link(row, columns, list(zip(rows[:index], draft.links, strict=True)), names))
    for link in draft.links:
        link.joint_name = names.take(link.joint_name, "_joint") if link.joint_name and link.joint_name != link.name else ""
    if standard:
        _from_standard(draft)
    draft.doubts += _like_degrees(rows, draft.links)
    _stops(draft, options.stops)
    if "G" in columns and "Jm" not in columns:
        draft.lost.append("the gear ratios in column 'G': without a column 'Jm' (rotor inertia) they have no effect")
    add_masses(draft, {}, options)
    draft.doubts += names.sentences()
    draft.doubts.append("gravity is set to (0, 0, -9.81) m/s2: the table does not define it")
    return draft


def _like_degrees(rows: list[Row], links: list[DraftLink]) -> Iterator[str]:
    """Yields a sentence for each position or limit that is probably in degrees."""
    for row, link in zip(rows, links, strict=True):
        for field, most in (("q", 2 * math.pi), ("lower", 4 * math.pi), ("upper", 4 * math.pi)):
            value = getattr(link, field)
            if link.joint == "revolute" and value is not None and most + 1e-6 < abs(value):
                read = f"{row.where}: column '{field}': {row.cells[field]} was read as {value:g} rad"
                yield f"{read}; for degrees write '{field} [deg]' in the header"


def _table(path: Path, draft: Draft) -> tuple[dict[str, Column], list[Row]]:
    table = sheet.read(path)
    draft.lost += [table.left_out] if table.left_out else []
    (head_line, head), body = table.rows[0], table.rows[1:]
    columns = _head(f"{path}:{head_line}", head)
    if not body:
        raise UserError(f"'{path}' has a header but no rows")
    rows = []
    for line, cells in body:
        if len(cells) > len(head) and not any(cells[len(head) :]):
            cells = cells[: len(head)]
        if len(cells) != len(head):
            raise UserError(f"{path}:{line}: {len(cells)} cells, but the header has {len(head)} columns")
        rows.append(Row(f"{path}:{line}", dict(zip(columns, cells, strict=True)), table.decimal_comma))
    if "joint_name" in columns and "type" not in columns and all(row.cells["joint_name"].lower() in WORDS for row in rows):
        # a column 'joint' with joint types instead of names
        columns = {("type" if field == "joint_name" else field): column for field, column in columns.items()}
        rows = [Row(row.where, dict(zip(columns, row.cells.values(), strict=True)), row.decimal_comma) for row in rows]
    return columns, rows


def _head(where: str, head: list[str]) -> dict[str, Column]:
    columns: dict[str, Column] = {}
    fields: set[str] = set()
    for title in head:
        # alpha [deg], alpha (deg), alpha / deg
        match = re.fullmatch(r"([^/\[(]*?)\s*(?:[\[(]\s*(.*?)\s*[\])]|/\s*(.*))?", title) or re.fullmatch(r"(.*)()()", title)
        word, unit = match[1].strip(), (match[2] or match[3] or "").replace(" ", "").replace("·", "").replace("*", "")
        key = re.sub(r"[\s\-]+", "_", word)
        # textbooks add an index: a_{i-1}, d_i
        plain = re.sub(r"_?\{?[ij]\s*([-−+]\s*1)?\}?$", "", word) if len(word) > 1 else word
        known = {c.lower(): c for c in COLUMNS} | ALIASES
        field = known.get(key.lower()) or known.get(plain.lower())
        if field is None and key in ("i", "#", "no", "nr", "number", ""):
            field = f"ignored {len(columns)}"
        if field is None:
            hint = did_you_mean(key.lower(), known) or f"; supported: {', '.join(COLUMNS)}"
            raise UserError(f"{where}: unknown column '{title}'{hint}")
        if field in fields:
            raise UserError(f"{where}: two columns for '{field}'")
        fields.add(field)
        columns[field] = Column(field, *_unit(where, title, field, unit))
    return columns


def _unit(where: str, title: str, field: str, unit: str) -> tuple[float | None, str, str]:
    """Returns the factor to SI, the title and the kind of the unit; the factor is None for an angle without a unit in the header."""
    kind = next((name for name, fields in QUANTITIES.items() if field in fields), "")
    if not unit:
        return None if kind == "angle" or field in JOINT_VALUES else 1.0, title, kind
    if field in PLAIN_UNITS:
        if unit not in PLAIN_UNITS[field]:
            raise UserError(f"{where}: '{title}': the unit of {field} must be {' or '.join(PLAIN_UNITS[field])}")
        return 1.0, title, kind
    units = RATES if field in ("qd", "friction_velocity") else UNITS
    found = units.get(unit.lower())
    # a column of start values may belong to prismatic and revolute joints
    if field in JOINT_VALUES and unit in ("rad,m", "rad|m", "rad/m", "radorm"):
        return 1.0, title, kind
    if found is None or (kind and found[0] != kind) or (field in JOINT_VALUES and found[0] not in ("angle", "length")):
        fitting = [name for name, (what, _) in units.items() if kind in ("", what)]
        raise UserError(f"{where}: '{title}': '{unit}' is not a unit of {field}{did_you_mean(unit.lower(), fitting)}")
    return found[1], title, found[0]


def _with_angle_unit(draft: Draft, columns: dict[str, Column], rows: list[Row], asked: str | None) -> dict[str, Column]:
    """Gives angles without a unit that of --angles; without it those of the frames that of each other, and joint values rad.

    Angles of the frames that look like degrees are refused.
    """
    said = {c.factor for c in columns.values() if c.field in ANGLES and c.factor is not None}
    given = UNITS[asked][1] if asked else None
    of_frames = next(iter(said)) if given is None and len(said) == 1 else given
    bare = [c.field for c in columns.values() if c.factor is None and c.field in JOINT_VALUES]
    used = [field for field in bare if any(_number(row, field, None)[0] for row in rows)]
    if used and given is None and said - {1.0}:
        draft.doubts.append(
            f"the header gives no unit of {listed(used)}: read in rad or m, although other angles of the table are in degrees; "
            "write the unit in the header or use --angles"
        )
    for column in columns.values():
        if column.factor is None:
            factor = of_frames if column.field in ANGLES else given
            if factor is None and column.field in ANGLES:
                for row in rows:
                    if abs(_number(row, column.field, 1.0)[0]) > 2 * math.pi + 1e-6:
                        raise UserError(
                            f"{row.where}: column '{column.field}': {row.cells[column.field]} looks like degrees; "
                            f"use --angles deg or --angles rad, or write '{column.field} [deg]' in the header"
                        )
            column.factor = factor or 1.0
    return columns


def _link(row: Row, columns: dict[str, Column], before: list[tuple[Row, DraftLink]], names: Names) -> DraftLink:
    cells = row.cells
    title = cells.get("name", "")
    name = names.take(_called(title, "link") or f"link{len(before) + 1}")
    if title.isdigit():
        names.changed.append((title, name))
    parent = _parent(row, cells.get("parent", ""), before)
    values, variable = {}, ""
    for field, column in columns.items():
        if field in TEXTS or field.startswith("ignored"):
            continue
        values[field], has_variable = _number(row, field, column.factor)
        if has_variable:
            if field not in ("theta", "d"):
                raise UserError(f"{row.where}: column '{field}': only theta and d can be joint variables, got '{cells[field]}'")
            if variable:
                raise UserError(f"{row.where}: both theta and d are joint variables; use one row per joint")
            variable = field
    kind = _kind(row, cells.get("type", ""), variable)
    link = DraftLink(
        name,
        parent,
        kind,
        _called(cells.get("joint_name", ""), "joint"),
        DhFrame(**{k: values.get(k, 0.0) for k in ("gamma", "b", "alpha", "a", "theta", "d")}),
    )
    link.com = [values.get(key, 0.0) for key in COM]
    link.inertia = [values.get(key, 0.0) for key in INERTIA]
    for field in PLAIN:
        if values.get(field, 0.0) < 0:
            raise UserError(f"{row.where}: column '{field}': must be >= 0, got {cells[field]}")
        setattr(link, field, values.get(field, 0.0))
    link.armature = _armature(row, values)
    for field in JOINT_VALUES:
        if field in columns:
            setattr(link, field, _joint_value(row, columns[field], kind))
    return link


def _armature(row: Row, values: dict[str, float]) -> float:
    """Returns the inertia of the drive at the joint, of the column 'armature' or Jm G^2."""
    inertia, ratio = values.get("Jm", 0.0), values.get("G", 0.0)
    if inertia < 0:
        raise UserError(f"{row.where}: column 'Jm': must be >= 0, got {row.cells['Jm']}")
    if not inertia:
        return values.get("armature", 0.0)
    if values.get("armature"):
        raise UserError(f"{row.where}: columns 'armature' and 'Jm' both define the inertia of the drive; use one of them")
    if not ratio:
        raise UserError(f"{row.where}: column 'Jm': the gear ratio is missing; write it in the column 'G' (1 for a direct drive)")
    return inertia * ratio * ratio


def _joint_value(row: Row, column: Column, kind: str) -> float | None:
    """Returns a start value, limit or other joint value in rad or m; None for a blank limit."""
    cell = row.cells[column.field]
    if column.field in ("lower", "upper") and cell in ("", "-"):
        return None
    unit = {"revolute": "angle", "prismatic": "length"}.get(kind, column.kind)
    value = _number(row, column.field, column.factor if not column.kind or column.kind == unit else 1.0)[0]
    if value and {column.kind, unit} == {"angle", "length"}:
        raise UserError(
            f"{row.where}: column '{column.title}': the joint is {kind}, but {cell} is {'a length' if unit == 'angle' else 'an angle'}"
        )
    # the unit of angles does not apply to prismatic joints
    return value if column.kind or unit == "angle" else _number(row, column.field, 1.0)[0]


def _check_variables(rows: list[Row]) -> None:
    """Raises UserError if two rows have the same joint variable."""
    seen: dict[str, str] = {}
    for row in rows:
        for name in sorted(_variables(row.cells.get("theta", "")) | _variables(row.cells.get("d", ""))):
            if name in seen:
                raise UserError(
                    f"{row.where}: '{name}' is also the variable of {seen[name]}: name each joint's own, and couple joints by [[coupling]]"
                )
            seen[name] = row.where


def _variables(text: str) -> set[str]:
    """Returns the names of the joint variables in a cell, in one notation; a * after a number has none."""
    names = {re.sub(r"[_{}*]", "", name) for name in VARIABLE.findall(text)}
    return {re.sub("theta|th", "θ", name) for name in names if name}


def _stops(draft: Draft, stiffness: float | None) -> None:
    """Converts limits to stops where a column or --stops gives a stiffness; lists the others as omitted."""
    left = []
    for link in draft.links:
        if link.lower is None and link.upper is None:
            continue
        link.stop_stiffness = link.stop_stiffness or stiffness or 0.0
        if not link.stop_stiffness:
            left.append(link.joint_name or link.name)
            link.lower = link.upper = None
    if left:
        draft.lost.append(f"the limits of {', '.join(left)}: --stops STIFFNESS or a column 'stop_stiffness' converts them to stops")


def _called(text: str, what: str) -> str:
    return f"{what}{text}" if text.isdigit() else text


def _parent(row: Row, text: str, before: list[tuple[Row, DraftLink]]) -> str:
    if not text:
        return before[-1][1].name if before else GROUND
    titles = [above.cells.get("name", "") for above, _ in before]
    known = [link.name for _, link in before]
    if text not in titles and text in known:
        return text
    if titles.count(text) > 1:
        raise UserError(f"{row.where}: column 'parent': several previous rows have the name '{text}'")
    if text in titles:
        return known[titles.index(text)]
    if text.lower() in (GROUND, "base", "world", "0", "-1"):
        return GROUND
    if text.isdigit() and 1 <= int(text) <= len(before) and not any(title.isdigit() for title in titles):
        return known[int(text) - 1]
    named = [title or name for title, name in zip(titles, known, strict=True)]
    raise UserError(f"{row.where}: column 'parent': '{text}' is not a link of a previous row{did_you_mean(text, named)}")


def _kind(row: Row, text: str, variable: str) -> str:
    kind = KINDS.get(text.lower()) if text else "prismatic" if variable == "d" else "revolute"
    if kind is None:
        raise UserError(f"{row.where}: column 'type': '{text}' must be revolute, prismatic or fixed{did_you_mean(text.lower(), KINDS)}")
    if variable and kind != {"theta": "revolute", "d": "prismatic"}[variable]:
        raise UserError(f"{row.where}: the joint is {kind}, but '{variable}' is its variable")
    return kind


def _number(row: Row, field: str, factor: float | None) -> tuple[float, bool]:
    """Returns the number of a cell such as 0.3, pi/2, q1 or q1 - 90, in SI; and whether it names a joint variable."""
    text = row.cells[field].replace("," if row.decimal_comma else "\0", ".").replace("−", "-").replace("π", "pi").replace("^", "**")
    if not text or text == "-":
        return 0.0, False
    # the joint variable becomes t, so that the value at 0 is the constant part
    rest = VARIABLE.sub(lambda found: "+t" if found[0] == "*" else "t", text) if field in ("theta", "d") else text
    scale = 1.0 if factor is None else factor
    try:
        if re.search(r"\bt\b", text):
            raise UserError("t")
        expression = compile_expression(re.sub(r"(?<![\d.eE])0+(?=[1-9])", "", rest))
        value = expression(0.0)
    except UserError:
        hint = ""
        if text.strip("[]()").lower() in UNITS:
            hint = f"; write units in the header, for example '{field} [{text.strip('[]()')}]'"
        elif re.fullmatch(r"[-+]?\d+,\d+", text):
            hint = "; with decimal commas, separate columns by ; or tabs"
        raise UserError(f"{row.where}: column '{field}': cannot read '{row.cells[field]}' as a number{hint}") from None
    if rest != text and (len(_variables(text)) > 1 or not _is_shift(expression)):
        raise UserError(
            f"{row.where}: column '{field}': '{row.cells[field]}' must be the variable plus a constant, such as q1 + 90: for another sign "
            "turn the axis of the joint round, for other terms add a [[coupling]] to the model file"
        )
    # a value with pi is in radians, whatever the unit of the column
    radians = "pi" in rest and field in (*ANGLES, *JOINT_VALUES)
    return _exact(value, 1.0 if radians else scale), rest != text


def _is_shift(expression: Expression) -> bool:
    """Returns whether an expression is t plus a constant."""
    try:
        return all(math.isclose(expression(t) - expression(0.0), t, rel_tol=1e-9) for t in (1.0, -2.5))
    except UserError:
        return False


def _exact(value: float, factor: float) -> float:
    """Converts a value so that right angles in degrees and lengths in mm give the nearest double."""
    if factor == math.pi / 180:
        return math.radians(value)
    return value / round(1 / factor) if factor < 1 else value * factor


def _from_standard(draft: Draft) -> None:
    """T = Rz(theta) Tz(d) Tx(a) Rx(alpha): moves the last two to the children, and transforms mass and inertia to our frame."""
    distal = {link.name: (link.dh.alpha, link.dh.a) for link in draft.links}
    parents = {link.parent for link in draft.links}
    for link in draft.links:
        alpha, a = distal[link.name]
        own = transform(rotation_x(alpha), (a, 0, 0))
        turn = own[:3, :3]
        if link.mass or any(link.com):
            link.com = [float(x) for x in turn @ np.array(link.com) + own[:3, 3]]
        if any(link.inertia):
            link.inertia = six_of(turn @ matrix_of(link.inertia) @ turn.T)
        link.dh.alpha, link.dh.a = distal.get(link.parent, (0.0, 0.0))
        if link.name not in parents and (alpha or a):
            link.notes.append(f"Tool frame of the table: xyz = [{number(a)}, 0, 0], rpy = [{number(alpha)}, 0, 0] in this frame.")
    draft.notes.append(
        "Converted from standard (distal) DH: frame i is the table's frame i before its Tx(a) Rx(alpha). Centers of mass and inertias "
        "were transformed from the table's frame i."
    )
