"""Contacts of random scenes: every pair of shapes, pressed at the start."""

from __future__ import annotations

import math

import numpy as np

from tests.crosscheck.dense_contact import Side
from tests.crosscheck.scene_maker import G, Maker
from tests.crosscheck.scene_states import loads

PAIRS = [
    *((a, "plane") for a in ("points", "sphere", "capsule", "box", "disk")),
    *(("sphere", b) for b in ("sphere", "capsule", "box")),
    ("box", "box"),
]


def shape(m: Maker, kind: str, link: str, size: float) -> dict:
    """Fields of a shape that stands anywhere on a link, without suffix."""
    fields = {"shape": kind, "point": m.numbers(m.vector(0.5 * size))}
    if kind == "points":
        del fields["point"]
        fields["points"] = [m.numbers(m.vector(0.5 * size)) for _ in range(m.pick([1, 2, 5]))]
    elif kind == "box":
        fields["size"] = [m.between(0.3, 1) * size for _ in range(3)]
        fields["rpy"] = [m.angle(m.between(-3, 3)) for _ in range(3)]
        if m.pick([True, False]):
            fields["radius"] = m.between(0.02, 0.4) * min(fields["size"])
    elif kind != "plane":
        fields["radius"] = m.between(0.2, 0.5) * size
    if kind == "capsule":
        fields["point2"] = [x + y for x, y in zip(fields["point"], m.numbers(m.vector(size)), strict=True)]
    if kind == "disk":
        fields["axis"] = m.numbers(m.direction())
        fields["tube"] = m.between(0.1, 0.9) * fields["radius"]
    if kind == "plane":
        fields["normal"] = m.numbers(m.direction() * m.between(0.5, 2))
    return fields


def lay(m: Maker, contact: dict, suffix: str, link: str, fields: dict) -> None:
    contact[f"link_{suffix}"] = link
    for key, value in fields.items():
        contact[f"point_{suffix}2" if key == "point2" else f"{key}_{suffix}"] = value


def shift(m: Maker, fields: dict, link: str, by) -> None:
    """Moves a shape by a vector of the ground frame."""
    scene = m.scene()
    turned = scene.pose(scene.index[link])[0][:3, :3].T @ by
    for key in ("point", "point2"):
        if key in fields:
            fields[key] = m.numbers(np.asarray(fields[key], np.longdouble) + turned)


def give_contacts(m: Maker) -> None:
    """Draws from a generator of its own: what else a scene holds does not depend on its contacts."""
    rng = m.rng
    m.rng = np.random.default_rng(rng.bit_generator.seed_seq.spawn(1)[0])
    add_contacts(m)
    m.rng = rng


def add_contacts(m: Maker) -> None:
    weight = loads(m)
    for k in range(m.pick([0, 0, 0, 1, 1, 2])):
        a = m.pick([link["name"] for link in m.links])
        b = "ground" if m.chance(0.6) else m.pick([link["name"] for link in m.links])
        if b in m.rigid_to(a) or a in m.rigid_to("ground"):
            continue
        size = min(m.sizes[a], m.sizes[b])
        kinds = m.pick(PAIRS)
        first, second = shape(m, kinds[0], a, size), shape(m, kinds[1], b, size)
        width = m.between(0.05, 0.3) * size
        force = weight[a]
        contact = {
            "name": f"contact{k}",
            "stiffness": m.between(0.5, 20) * force / size,
            "damping": m.between(0, 1) / math.sqrt(G * size),
            "width": width,
            "friction": m.between(0, 1),
            "static_friction": m.between(0, 1.5),
            "friction_velocity": m.between(0.1, 1) * math.sqrt(G * size),
            "rolling": m.between(0, 0.1) * size,
            "torsion": m.between(0, 0.1) * size,
            "spin_velocity": m.between(0.1, 1) * math.sqrt(G / size),
            "outputs": ["force", "torque"],
        }
        # the ball is pressed into the surface where it would meet it on a line to the surface's center
        lay(m, contact, "a", a, first)
        lay(m, contact, "b", b, second)
        scene = m.scene()
        scene.file = m.file
        one, other = Side(scene, contact, "a"), Side(scene, contact, "b")
        center, radius = one.balls(other)[0]
        depth, normal = other.below(center)
        # on a lever of many body lengths rounding of a force is large against the body's own forces
        arms = [float(np.linalg.norm((center - scene.point(side.link, [0, 0, 0])[0]).astype(float))) for side in (one, other)]
        if (b != "ground" and max(arms) > 10 * size) or max(arms) > 1e3 * size:
            continue
        shift(m, second, b, normal * (m.between(0.1, 2) * width - depth - radius))
        lay(m, contact, "b", b, second)
        if m.chance(0.3):
            swap = {"_a": "_b", "_b": "_a"}
            contact = {next((key.replace(s, t) for s, t in swap.items() if s in key[-3:]), key): value for key, value in contact.items()}
        m.file.setdefault("contact", []).append(contact)
        m.tags.add("contact")
