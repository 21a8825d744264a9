"""Reads an MJCF file of MuJoCo: bodies, joints, inertias, equality constraints, actuators, contacts, keyframes (docs/mjcf.md)."""

from __future__ import annotations

import math
from argparse import Namespace
from collections import Counter
from pathlib import Path

from build_fmu.errors import UserError, did_you_mean, listed
from build_fmu.importers.draft import Draft, legal
from build_fmu.importers.mjcf_attributes import check_keywords, unknown_attributes
from build_fmu.importers.mjcf_bodies import WORLD, Tree
from build_fmu.importers.mjcf_contacts import add_ground_contacts
from build_fmu.importers.mjcf_file import Mjcf, elements
from build_fmu.importers.mjcf_parts import Parts
from build_fmu.importers.tree import TreeLayout, set_pose
from build_fmu.importers.urdf_limits import add_stops, report_outside, start_inside

# sections that are read, concern other tasks of MuJoCo, or are listed elsewhere
SECTIONS = (
    "compiler",
    "option",
    "default",
    "asset",
    "worldbody",
    "equality",
    "tendon",
    "actuator",
    "keyframe",
    "size",
    "visual",
    "statistic",
)
FORCES = ("constraint", "equality", "frictionloss", "limit", "spring", "damper", "actuation")  # that a <flag> can disable
PASSIVE = ("spring", "damper")  # one flag in older files
LISTED = ("contact", "sensor", "custom", "extension", "deformable")


def read(path: Path, options: Namespace) -> Draft:
    """Returns the draft; raises UserError with file, line and element."""
    mj = Mjcf(path)
    check_keywords(mj)
    draft = Draft(name=legal(mj.root.get("model") or path.stem), source=path.name)
    _options(mj, draft)
    tree = Tree(mj, draft)
    tree.read()
    if not tree.joints:
        raise UserError(f"'{path}' has no joint")
    layout = TreeLayout(draft, tree.bodies, options, "MJCF")
    layout.lay(WORLD)
    parts = Parts(tree, layout)
    parts.add_equalities()
    parts.add_tendons()
    parts.add_rotors()
    parts.add_keyframe(options.keyframe)
    single = [(tree.bodies[joint.link], parts.link_of(joint.name)) for joint in tree.joints if joint.kind in ("hinge", "slide")]
    for body, link in single:
        body.q = link.q
    asked = set_pose(tree.bodies, options.pose)
    limited = [body for body, _ in single if body.limits]
    start_inside(limited, asked, draft)
    report_outside(limited, draft)
    for body, link in single:
        link.q = body.q
    add_stops(limited, layout, options.stops)
    parts.add_actuators(options.limits)
    if options.shapes:
        parts.add_shapes()
    if options.frames:
        parts.add_frames()
    if options.contact:
        add_ground_contacts(parts, feet_only=options.contact == "ground")
    _losses(mj, tree, draft, options)
    draft.notes.append(
        "The ground frame is the world frame. Link frames are chosen anew (z: joint axis, x: common normal); the motion is the same. "
        "A body with several joints is a chain of links."
    )
    return draft


def _options(mj: Mjcf, draft: Draft) -> None:
    flags: dict[str, str] = {}
    for element in mj.root.findall("option"):
        draft.gravity = mj.numbers(element, element.attrib, "gravity", 3, " ".join(map(str, draft.gravity)))
        if "timestep" in element.attrib:
            draft.fmu["step_size"] = mj.numbers(element, element.attrib, "timestep", 1)[0]
        for key in ("wind", "density", "viscosity"):
            if any(mj.numbers(element, element.attrib, key, None, "0")):
                draft.lost.append(f"{mj.place(element)}: '{key}' of <option>: forces of a medium")
        for flag in element.findall("flag"):
            flags |= flag.attrib
            passive = PASSIVE if flag.get("passive") == "disable" else ()
            off = [key for key in FORCES if key in passive or flag.get(key) == "disable"]
            if off:
                draft.lost.append(f"{mj.place(flag)}: <flag> disables {listed(off)}: the model has these forces")
    if flags.get("gravity") == "disable":
        draft.gravity = [0.0, 0.0, 0.0]


def _losses(mj: Mjcf, tree: Tree, draft: Draft, options: Namespace) -> None:
    """Lists what was not converted."""
    draft.lost += [f"{count} x {what}" for what, count in tree.omitted.items() if count]
    for element in elements(mj.root):
        if element.tag in LISTED:
            inner = Counter(child.tag for child in elements(element) if child not in tree.applied)
            if not inner and len(element):
                continue
            draft.lost.append(f"<{element.tag}>: {', '.join(f'{count} x <{tag}>' for tag, count in inner.items())}")
        elif element.tag not in SECTIONS:
            draft.lost.append(f"{mj.place(element)}: unknown <{element.tag}>{did_you_mean(element.tag, (*SECTIONS, *LISTED))}")
    unknown: dict[tuple[str, str, str], list[str]] = {}
    for element, key, known in unknown_attributes(mj.root):
        unknown.setdefault((element.tag, key, did_you_mean(key, known)), []).append(mj.place(element))
    for (tag, key, hint), places in unknown.items():
        draft.lost.append(f"{len(places)} x '{key}' of <{tag}>, first in {places[0]}{hint}")
    touching = sum(g.kind != "plane" and (g.values.get("contype"), g.values.get("conaffinity")) != ("0", "0") for g in tree.geoms)
    if touching and not options.contact:
        draft.lost.append(f"contact of {touching} <geom>: --contact ground converts those of the feet, --contact all converts all")
    if any(body.friction for body in tree.bodies.values()):
        draft.doubts.append("frictionloss is dry friction with a smooth law here, see friction_velocity")
    if not math.isclose(sum(x * x for x in draft.gravity), 9.81**2, rel_tol=1e-3):
        draft.doubts.append(f"gravity is {listed([f'{x:g}' for x in draft.gravity])} m/s2, as in the file")
