"""Forces of contacts in the dense formulation, in the ground frame: docs/contact.md."""

from __future__ import annotations

import itertools

import numpy as np

from tests.crosscheck.dense_scene import cross

TERRAIN = ("plane",)


class Side:
    """One shape of a contact: its fields without the suffix."""

    def __init__(self, scene, contact: dict, side: str) -> None:
        self.scene, self.n = scene, scene.numbers
        self.link = scene.index[contact.get(f"link_{side}", "ground")]
        self.kind = contact.get(f"shape_{side}", "plane")
        self.fields = {
            key[:-2] if key.endswith(f"_{side}") else key[:-3] + "2": value for key, value in contact.items() if f"_{side}" in key[-3:]
        }

    def place(self, key: str):
        return self.scene.point(self.link, self.fields.get(key, [0, 0, 0]))[0]

    def direction(self, key: str):
        vector = self.n.array(self.fields.get(key, [0, 0, 1]))
        return self.scene.direction(self.link, vector / self.n.norm(vector))[0]

    def size(self, key: str):
        return self.n.one(self.fields.get(key, 0))

    def axes(self):
        """Those of a box, in the ground frame."""
        s = self.scene
        roll, pitch, yaw = [self.n.one(angle) * s.unit for angle in self.fields.get("rpy", [0, 0, 0])]
        R = (s._turn(2, yaw) @ s._turn(1, pitch) @ s._turn(0, roll))[:3, :3]
        return np.array([s.direction(self.link, R[:, k])[0] for k in range(3)]).T

    def half(self):
        return self.n.array(self.fields["size"]) / 2

    def balls(self, other: Side) -> list:
        """Centers and radii."""
        if self.kind == "points":
            return [(self.scene.point(self.link, p)[0], self.n.one(0)) for p in self.fields["points"]]
        if self.kind == "sphere":
            return [(self.place("point"), self.size("radius"))]
        if self.kind == "capsule":
            return [(self.place(key), self.size("radius")) for key in ("point", "point2")]
        if self.kind == "box":
            R, radius = self.axes(), self.size("radius")
            inner = self.half() - radius
            return [(self.place("point") + R @ (inner * self.n.array(signs)), radius) for signs in itertools.product((-1, 1), repeat=3)]
        axis, normal = self.direction("axis"), other.direction("normal")
        up = normal - axis * (normal * axis).sum()
        return [(self.place("point") - up / self.n.norm(up) * (self.size("radius") - self.size("tube")), self.size("tube"))]

    def below(self, x) -> tuple:
        """Depth of a point below the surface, and the outward normal."""
        if self.kind == "plane":
            normal = self.direction("normal")
            return -((x - self.place("point")) * normal).sum(), normal
        center = self.place("point")
        if self.kind == "box":
            R, half = self.axes(), self.half()
            p = R.T @ (x - center)
            if all(abs(p[k]) <= half[k] for k in range(3)):
                face = min(range(3), key=lambda k: half[k] - abs(p[k]))
                return half[face] - abs(p[face]), R[:, face] * (1 if p[face] >= 0 else -1)
            aside = R @ np.array([p[k] - min(max(p[k], -half[k]), half[k]) for k in range(3)])
            return -self.n.norm(aside), aside / self.n.norm(aside)
        if self.kind == "capsule":
            along = self.place("point2") - center
            part = ((x - center) * along).sum() / (along * along).sum()
            center = center + along * min(max(part, self.n.one(0)), self.n.one(1))
        away = x - center
        return self.size("radius") - self.n.norm(away), away / self.n.norm(away)

    def velocity(self, x):
        T, T1, _ = self.scene.pose(self.link)
        return T1[:3, :3] @ (T[:3, :3].T @ (x - T[:3, 3])) + T1[:3, 3]

    def spin(self):
        T, T1, _ = self.scene.pose(self.link)
        S = T1[:3, :3] @ T[:3, :3].T
        return np.array([S[2, 1], S[0, 2], S[1, 0]])


