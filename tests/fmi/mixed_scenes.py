"""Random scenes that mix everything: loops beside open joints, spherical and free joints in and beside them, repeated joints,
ports, couplings, prescribed and held parts. Poses are computed here, from the definition in docs/model_file.md."""

from __future__ import annotations

import json
import random

import numpy as np

AXES, ORIGIN = np.eye(3), np.zeros(3)
ROWS = {"point": 3, "spherical": 3, "universal": 4, "cylindrical": 4, "revolute": 5, "prismatic": 5, "fixed": 6}
# numbers of turns and slides, without those of a quaternion
SIMPLE = {"revolute": 1, "prismatic": 1, "universal": 2, "cylindrical": 2, "planar": 3, "spherical": 0, "free": 3}
PLACE = ("alpha", "a", "theta", "d", "gamma", "b")


def turn(axis: int, angle: float) -> np.ndarray:
    return turn_by(angle * AXES[axis])


def turn_by(vector: np.ndarray) -> np.ndarray:
    """Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    K = np.cross(np.eye(3), vector / angle) if angle else np.zeros((3, 3))
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def quaternion(R: np.ndarray) -> np.ndarray:
    """w, x, y, z: the eigenvector of Bar-Itzhack's matrix."""
    K = (
        np.array(
            [
                [R[0, 0] - R[1, 1] - R[2, 2], 0, 0, 0],
                [R[0, 1] + R[1, 0], R[1, 1] - R[0, 0] - R[2, 2], 0, 0],
                [R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], R[2, 2] - R[0, 0] - R[1, 1], 0],
                [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1], np.trace(R)],
            ]
        )
        / 3
    )
    x, y, z, w = np.linalg.eigh(K)[1][:, -1]
    return np.array([w, x, y, z])


class Pose:
    def __init__(self, R: np.ndarray = AXES, p: np.ndarray = ORIGIN) -> None:
        self.R, self.p = R, p

    def __mul__(self, other: Pose) -> Pose:
        return Pose(self.R @ other.R, self.p + self.R @ other.p)

    def shift(self, axis: int, by: float) -> Pose:
        return self * Pose(p=by * AXES[axis])

    def turn(self, axis: int, by: float) -> Pose:
        return self * Pose(turn(axis, by))

    def place(self, at: dict) -> Pose:
        at = {key: at.get(key, 0.0) for key in PLACE}
        return self.turn(2, at["gamma"]).shift(2, at["b"]).turn(0, at["alpha"]).shift(0, at["a"]).turn(2, at["theta"]).shift(2, at["d"])

    def joint(self, kind: str, q: list[float], R: np.ndarray) -> Pose:
        if kind == "revolute":
            return self.turn(2, q[0])
        if kind == "prismatic":
            return self.shift(2, q[0])
        if kind == "universal":
            return self.turn(2, q[0]).turn(1, q[1])
        if kind == "cylindrical":
            return self.turn(2, q[0]).shift(2, q[1])
        if kind == "planar":
            return self.shift(0, q[0]).shift(1, q[1]).turn(2, q[2])
        return self * Pose(R, np.array(q) if q else np.zeros(3))


