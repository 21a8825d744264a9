"""Converts geoms of an MJCF file to contacts with the ground plane z = 0, for the pairs and with the friction of MuJoCo."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
from lxml import etree

from build_fmu.errors import UserError, listed
from build_fmu.importers.draft import GROUND
from build_fmu.importers.masses import fixed_to_ground
from build_fmu.importers.mjcf_bodies import Geom
from build_fmu.importers.mjcf_file import Mjcf, elements
from build_fmu.importers.mjcf_parts import Parts
from build_fmu.importers.rigid import start_poses
from build_fmu.importers.urdf_contacts import Solid, add_contacts

TOUCHING = ("sphere", "capsule", "cylinder", "box", "mesh")
OTHER_LAW = ("solref", "solimp", "margin", "gap")  # attributes of MuJoCo's contact law, which the contacts here do not have
EXCLUDED = "<geom> that do not collide with the plane, by contype, conaffinity or <exclude>"
TURNING = 3  # condim above which a contact resists torsion and rolling


def add_ground_contacts(parts: Parts, feet_only: bool) -> None:
    """Adds the contacts to the draft of `parts`."""
    mj, draft, tree = parts.mj, parts.draft, parts.tree
    omitted, solids, dropped, override = Counter(), [], {}, _override(mj)
    still, poses = fixed_to_ground(draft.links), start_poses(draft.links)
    planes = [geom for geom in tree.geoms if geom.kind == "plane" and _is_ground(parts, geom, still, poses)]
    for geom in tree.geoms:
        if geom.kind == "plane":
            continue
        rule = _rule(parts, geom, planes)
        if not rule:
            omitted[EXCLUDED] += rule == 0
        elif geom.kind in TOUCHING and geom.solid:
            link, frame = parts.frame_of(geom.element, geom.body)
            friction, condim, sources = rule
            if override is not None:
                friction, sources = _sliding(mj, mj.root.find("option"), override, condim), [override]
            solid = Solid(geom.kind, link, frame @ geom.solid.pose, list(geom.solid.size), geom.solid.file, friction=friction)
            solids.append(solid)
            if link != GROUND:
                for key in [key for key in OTHER_LAW if any(key in values for values in sources)]:
                    dropped.setdefault(key, []).append(link)
                if condim > TURNING:
                    dropped.setdefault(f"resistance to torsion and rolling (condim {condim})", []).append(link)
        else:
            omitted[f"<geom> of type {geom.kind}"] += 1
    if not solids:
        excluded = f" ({omitted[EXCLUDED]} {EXCLUDED})" if omitted[EXCLUDED] else ""
        raise UserError(f"--contact: '{mj.path}' has no <geom> of {', '.join(TOUCHING)} that collides{excluded}; write [[contact]] by hand")
    add_contacts(solids, omitted, parts.layout, feet_only)
    touching = {contact.fields["link_a"] for contact in draft.contacts}
    for what, links in dropped.items():
        found = [link for link in dict.fromkeys(links) if link in touching]
        if found:
            draft.lost.append(f"{what} of the contacts of {listed(found)}: another law, with the stiffness and damping below")


def _is_ground(parts: Parts, plane: Geom, still: set[str], poses: dict[str, np.ndarray]) -> bool:
    """Returns whether a plane is z = 0 of the ground frame, also of a link in `still`; lists another one that collides."""
    link, frame = parts.frame_of(plane.element, plane.body)
    pose = poses[link] @ frame @ plane.pose
    if link in still and abs(pose[2, 3]) <= 1e-9 and pose[2, 2] >= 1 - 1e-9:
        return True
    if _collides(parts.mj, plane):
        parts.draft.lost.append(f"{parts.mj.place(plane.element)}: contact with a plane other than z = 0")
    return False


def _masks(mj: Mjcf, geom: Geom) -> tuple[int, int]:
    return mj.whole(geom.element, geom.values, "contype", 1), mj.whole(geom.element, geom.values, "conaffinity", 1)


def _collides(mj: Mjcf, geom: Geom) -> bool:
    """Returns whether a geom can collide with others."""
    name = geom.values.get("name")
    return any(_masks(mj, geom)) or any(name and name in (pair.get("geom1"), pair.get("geom2")) for pair, _ in _of_section(mj, "pair"))


def _of_section(mj: Mjcf, tag: str) -> Iterator[tuple[etree._Element, dict[str, str]]]:
    for section in mj.root.findall("contact"):
        yield from ((element, mj.attributes(element)) for element in elements(section) if element.tag == tag)


def _rule(parts: Parts, geom: Geom, planes: list[Geom]) -> tuple[float, int, list[dict[str, str]]] | int | None:
    """Returns friction and condim of a geom's contact with the plane, and the attributes that they come from.

    0: only others than the plane collide with it; None: nothing does. Without a plane in the file it is that of this importer.
    """
    mj = parts.mj
    if not _collides(mj, geom):
        return None
    if not planes:
        return *_mixed(mj, geom), [geom.values]
    for plane in planes:
        names = {geom.values.get("name"), plane.values.get("name")}
        for element, values in _of_section(mj, "pair"):
            if {values.get("geom1"), values.get("geom2")} == names:
                parts.tree.applied.append(element)
                condim = mj.whole(element, values, "condim", 3)
                return _sliding(mj, element, values, condim), condim, [values]
        if _excluded(parts, geom.body, plane.body):
            continue
        (type_a, affinity_a), (type_b, affinity_b) = (_masks(mj, one) for one in (geom, plane))
        if type_a & affinity_b or type_b & affinity_a:
            return *_mixed(mj, geom, plane), [geom.values, plane.values]
    return 0


def _excluded(parts: Parts, *bodies: str) -> bool:
    for element, values in _of_section(parts.mj, "exclude"):
        if {values.get("body1"), values.get("body2")} == set(bodies):
            parts.tree.applied.append(element)
            return True
    return False


def _mixed(mj: Mjcf, *geoms: Geom) -> tuple[float, int]:
    """Returns friction and condim of a pair: of the geom with the higher priority, or the larger of both."""
    ranks = [mj.whole(geom.element, geom.values, "priority", 0) for geom in geoms]
    counted = [geom for geom, rank in zip(geoms, ranks, strict=True) if rank == max(ranks)]
    condim = max(mj.whole(geom.element, geom.values, "condim", 3) for geom in counted)
    return max(_sliding(mj, geom.element, geom.values, condim) for geom in counted), condim


def _sliding(mj: Mjcf, element: etree._Element, values: dict[str, str], condim: int) -> float:
    """Returns the coefficient of sliding friction."""
    first = mj.numbers(element, values, "friction", None, "1") or [1.0]
    return 0.0 if condim == 1 else first[0]


def _override(mj: Mjcf) -> dict[str, str] | None:
    """Returns the parameters of <option> that replace those of all contacts; None: no <flag> enables this."""
    options, chosen = mj.root.findall("option"), {}
    for flag in mj.root.iterfind("option/flag"):
        chosen |= flag.attrib
    given = {key.removeprefix("o_"): value for option in options for key, value in option.attrib.items() if key.startswith("o_")}
    return given if chosen.get("override") == "enable" else None