def pairs(a: Side, b: Side) -> list[tuple[Side, Side]]:
    if b.kind in TERRAIN:
        return [(a, b)]
    if a.kind in TERRAIN or (b.kind == "sphere" and a.kind != "sphere"):
        return [(b, a)]
    return [(a, b), (b, a)] if a.kind == b.kind == "box" else [(a, b)]


def onset(x, w) -> tuple:
    """h(x) and its integral."""
    if x >= w:
        return x - w / 2, (x * x - x * w) / 2 + w * w * 3 / 20
    return x**3 / w**2 - x**4 / (2 * w**3), x**4 / (4 * w**2) - x**5 / (10 * w**3)


def forces(scene, contact: dict):
    """Yields for each pressed point: link with the ball, link with the surface, place, force and moment on the first, stored energy, rounding of the force."""
    n = scene.numbers
    get = lambda key, default=0: n.one(contact.get(key, default))
    for ball_side, surface in pairs(Side(scene, contact, "a"), Side(scene, contact, "b")):
        for center, radius in ball_side.balls(surface):
            depth, normal = surface.below(center)
            x = depth + radius
            if not x > 0:
                continue
            place = center + normal * (depth - radius) / 2
            v = ball_side.velocity(place) - surface.velocity(place)
            rate = -(v * normal).sum()
            h, energy = onset(x, get("width", 1e-4))
            s = get("damping") * rate
            f = get("stiffness") * h * (s + n.sqrt(1 + s * s))
            force = f * normal
            slip = v + normal * rate
            size = n.norm(slip) / get("friction_velocity", 1e-3)
            low = get("friction")
            high = max(get("static_friction", contact.get("friction", 0)), low)
            mu = low * n.tanh(4 * size) + (high - low) * size / (size * size / 4 + n.one(0.75)) ** 2
            if size > 0:
                force = force - f * mu * slip / n.norm(slip)
            spin = ball_side.spin() - surface.spin()
            pivoting = (spin * normal).sum()
            rolling = spin - pivoting * normal
            turning, unit = n.norm(rolling), get("spin_velocity", 1)
            moment = -f * get("torsion") * n.tanh(4 * pivoting / unit) * normal
            if turning > 0:
                moment = moment - f * get("rolling") * n.tanh(4 * turning / unit) * rolling / turning
            # depths are differences of positions, slips those of velocities
            speed = n.norm(ball_side.velocity(place)) + n.norm(surface.velocity(place))
            way = n.norm(place) + scene.way(ball_side.link, surface.link)
            lost = get("stiffness") * way + f * 4 * high * speed / get("friction_velocity", 1e-3)
            yield ball_side, surface, place, force, moment, get("stiffness") * energy, 3e-5 * lost


def add(dense, scene_forces) -> None:
    """Adds all contacts to the forces and the potential energy, and keeps the resultants on link_a."""
    s = dense.scene
    dense.contacts, dense.contact_scale = {}, {}
    for contact in s.file.get("contact", []):
        a = s.index[contact["link_a"]]
        origin = s.point(a, [0, 0, 0])[0]
        total, about = s.numbers.array([0, 0, 0]), s.numbers.array([0, 0, 0])
        sizes = {"force": s.numbers.one(0), "torque": s.numbers.one(0)}
        for ball_side, surface, place, force, moment, energy, rounding in forces(s, contact):
            arm = s.numbers.norm(place) + s.numbers.norm(place - origin)
            sizes["force"] += s.numbers.norm(force) + rounding
            sizes["torque"] += (s.numbers.norm(force) + rounding) * arm + s.numbers.norm(moment)
            dense.potential += energy
            dense._push(scene_forces, ball_side.link, place, force, moment, rounding)
            dense._push(scene_forces, surface.link, place, -force, -moment, rounding)
            sign = 1 if ball_side.link == a else -1
            total = total + sign * force
            about = about + sign * (moment + cross(place - origin, force))
        dense.contacts[contact["name"]], dense.contact_scale[contact["name"]] = (total, about), sizes
