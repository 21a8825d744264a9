"""Parts of random scenes: open trees, mechanisms, and redundant loops."""

from __future__ import annotations

import math

import numpy as np

from tests.crosscheck.dense_scene import FREEDOMS
from tests.crosscheck.scene_maker import ROWS, Maker

ANY = ["revolute"] * 6 + ["prismatic"] * 3 + ["screw"] * 2 + ["fixed", "universal", "cylindrical", "planar", "spherical", "free"]
NOT_FREE = [joint for joint in ANY if joint not in ("free", "fixed")]


def freedoms(joint: str) -> int:
    return sum(3 if kind == "ball" else 1 for kind, _ in FREEDOMS[joint])


def tree(m: Maker, parent: str, size: float) -> None:
    """Branches of all joint types."""
    names = [parent]
    for _ in range(m.pick([1, 2, 3, 4])):
        origin = names[-1] if m.chance(0.6) else m.pick(names)
        names.append(m.add(origin, m.pick(ANY), size))


def floating(m: Maker, parent: str, size: float) -> None:
    """A body on a free joint with an arm."""
    base = m.add(parent, "free", size)
    m.chain(base, size, [m.pick(NOT_FREE) for _ in range(m.pick([0, 1, 2]))])


def massless(m: Maker, parent: str, size: float) -> None:
    """A joint on a massless link, carried on by a body with inertia on a skew joint."""
    first = m.add(parent, m.pick(["revolute", "prismatic"]), size, massless=True)
    kind = m.links[-1]["joint"]
    m.add(first, kind, size, alpha=m.pick([-1, 1]) * m.between(0.5, 2.6))
    m.links[-1].setdefault("inertia", m.numbers(m.rng.uniform(0.02, 0.03, 3) * size**2 * m.links[-1]["mass"]))


def closed_chain(m: Maker, parent: str, size: float, *, ball: bool = False) -> None:
    """One or two chains of random joints whose ends a loop of any type joins; most keep some freedom."""
    kind = m.pick([*ROWS, "point"])
    wanted = ROWS.get(kind, 2) + m.pick([0, 1, 1, 2, 3])
    joints = [m.pick(["spherical", "free"])] if ball else []
    while len(joints) < 3 or sum(freedoms(joint) for joint in joints) < wanted:
        joints.append(m.pick(NOT_FREE))
    m.rng.shuffle(joints)
    cut = m.pick(range(len(joints))) if m.chance(0.5) else 0
    left = m.chain(parent, size, joints[:cut])
    right = m.chain(parent, size, joints[cut:])
    a, b = (left[-1] if left else m.pick(m.rigid_to(parent))), right[-1]
    if m.chance(0.3):
        a, b = b, a
    directions = list(np.linalg.qr(m.rng.normal(size=(3, 3)))[0][: m.pick([1, 2, 3])])
    m.close(kind, a, b, m.in_ground(b, point=m.vector(0.5 * size)), slide=m.between(-0.5, 0.5) * size, directions=directions)


def ball_loop(m: Maker, parent: str, size: float) -> None:
    """A closed chain with a spherical or a free joint in it."""
    closed_chain(m, parent, size, ball=True)


def planar(m: Maker, parent: str, size: float) -> None:
    """A mechanism of three to five joints in a plane; cut at a joint of any type that a plane allows."""
    first = m.add(parent, "revolute", size)
    names = [first]
    for _ in range(m.pick([2, 2, 3, 4])):
        names.append(m.add(names[-1], "revolute", size, alpha=0.0, a=m.between(0.3, 1) * size, d=m.between(-0.2, 0.2) * size))
    slider = m.chance(0.3)
    normal = m.in_ground(first, direction=[0, 0, 1])
    x = m.in_ground(names[-1], point=[m.between(0.3, 1) * size, m.between(-0.3, 0.3) * size, m.between(-0.2, 0.2) * size])
    other = m.pick(m.rigid_to(parent))
    if slider:
        m.close(
            "cylindrical" if m.chance(0.5) else "point",
            other,
            names[-1],
            x,
            m.perpendicular(normal),
            slide=m.between(-0.3, 0.3) * size,
            directions=[m.perpendicular(normal)],
        )
        return
    kind = m.pick(["revolute", "revolute", "spherical", "point", "universal", "cylindrical"])
    directions = None
    if kind == "point":
        u = m.perpendicular(normal)
        directions = [u, np.cross(normal, u)][:2] if m.chance(0.7) else [u, np.cross(normal, u), normal]
    if kind == "universal":
        # one axis of the cross is the plane's normal: it stays in the plane
        m.close(kind, other, names[-1], x, normal)
        return
    m.close(kind, other, names[-1], x, normal, directions=directions)


