"""A random scene under construction: links, loops that are closed where they are made, and what hangs on them.

Lengths are drawn at the scale of the part that a link belongs to, masses as its cube, all else such that the part moves about as
fast as gravity would move it. Numbers are drawn before the poses are computed from them, so loops close to rounding.
"""

from __future__ import annotations

import math

import numpy as np

from tests.crosscheck.dense_scene import FREEDOMS, SLIDE, TURN, Scene

G = 9.81
QUARTERS = (0.0, math.pi / 2, -math.pi / 2, math.pi)
ROWS = {"spherical": 3, "universal": 4, "cylindrical": 4, "revolute": 5, "prismatic": 5, "fixed": 6}


class Maker:
    def __init__(self, rng: np.random.Generator, scale: float) -> None:
        self.rng, self.scale = rng, scale
        self.degrees = rng.random() < 0.15
        self.file: dict = {
            "name": "random",
            "gravity": self.numbers(self.direction() * G),
            "link": [],
            "loop": [],
            "coupling": [],
            "spring": [],
            "bushing": [],
            "frame": [],
            "trajectory": [],
        }
        if self.degrees:
            self.file["angle_unit"] = "deg"
        self.sizes: dict[str, float] = {"ground": scale}
        self.tags: set[str] = set()
        self._scene = None

    # --- draws ---

    def between(self, low: float, high: float) -> float:
        return float(self.rng.uniform(low, high))

    def chance(self, probability: float) -> bool:
        return bool(self.rng.random() < probability)

    def pick(self, items):
        items = list(items)
        return items[int(self.rng.integers(len(items)))]

    def direction(self) -> np.ndarray:
        v = self.rng.normal(size=3)
        return v / np.linalg.norm(v)

    def vector(self, size: float) -> np.ndarray:
        return self.rng.uniform(-size, size, 3)

    def angle(self, radians: float) -> float:
        return math.degrees(radians) if self.degrees else radians

    @staticmethod
    def numbers(values) -> list[float]:
        return [float(v) for v in values]

    # --- links ---

    @property
    def links(self) -> list[dict]:
        return self.file["link"]

    def scene(self) -> Scene:
        """The scene so far, at its start pose."""
        if self._scene is None:
            self._scene = Scene(self.file)
            self._scene.move(self._scene.start())
        return self._scene

    def add(self, parent: str, joint: str, size: float, *, massless: bool = False, **fields) -> str:
        """A link with random frame and inertia where `fields` do not say otherwise."""
        self._scene = None
        name = f"b{len(self.links)}"
        link = {"name": name, "parent": parent, "joint": joint}
        if self.chance(0.2):
            link["joint_name"] = f"j{len(self.links)}"
        dh = {
            "alpha": self.pick(QUARTERS) if self.chance(0.4) else self.between(-3, 3),
            "theta": self.between(-3, 3),
            "a": 0.0 if self.chance(0.2) else self.between(-0.6, 0.6) * size,
            "d": 0.0 if self.chance(0.3) else self.between(-0.6, 0.6) * size,
        }
        if self.chance(0.3):
            dh |= {"gamma": self.between(-3, 3), "b": self.between(-0.5, 0.5) * size}
        dh |= {key: fields.pop(key) for key in ("alpha", "theta", "a", "d", "gamma", "b") if key in fields}
        for key, value in dh.items():
            if value != 0:
                link[key] = self.angle(value) if key in ("alpha", "theta", "gamma") else value
        if not massless:
            self._give_inertia(link, joint, size)
        self._give_position(link, joint, size, fields)
        if joint == "screw":
            link["pitch"] = self.pick([-1, 1]) * self.between(0.02, 0.5) * size
        link |= fields
        self.links.append(link)
        self.sizes[name] = size
        return name

    def _give_inertia(self, link: dict, joint: str, size: float) -> None:
        mass = self.between(0.2, 2) * size**3
        link["mass"], link["com"] = mass, self.numbers(self.vector(0.3 * size))
        if joint in ("revolute", "prismatic") and self.chance(0.15):
            return  # a point mass
        if joint == "fixed" and self.chance(0.3):
            return
        axes = np.linalg.qr(self.rng.normal(size=(3, 3)))[0]
        x, y, z = self.rng.uniform(0.01, 0.1, 3) * mass * size**2
        I = axes @ np.diag([y + z, z + x, x + y]) @ axes.T
        link["inertia"] = self.numbers([I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]])
        if self.chance(0.2):
            link["inertia"] = self.numbers([y + z, z + x, x + y])

    def _give_position(self, link: dict, joint: str, size: float, fields: dict) -> None:
        if "q" in fields:
            return
        q = []
        for kind, _ in FREEDOMS[joint]:
            if kind == TURN:
                q.append(self.angle(self.between(-3, 3) * (20 if self.chance(0.05) else 1)))
            elif kind == SLIDE:
                q.append(self.between(-0.5, 0.5) * size)
            elif self.chance(0.5):
                q += [self.angle(self.between(-3, 3)) for _ in range(3)]
            else:
                v = self.rng.normal(size=4)
                q += self.numbers(v / np.linalg.norm(v))
        if q:
            link["q"] = q if len(q) > 1 else q[0]

    def chain(self, parent: str, size: float, joints: list[str]) -> list[str]:
        names = []
        for joint in joints:
            parent = self.add(parent, joint, size)
            names.append(parent)
        return names

    def rigid_to(self, name: str) -> list[str]:
        """Links that only fixed joints separate from `name`, itself included."""
        table = {link["name"]: link for link in self.links}
        carrier = lambda n: n if n == "ground" or table[n]["joint"] != "fixed" else carrier(table[n]["parent"])
        return [n for n in ["ground", *table] if carrier(n) == carrier(name)]

    def parent_of(self, name: str) -> str:
        return next(link["parent"] for link in self.links if link["name"] == name)

    # --- loops ---

    def to_link(self, link: str, x=None, direction=None) -> list[float]:
        """A point or a direction of the ground in the axes of a link."""
        scene = self.scene()
        T = scene.pose(scene.index[link])[0]
        if x is not None:
            return self.numbers(T[:3, :3].T @ (x - T[:3, 3]))
        return self.numbers(T[:3, :3].T @ direction)

    def in_ground(self, link: str, point=None, direction=None) -> np.ndarray:
        scene = self.scene()
        index = scene.index[link]
        if point is not None:
            return scene.point(index, point)[0]
        return scene.direction(index, scene.numbers.array(direction))[0]

    def perpendicular(self, axis) -> np.ndarray:
        v = np.cross(np.asarray(axis, dtype=float), self.direction())
        while np.linalg.norm(v) < 0.2 * np.linalg.norm(np.asarray(axis, dtype=float)):
            v = np.cross(np.asarray(axis, dtype=float), self.direction())
        return self._square(v, axis)

    def _square(self, v, axis) -> np.ndarray:
        """v made perpendicular to an axis, in long doubles."""
        v, axis = np.asarray(v, np.longdouble), np.asarray(axis, np.longdouble)
        v = v - axis * (axis * v).sum() / (axis * axis).sum()
        return v / np.sqrt((v * v).sum())

    def close(self, kind: str, a: str, b: str, x, axis=None, second=None, *, slide: float = 0.0, directions=None) -> dict:
        """A loop between two links that is closed here: a joint at the ground's point x with an axis (`universal`: and a second)."""
        x = np.asarray(x, np.longdouble)
        axis = np.asarray(self.direction() if axis is None else axis, np.longdouble)
        loop = {"name": f"loop{len(self.file['loop'])}", "type": kind, "link_a": a, "link_b": b}
        x_b = x
        if kind in ("prismatic", "cylindrical"):
            x_b = x + axis * slide / np.sqrt((axis * axis).sum())
        if kind == "point":
            loop["directions"] = [self.numbers(d) for d in directions]
            if len(directions) < 3:  # free to be apart across the directions
                across = np.linalg.svd(np.array(directions, dtype=float))[2][len(directions) :]
                x_b = x + sum(np.asarray(d, np.longdouble) * slide * self.between(-1, 1) for d in across)
        loop["point_a"], loop["point_b"] = self.to_link(a, x=x), self.to_link(b, x=x_b)
        if kind not in ("spherical", "point"):
            axis_b = axis
            if kind == "universal":
                axis_b = self.perpendicular(axis) if second is None else second
            stretch = self.between(0.5, 2)
            loop["axis_a"], loop["axis_b"] = self.to_link(a, direction=axis * stretch), self.to_link(b, direction=axis_b)
        if kind in ("prismatic", "fixed"):
            across = self.perpendicular(axis)
            loop["x_a"], loop["x_b"] = self.to_link(a, direction=across), self.to_link(b, direction=across)
        self.file["loop"].append(loop)
        return loop
