"""Reads a neutral scene in JSON, form `mbs-scene/1` (tests/scenes/README.md)."""

from __future__ import annotations

import json
from argparse import Namespace
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError
from build_fmu.importers.draft import GROUND, DhFrame, Draft, DraftLink, DraftTie, Names, legal
from build_fmu.importers.fields import Fields, read_text
from build_fmu.importers.rigid import pose_of
from build_fmu.importers.toml_writer import number

FORMAT = "mbs-scene/1"
DH_KEYS = ("gamma", "b", "alpha", "a", "theta", "d")


def read(path: Path, _options: Namespace | None = None) -> Draft:
    """Returns the draft of a scene; raises UserError with file, line or field."""
    source = str(path)
    try:
        data = json.loads(read_text(path))
    except json.JSONDecodeError as error:
        raise UserError(f"{source}:{error.lineno}:{error.colno}: invalid JSON: {error.msg}") from None
    except RecursionError:
        raise UserError(f"{source}: nested too deeply") from None
    scene = Fields(source, "", data)
    if scene.data.get("format") != FORMAT:
        raise UserError(f"{source}: 'format' must be \"{FORMAT}\", got {json.dumps(scene.data.get('format'))}")
    draft = Draft(
        name=legal(scene.text("name", path.stem)), source=path.name, description=scene.text("title", ""), gravity=scene.vector("gravity", 3)
    )
    bodies = scene.items("bodies")
    if not bodies:
        raise UserError(f"{source}: 'bodies' is missing or empty")
    names = Names()
    link_names = [names.take(body.text("name", f"body{i + 1}")) for i, body in enumerate(bodies)]
    initial = scene.inner("initial") if "initial" in scene.data else Fields(source, "initial", {})
    q = initial.vector("q", len(bodies), [0.0] * len(bodies))
    qd = initial.vector("qd", len(bodies), [0.0] * len(bodies))
    for i, body in enumerate(bodies):
        draft.links.append(_link(body, i, link_names, q[i], qd[i]))
    for k, loop in enumerate(scene.items("loops")):
        draft.loops.append(_loop(loop, names.take(loop.text("name", f"loop{k + 1}")), link_names))
    for k, force in enumerate(scene.items("forces")):
        draft.springs.append(_spring(force, names.take(force.text("name", f"spring{k + 1}")), link_names))
    _times(scene, draft)
    _inputs(scene, draft, link_names)
    draft.doubts += names.sentences()
    _unknown(scene, draft)
    return draft


def _link(body: Fields, index: int, names: list[str], q: float, qd: float) -> DraftLink:
    body.known("name", "parent", "joint", "mass", "com", "inertia")
    joint = body.inner("joint")
    joint.known("type", "name", "axis", "mdh", "placement", "armature", "stiffness", "damping", "rest")
    if any(x != y for x, y in zip(joint.vector("axis", 3, [0, 0, 1]), (0, 0, 1), strict=True)):
        raise joint.error("axis", "must be [0, 0, 1]: the axis is z of the link frame")
    mdh = joint.inner("mdh")
    mdh.known(*DH_KEYS)
    dh = DhFrame(*(mdh.number(key, 0.0) for key in DH_KEYS))
    parent = body.index("parent", -1, index - 1)
    link = DraftLink(
        names[index],
        GROUND if parent < 0 else names[parent],
        joint.text("type", among=("revolute", "prismatic")),
        dh=dh,
        mass=body.number("mass", 0.0),
        com=body.vector("com", 3, [0] * 3),
        inertia=body.vector("inertia", 6, [0] * 6),
        q=q,
        qd=qd,
    )
    for key in ("armature", "stiffness", "damping", "rest"):
        setattr(link, key, joint.number(key, 0.0))
    if "placement" in joint.data:
        _agree(joint, dh)
    return link


def _agree(joint: Fields, dh: DhFrame) -> None:
    """Checks that both definitions of the frame in the scene agree."""
    placement = joint.inner("placement")
    rows = placement.list("R")
    pose = pose_of(dh)
    try:
        given = np.array(rows, float).reshape(3, 3)
    except (TypeError, ValueError):
        raise placement.error("R", "must be three rows of three numbers") from None
    error = max(float(np.abs(pose[:3, :3] - given).max()), float(np.abs(pose[:3, 3] - placement.vector("p", 3)).max()))
    if not error < 1e-9:
        raise joint.error("placement", f"differs from 'mdh' by {error:.2g}")


