"""Writes a Draft as a model file: numbers that read back exactly, defaults left out, what was lost on top as comments."""

from __future__ import annotations

import shlex
import textwrap
from collections.abc import Iterator

from build_fmu.importers.draft import GROUND, Draft, DraftLink, DraftTie

WIDTH = 118


def model_text(draft: Draft, file: str = "") -> str:
    """Returns the text of the model file, which will have this name."""
    lines = [*_comment(f"Imported from {draft.source}.")]
    if draft.inputs:
        # one line however long it is: it is there to be pasted into a shell
        lines += [*_comment("Its inputs belong to a run; in the folder of this file:"), f"# {run_command(draft, file or f'{draft.name}.toml')}"]
    for note in draft.notes:
        lines += _comment(note)
    for title, sentences in (("Not carried over:", draft.lost), ("Look at:", draft.doubts)):
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
    for kind, ties in (("loop", draft.loops), ("spring", draft.springs), ("frame", draft.frames)):
        for tie in ties:
            lines += ["", *_tie(kind, tie)]
    for fragment in draft.fragments:
        lines += ["", *fragment.strip().splitlines()]
    for section, fields in (("solver", draft.solver), ("fmu", draft.fmu)):
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
    if x == int(x) and abs(x) < 1e15:
        return str(int(x))
    return repr(x)


def _link(link: DraftLink, before: str | None) -> Iterator[str]:
    for note in link.notes:
        yield from _comment(note)
    yield "[[link]]"
    yield f"name = {_value(link.name)}"
    if link.parent != (before or GROUND):
        yield f"parent = {_value(link.parent)}"
    if link.joint != "revolute":
        yield f"joint = {_value(link.joint)}"
    if link.joint_name and link.joint_name != link.name:
        yield f"joint_name = {_value(link.joint_name)}"
    moving = link.joint != "fixed"
    if moving and link.drive != "torque":
        yield f"drive = {_value(link.drive)}"
    for key in ("gamma", "b", "alpha", "a", "theta", "d"):
        if getattr(link.dh, key) != 0:
            yield f"{key} = {number(getattr(link.dh, key))}"
    if link.mass != 0:
        yield f"mass = {number(link.mass)}"
    if any(link.com):
        yield f"com = {_value(link.com)}"
    if any(link.inertia):
        yield f"inertia = {_value(link.inertia if any(link.inertia[3:]) else link.inertia[:3])}"
    if moving:
        for key in ("q", "qd", "damping", "stiffness", "rest", "armature", "friction", "static_friction", "friction_velocity"):
            value = getattr(link, key)
            if any(value) if isinstance(value, list) else value != 0:
                yield f"{key} = {_value(value)}"
        stops = [key for key in ("lower", "upper") if getattr(link, key) is not None]
        for key in stops:
            yield f"{key} = {number(getattr(link, key))}"
        if stops:
            yield f"stop_stiffness = {number(link.stop_stiffness)}"
            for key in ("stop_damping", "stop_width"):
                if getattr(link, key) != 0:
                    yield f"{key} = {number(getattr(link, key))}"
        if link.hold:
            yield "hold = true"


def _tie(kind: str, tie: DraftTie) -> Iterator[str]:
    yield f"[[{kind}]]"
    yield f"name = {_value(tie.name)}"
    for key, value in tie.fields.items():
        yield f"{key} = {_value(value)}"


def _value(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _string(value)
    if isinstance(value, int | float):
        return number(value)
    return "[" + ", ".join(_value(x) for x in value) + "]"


def _string(text: str) -> str:
    plain = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}
    return '"' + "".join(plain.get(c) or (f"\\u{ord(c):04x}" if ord(c) < 32 or ord(c) == 127 else c) for c in text) + '"'


def _comment(text: str, bullet: str = "") -> list[str]:
    wrapped = textwrap.wrap(_printable(text), WIDTH - 2, initial_indent=bullet, subsequent_indent=" " * len(bullet), break_long_words=False,
                            break_on_hyphens=False)
    return [f"# {line}".rstrip() for line in wrapped or [""]]


def _printable(text: str) -> str:
    # a control character of the source must not end a comment
    return "".join(c if c.isprintable() else " " for c in text)