class Scene:
    """`open_by`: constraint violation of the start values. `size`: of the mechanism, m."""

    def __init__(self, seed: int, *, open_by: float = 0.0, motions: bool = True, loops: int = 0, velocities: bool = True) -> None:
        self.draw, self.open_by, self.motions, self.velocities = random.Random(seed), open_by, motions, velocities
        self.links, self.poses, self.loops, self.frames = [], [], [], []
        for _ in range(loops or self.draw.choice([1, 2, 2, 3])):
            self.add_loop()
        for _ in range(2):  # beside the loops, and on them
            self.add_link(self.draw.choice([None, self.draw.randrange(len(self.links))]), self.any_joint())
        self.frames = [
            {
                "name": "tool",
                "link": self.draw.choice(self.links)["name"],
                "position": self.near(0.3, 3),
                "outputs": ["pose", "velocity", "acceleration", "power"],
                "port": self.draw.choice(["ground", "frame"]),
            }
        ]
        self.couplings = [self.coupling(number) for number in range(2) if self.draw.random() < 0.5]
        # a wrist sensor between the first loop and its link b
        end = self.loops[0]["link_b"]
        self.loops[0]["link_b"] = "pad"
        self.poses.append(Pose() if end == "ground" else self.poses[int(end[1:])])
        self.links.append({"name": "pad", "parent": end, "joint": "fixed", "mass": 0.1})
        self.frames.append(
            {"name": "wrist", "link": "pad", "position": [0.1, 0.2, 0.3], "rpy": [0.4, 0.5, 0.6], "outputs": ["wrench", "imu"]}
        )

    def coupling(self, number: int) -> dict:
        """Of two joints with one freedom; the first rigid and satisfied up to `open_by`, the second with backlash."""
        while sum(self.couples(link) for link in self.links) < 2:
            self.add_link(self.draw.randrange(len(self.links)), self.draw.choice(["revolute", "prismatic"]))
        chosen = self.draw.sample([link for link in self.links if self.couples(link)], 2)
        ratios = [self.draw.choice([-1, 1]) * self.draw.uniform(0.5, 2) for _ in chosen]
        offset = sum(ratio * link["q"] for ratio, link in zip(ratios, chosen, strict=True)) + self.near(self.open_by)
        table = {"name": f"c{number}", "joints": [link["joint_name"] for link in chosen], "ratios": ratios, "offset": offset}
        return table | ({"stiffness": 20.0, "damping": 0.5, "backlash": 0.1, "width": 1.0, "offset": offset + 0.2} if number else {})

    def couples(self, link: dict) -> bool:
        return link["joint"] in ("revolute", "prismatic") and not link.get("drive") and not link.get("hold")

    def near(self, size: float, count: int = 0):
        values = [self.draw.uniform(-size, size) for _ in range(max(1, count))]
        return values if count else values[0]

    def any_joint(self) -> str:
        return self.draw.choice(
            ["revolute", "revolute", "prismatic", "universal", "cylindrical", "planar", "spherical", "spherical", "free"]
        )

    def add_link(self, parent: int | None, kind: str) -> int:
        number = len(self.links)
        link = {"name": f"b{number}", "parent": "ground" if parent is None else f"b{parent}", "joint": kind, "joint_name": f"j{number}"}
        link.update(dict(zip(PLACE, self.near(1, 6), strict=True)) if parent is not None else {"alpha": self.near(1), "a": self.near(1)})
        q, R = self.near(0.8, SIMPLE[kind]) if SIMPLE[kind] else [], turn_by(np.array(self.near(2, 3)))
        self.poses.append((Pose() if parent is None else self.poses[parent]).place(link).joint(kind, q, R))
        start = [x + self.near(self.open_by) for x in q]
        ball = kind in ("spherical", "free")
        if ball:
            start += list(quaternion(R @ turn_by(np.array(self.near(self.open_by, 3)))))
        elif self.motions and self.draw.random() < 0.2:
            link["drive"] = "motion"
            start = q
        if self.draw.random() < 0.15:
            link["hold"] = True
        link["q"] = start if len(start) > 1 else start[0]
        speeds = self.near(1, SIMPLE[kind] + 3 * ball) if self.velocities else [0.0] * (SIMPLE[kind] + 3 * ball)
        link["qd"] = speeds if len(speeds) > 1 else speeds[0]
        x, y, z = (self.draw.uniform(0.05, 0.2) for _ in range(3))
        link.update(mass=self.draw.uniform(0.5, 2), com=self.near(0.3, 3), inertia=[y + z, z + x, x + y, *self.near(0.01, 3)])
        if kind == "revolute":
            link["damping"] = self.draw.uniform(0.1, 0.5)
        self.links.append(link)
        return number

    def freedom(self, link: int) -> int:
        if self.links[link].get("drive") or self.links[link].get("hold"):
            return 0
        return SIMPLE[self.links[link]["joint"]] + 3 * (self.links[link]["joint"] in ("spherical", "free"))

    def add_loop(self) -> None:
        """Two branches with their tips joined, each from ground or any link, so that loops share joints. They have as many
        joints as the loop needs, and one more."""
        kind = self.draw.choice(list(ROWS))
        tips, freedom = [self.draw.choice([None, *range(len(self.links))]) for _ in range(2)], 0
        while freedom <= ROWS[kind] or tips[0] == tips[1]:
            side = self.draw.randrange(2)
            tips[side] = self.add_link(tips[side], self.any_joint())
            freedom += self.freedom(tips[side])
        self.close(kind, *tips)
        if self.draw.random() < 0.2:  # a second bearing, redundant
            self.loops.append(dict(self.loops[-1], name=f"again{len(self.loops)}"))

    def close(self, kind: str, a: int | None, b: int | None) -> None:
        at_a, at_b = (Pose() if link is None else self.poses[link] for link in (a, b))
        point = at_b.p + at_b.R @ np.array(self.near(0.5, 3))
        axes = turn_by(np.array(self.near(2, 3)))
        axis_b = axes[:, 0] if kind == "universal" else axes[:, 2]
        slide = self.near(0.3) if kind in ("cylindrical", "prismatic") else 0
        into = lambda at, v: list(at.R.T @ v)
        name = lambda link: "ground" if link is None else self.links[link]["name"]
        loop = {
            "name": f"l{len(self.loops)}",
            "type": kind,
            "link_a": name(a),
            "link_b": name(b),
            "point_a": into(at_a, point - at_a.p),
            "point_b": into(at_b, point + slide * axis_b - at_b.p),
        }
        if kind == "point":
            loop["directions"] = [list(row) for row in axes]
        elif kind != "spherical":
            loop.update(axis_a=into(at_a, axes[:, 2]), axis_b=into(at_b, axis_b))
        if kind in ("prismatic", "fixed"):
            loop.update(x_a=into(at_a, axes[:, 0]), x_b=into(at_b, axes[:, 0]))
        self.loops.append(loop)

    def toml(self) -> str:
        text = 'name = "mixed"\ngravity = [1.0, -2.0, -9.0]\n'
        for section, entries in (("link", self.links), ("loop", self.loops), ("coupling", self.couplings), ("frame", self.frames)):
            for entry in entries:
                text += f"\n[[{section}]]\n" + "".join(f"{key} = {json.dumps(value)}\n" for key, value in entry.items())
        tunable = ["gravity[2]", "b0.mass", f"{self.links[-1]['name']}.com[1]"]
        return (
            text
            + f'\n[fmu]\noutputs = ["acceleration", "energy", "momentum", "power", "solver", "mass_matrix", "bias", "gravity_torque", "coriolis", "passive", "reaction", "constraint_jacobian"]\ntunable = {json.dumps(tunable)}\n'
        )
