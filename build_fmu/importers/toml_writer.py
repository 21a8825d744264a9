"""Writes a Draft as a model file: exact numbers, without defaults, with omissions as comments at the top."""

from __future__ import annotations

import shlex
import textwrap
from collections.abc import Iterator

import tomlkit

from build_fmu.importers.draft import GROUND, Draft, DraftLink, DraftTie

WIDTH = 118
JOINT_FIELDS = ("q", "qd", "damping", "stiffness", "rest", "armature", "friction", "static_friction", "friction_velocity")


def model_text(draft: Draft, file: str = "") -> str:
    """Returns the text of the model file, which will have this name."""
    lines = [*_comment(f"Imported from {draft.source}.")]
    if draft.inputs:
        # a single line of any length, because it is pasted into a shell
        lines += [
            *_comment("Inputs are not part of a model. To run it with the inputs of its source, in the folder of this file:"),
            f"# {run_command(draft, file or f'{draft.name}.toml')}",
        ]
    for note in draft.notes:
        lines += _comment(note)
    for title, sentences in (("Omitted:", draft.lost), ("Check:", draft.doubts)):
        if sentences:
            lines += ["#", *_comment(title)]
            for sentence in sentences:
                lines += _comment(sentence, "- ")
    lines += ["", f"name = {_value(draft.name)}"]
    if draft.description:
        lines.append(f"description = {_value(draft.description)}")
    lines.append(f"gravity = {_value(draft.gravity)}")
    before = None
    for link in draft.links:
        lines += ["", *_link(link, before)]
        before = link.name
    for kind in ("loop", "coupling", "actuator", "spring", "contact", "frame", "shape"):
        for tie in getattr(draft, f"{kind}s"):
            lines += ["", *_tie(kind, tie)]
    for fragment in draft.fragments:
        lines += ["", *fragment.strip().splitlines()]
    for section, fields in (("controller", draft.controller), ("solver", draft.solver), ("fmu", draft.fmu)):
        if fields:
            lines += ["", f"[{section}]", *(f"{key} = {_value(value)}" for key, value in fields.items())]
    return "\n".join(lines) + "\n"


def run_command(draft: Draft, file: str) -> str:
    """Returns the command that runs the model file with the inputs of its source."""
    words = ["build-fmu", "simulate", _printable(file), "--tolerance", "1e-10", "--input", *draft.inputs]
    return " ".join(map(shlex.quote, words))


def number(x: float) -> str:
    """Returns the shortest decimal that reads back as exactly this double (at most 17 digits); whole numbers stay short."""
    x = float(x) + 0.0  # -0.0 becomes 0.0
    if abs(x) < 1e15 and x == int(x):
        return str(int(x))
    return repr(x)


def _link(link: DraftLink, before: str | None) -> Iterator[str]:
    for note in link.notes:
        yield from _comment(note)
    yield "[[link]]"
    yield f"name = {_value(link.name)}"
    moving = link.joint != "fixed"
    words = {
        "parent": (link.parent, before or GROUND),
        "joint": (link.joint, "revolute"),
        "joint_name": (link.joint_name or link.name, link.name),
        "drive": (link.drive if moving else "torque", "torque"),
    }
    yield from (f"{key} = {_value(value)}" for key, (value, default) in words.items() if value != default)
    yield from _nonzero({key: getattr(link.dh, key) for key in ("gamma", "b", "alpha", "a", "theta", "d")})
    yield from _nonzero({"mass": link.mass, "com": link.com, "inertia": link.inertia if any(link.inertia[3:]) else link.inertia[:3]})
    if moving:
        yield from _joint(link)


def _joint(link: DraftLink) -> Iterator[str]:
    yield from _nonzero({key: getattr(link, key) for key in JOINT_FIELDS})
    stops = [key for key in ("lower", "upper") if getattr(link, key) is not None]
    yield from (f"{key} = {number(getattr(link, key))}" for key in stops)
    if stops:
        yield f"stop_stiffness = {number(link.stop_stiffness)}"
        yield from _nonzero({key: getattr(link, key) for key in ("stop_damping", "stop_width")})
    if link.hold:
        yield "hold = true"


def _nonzero(fields: dict[str, float | list[float]]) -> Iterator[str]:
    for key, value in fields.items():
        if any(value) if isinstance(value, list) else value != 0:
            yield f"{key} = {_value(value)}"


def _tie(kind: str, tie: DraftTie) -> Iterator[str]:
    for note in tie.notes:
        yield from _comment(note)
    yield f"[[{kind}]]"
    if tie.name:
        yield f"name = {_value(tie.name)}"
    for key, value in tie.fields.items():
        yield f"{key} = {_value(value)}"


def _value(value: object) -> str:
    if isinstance(value, bool | str):
        return tomlkit.item(value).as_string()
    if isinstance(value, int | float):
        return number(value)
    return "[" + ", ".join(_value(x) for x in value) + "]"


def _comment(text: str, bullet: str = "") -> list[str]:
    wrapped = textwrap.wrap(
        _printable(text),
        WIDTH - 2,
        initial_indent=bullet,
        subsequent_indent=" " * len(bullet),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return [f"# {line}".rstrip() for line in wrapped or [""]]


def _printable(text: str) -> str:
    # control characters of the source must not end a comment
    return "".join(c if c.isprintable() else " " for c in text)