def parallel_cranks(m: Maker, parent: str, size: float) -> None:
    """A platform on two to four equal cranks: all loops but the first repeat it."""
    length, start = m.between(0.3, 1) * size, m.between(-2.5, 2.5)
    mount = {"alpha": m.pick([0.0, math.pi / 2, m.between(-3, 3)]), "theta": m.between(-3, 3), "a": 0.0, "d": 0.0}
    base = m.add(parent, "fixed", size, **mount)
    crank = m.add(base, "revolute", size, alpha=0.0, a=0.0, theta=0.0, d=0.0, gamma=0.0, b=0.0, q=m.angle(start))
    flat = m.angle(-start)
    platform = m.add(crank, "revolute", size, alpha=0.0, a=length, theta=0.0, d=0.0, gamma=0.0, b=0.0, q=flat)
    for _ in range(m.pick([1, 2, 3])):
        place, turn = m.between(0.3, 1.5) * size * m.pick([-1, 1]), m.between(-0.4, 0.4)
        gamma = m.angle(turn)
        turned = math.radians(gamma) if m.degrees else gamma
        q = m.angle(start - turned)
        other = m.add(base, "revolute", size, gamma=turn, b=0.0, alpha=0.0, a=place, theta=0.0, d=0.0, q=q)
        # the platform's point that is as far from the first crank's tip as the bearings are apart
        x = m.in_ground(other, point=[length, 0, 0])
        m.close(m.pick(["revolute", "spherical", "revolute"]), platform, other, x, m.in_ground(base, direction=[0, 0, 1]))


def concurrent(m: Maker, parent: str, size: float) -> None:
    """Three or four revolute axes through one point, closed by a joint through it."""
    first = m.add(parent, "revolute", size)
    names = [first]
    for _ in range(m.pick([2, 2, 3])):
        names.append(m.add(names[-1], "revolute", size, alpha=m.pick([-1, 1]) * m.between(0.4, 1.4), a=0.0, d=0.0, gamma=0.0, b=0.0))
    centre = m.in_ground(first, point=[0, 0, 0])
    kind = m.pick(["revolute", "revolute", "universal", "cylindrical"])
    m.close(kind, m.pick(m.rigid_to(parent)), names[-1], centre, m.direction())


def legs(m: Maker, parent: str, size: float) -> None:
    """A platform that floats on legs of a universal, a sliding and a spherical joint."""
    platform = m.add(parent, "free", size)
    for _ in range(m.pick([1, 2, 3, 4])):
        leg = m.chain(parent, size, [m.pick(["universal", "spherical"]), "prismatic"])[-1]
        x = m.in_ground(leg, point=m.vector(0.4 * size))
        m.close("spherical", platform, leg, x)


def bearing(m: Maker, parent: str, size: float) -> None:
    """A joint and a loop, or several, that repeat it."""
    joint = m.pick(["revolute", "revolute", "prismatic", "prismatic", "screw", "cylindrical", "spherical", "universal"])
    name = m.add(parent, joint, size)
    for _ in range(m.pick([1, 1, 2])):
        repeat(m, joint, parent, name, size)
    if m.chance(0.5):
        m.chain(name, size, [m.pick(ANY)])


def repeat(m: Maker, joint: str, parent: str, name: str, size: float) -> None:
    """A loop that says what the joint between two links says."""
    a, b = m.pick(m.rigid_to(parent)), m.pick(m.rigid_to(name))
    before = m.scene().dofs[m.scene().links[m.scene().index[name]].dofs[0]]
    axis, centre = before.axis, m.in_ground(name, point=[0, 0, 0])
    along = centre + axis * m.between(-1, 1) * size
    if m.chance(0.5):
        a, b = b, a
    if joint == "revolute":
        kind = m.pick(["revolute", "revolute", "cylindrical", "spherical", "point"])
        directions = list(np.linalg.qr(m.rng.normal(size=(3, 3)))[0])
        m.close(kind, a, b, along, axis, directions=directions)
    elif joint == "prismatic":
        kind = m.pick(["prismatic", "prismatic", "cylindrical"])
        m.close(kind, a, b, along + m.vector(size), axis, slide=m.between(-0.5, 0.5) * size)
    elif joint in ("cylindrical", "screw"):
        m.close("cylindrical", a, b, along, axis, slide=m.between(-0.5, 0.5) * size)
    elif joint == "spherical":
        m.close(m.pick(["spherical", "point"]), a, b, centre, directions=list(np.eye(3)))
    elif m.chance(0.5):
        m.close("spherical", a, b, centre)
    else:
        turned = m.in_ground(name, direction=[0, 1, 0])
        m.close("universal", a, b, centre, *((axis, turned) if b == name or b in m.rigid_to(name) else (turned, axis)))