def _body(tie: Fields, key: str, names: list[str]) -> str:
    index = tie.index(key, -1, len(names) - 1)
    return GROUND if index < 0 else names[index]


def _loop(loop: Fields, name: str, names: list[str]) -> DraftTie:
    kind = loop.text("type", among=("point", "revolute"))
    fields: dict[str, object] = {"type": kind}
    for side in "ab":
        fields[f"link_{side}"] = _body(loop, f"body_{side}", names)
        fields[f"point_{side}"] = loop.vector(f"point_{side}", 3, [0] * 3)
    if kind == "point":
        loop.known("name", "type", "body_a", "body_b", "point_a", "point_b", "directions")
        rows = loop.list("directions")
        if not 1 <= len(rows) <= 3:
            raise loop.error("directions", f"must be 1 to 3 directions, got {len(rows)}")
        fields["directions"] = [
            Fields(loop.source, loop.where, {f"directions[{i}]": row}).vector(f"directions[{i}]", 3) for i, row in enumerate(rows)
        ]
        return DraftTie(name, fields)
    loop.known("name", "type", "body_a", "body_b", "point_a", "point_b", "axis_a", "axis_b", "perp1_a", "perp2_a")
    if "axis_a" in loop.data:
        fields["axis_a"] = loop.vector("axis_a", 3)
    else:
        # the axis is perpendicular to both
        fields["axis_a"] = [float(x) for x in np.cross(loop.vector("perp1_a", 3), loop.vector("perp2_a", 3))]
    fields["axis_b"] = loop.vector("axis_b", 3)
    return DraftTie(name, fields)


def _spring(force: Fields, name: str, names: list[str]) -> DraftTie:
    force.text("type", among=("spring_damper",))
    force.known("name", "type", "body_a", "body_b", "point_a", "point_b", "k", "c", "stiffness", "damping", "rest_length")
    fields: dict[str, object] = {}
    for side in "ab":
        fields[f"link_{side}"] = _body(force, f"body_{side}", names)
        fields[f"point_{side}"] = force.vector(f"point_{side}", 3, [0] * 3)
    fields["stiffness"] = force.number("k" if "k" in force.data else "stiffness", 0.0)
    fields["damping"] = force.number("c" if "c" in force.data else "damping", 0.0)
    fields["rest_length"] = force.number("rest_length", 0.0)
    return DraftTie(name, fields)


def _times(scene: Fields, draft: Draft) -> None:
    if "time" in scene.data:
        time = scene.inner("time")
        for key, field in (("t_end", "stop_time"), ("dt_out", "step_size")):
            draft.fmu[field] = time.number(key)
            if draft.fmu[field] <= 0:
                raise time.error(key, f"must be a positive time in s, got {draft.fmu[field]:g}")


def _inputs(scene: Fields, draft: Draft, names: list[str]) -> None:
    """Converts the inputs, which a model file does not contain, to arguments of `build-fmu simulate` in a comment."""
    draft.inputs = [_input(item, names) for item in scene.items("inputs")]
    if draft.inputs:
        draft.lost.append("the inputs: they are part of the command at the top of the file")


def _input(item: Fields, names: list[str]) -> str:
    item.known("joint", "type", "value", "amplitude", "frequency", "phase")
    joint = names[item.index("joint", 0, len(names) - 1)]
    kind = item.text("type", among=("constant", "sine", "bangbang"))
    if kind == "constant":
        return f"{joint}.tau={number(item.number('value'))}"
    amplitude, frequency = number(item.number("amplitude")), number(item.number("frequency"))
    if kind == "sine":
        phase = item.number("phase", 0.0)
        shift = f" + {number(phase)}" if phase else ""
        return f"{joint}.tau={amplitude}*sin(2*pi*{frequency}*t{shift})"
    return f"{joint}.tau={amplitude} if {frequency}*t - floor({frequency}*t) < 0.5 else -({amplitude})"


def _unknown(scene: Fields, draft: Draft) -> None:
    if "trajectory" in scene.data:
        draft.lost.append("the prescribed trajectory: not supported")
    carried = {
        "format",
        "name",
        "title",
        "set",
        "gravity",
        "bodies",
        "loops",
        "forces",
        "inputs",
        "initial",
        "time",
        "reference",
        "source",
        "trajectory",
    }
    draft.lost += [f"the field '{key}'" for key in scene.data if key not in carried]