def coaxial(m: Maker, parent: str, size: float) -> None:
    """Two joints on one axis and a loop over both that leaves their sum free."""
    kind = m.pick(["revolute", "prismatic"])
    first = m.add(parent, kind, size)
    last = m.add(first, kind, size, alpha=0.0, a=0.0 if kind == "revolute" else m.between(-0.5, 0.5) * size)
    if m.chance(0.5):
        last = m.add(last, "fixed", size)
    a, b = (parent, last) if m.chance(0.5) else (last, parent)
    axis, x = m.in_ground(first, direction=[0, 0, 1]), m.in_ground(first, point=[0, 0, m.between(-1, 1) * size])
    loop = m.pick(["revolute", "cylindrical"] if kind == "revolute" else ["prismatic", "cylindrical"])
    m.close(loop, a, b, x if kind == "revolute" else x + m.vector(size), axis)


def twice(m: Maker, parent: str, size: float) -> None:
    """A loop of the scene once more, its ends exchanged or not."""
    loops = [loop for loop in m.file["loop"] if loop["type"] != "point"]
    if not loops:
        planar(m, parent, size)
        loops = [loop for loop in m.file["loop"] if loop["type"] != "point"] or [m.file["loop"][-1]]
    loop = dict(m.pick(loops))
    loop["name"] = f"loop{len(m.file['loop'])}"
    if loop["type"] != "point" and m.chance(0.5):
        for key in ("link", "point", "axis", "x"):
            pair = [loop.pop(f"{key}_{side}", None) for side in "ab"]
            if pair[0] is not None:
                loop[f"{key}_a"], loop[f"{key}_b"] = pair[1], pair[0]
    m.file["loop"].append(loop)


def between_bodies(m: Maker, parent: str, size: float) -> None:
    """A loop between any two bodies that something moves apart."""
    scene = m.scene()
    names = ["ground", *(link["name"] for link in m.links)]
    for _ in range(20):
        a, b = m.pick(names), m.pick(names)
        apart = set(scene.path(scene.index[a])) ^ set(scene.path(scene.index[b]))
        local = min(m.sizes[a], m.sizes[b])
        far = max(m.sizes[n] for n in (a, b)) > 3 * local
        fitting = [kind for kind, rows in ROWS.items() if rows < len(apart) - 1] + ["point"] * (len(apart) > 4)
        if a != b and len(apart) > 4 and not far:
            directions = list(np.linalg.qr(m.rng.normal(size=(3, 3)))[0][: m.pick([1, 2, 3])])
            at, slide = m.in_ground(b, point=m.vector(0.5 * local)), m.between(-0.5, 0.5) * local
            m.close(m.pick(fitting), a, b, at, slide=slide, directions=directions)
            return


def several_loops(m: Maker, parent: str, size: float) -> None:
    """A tree with loops that share joints and meet at different bodies."""
    names = [parent]
    for _ in range(m.pick([7, 8, 9, 10, 11])):
        names.append(m.add(names[-1] if m.chance(0.5) else m.pick(names), m.pick(["revolute", "revolute", "prismatic", "screw"]), size))
    for _ in range(m.pick([2, 2, 3])):
        between_bodies(m, parent, size)


PARTS = {
    "tree": tree,
    "floating": floating,
    "massless": massless,
    "closed_chain": closed_chain,
    "ball_loop": ball_loop,
    "planar": planar,
    "parallel": parallel_cranks,
    "concurrent": concurrent,
    "legs": legs,
    "bearing": bearing,
    "coaxial": coaxial,
    "twice": twice,
    "between": between_bodies,
    "several": several_loops,
}
# what `--only` may also say
CLASSES = {
    "open": ["tree", "floating", "massless"],
    "loops": ["closed_chain", "ball_loop", "planar", "legs", "between", "several"],
    "repeat": ["bearing", "coaxial"],
    "redundant": ["parallel", "concurrent", "twice", "planar"],
    "all": list(PARTS),
}
