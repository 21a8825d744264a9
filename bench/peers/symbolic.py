"""Forward dynamics of a scene with a tree of hinges as expressions, for the simulators that compile equations."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scenes import Scene

ROUNDING = 1e-15


def cross(v) -> np.ndarray:
    """Returns the matrix of the cross product v x."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]], dtype=object)


def symmetric(matrix: np.ndarray) -> np.ndarray:
    """Returns the matrix with the upper triangle in both, so that no element is computed twice."""
    return np.array([[matrix[min(i, j), max(i, j)] for j in range(3)] for i in range(3)], dtype=object)


def numbers(values) -> np.ndarray:
    """Returns an array whose elements of rounding size are zeros, which expressions drop."""
    array = np.array(values, dtype=float)
    return np.where(abs(array) < ROUNDING, 0.0, array).astype(object)


class Tree:
    """Quantities of each body, in its own axes and about its own origin."""

    def __init__(self, scene: Scene, q, qd, sin: Callable, cos: Callable):
        """q, qd: n expressions each, rad and rad/s; sin, cos: functions of an expression."""
        self.scene, self.q, self.qd = scene, q, qd
        self.parents = [body["parent"] for body in scene.data["bodies"]]
        self.places = [numbers(body["joint"]["placement"]["p"]) for body in scene.data["bodies"]]
        self.turns = [self._turn(body, sin(angle), cos(angle)) for body, angle in zip(scene.data["bodies"], q, strict=True)]
        self._inertia()

    def _turn(self, body: dict, s, c) -> np.ndarray:
        """Rotation from the body's axes to its parent's."""
        return numbers(body["joint"]["placement"]["R"]) @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]], dtype=object)

    def _inertia(self) -> None:
        self.masses, self.moments, self.inertias = [], [], []
        for body in self.scene.data["bodies"]:
            com, (xx, yy, zz, xy, xz, yz) = numbers(body["com"]), body["inertia"]
            central = numbers([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            self.masses.append(body["mass"])
            self.moments.append(body["mass"] * com)
            self.inertias.append(central - body["mass"] * cross(com) @ cross(com))

    def ancestors(self, body: int) -> list[int]:
        found = []
        while (body := self.parents[body]) >= 0:
            found.append(body)
        return found

    def bias(self) -> list:
        """Torques at zero accelerations by the Newton-Euler recursion (Luh, Walker, Paul 1980)."""
        zero = np.zeros(3).astype(object)
        ground = (zero, zero, -numbers(self.scene.data["gravity"]), cross(zero))
        states, wrenches = [], []
        for i, (parent, place, turn) in enumerate(zip(self.parents, self.places, self.turns, strict=True)):
            omega, alpha, acceleration, spread = states[parent] if parent >= 0 else ground
            carried, rate = turn.T @ omega, np.array([0.0, 0.0, self.qd[i]], dtype=object)
            acceleration = turn.T @ (acceleration + spread @ place)
            alpha, omega = turn.T @ alpha + cross(carried) @ rate, carried + rate
            spread = cross(alpha) + cross(omega) @ cross(omega)
            states.append((omega, alpha, acceleration, spread))
            force = self.masses[i] * acceleration + spread @ self.moments[i]
            spin = self.inertias[i] @ omega
            wrenches.append([force, cross(self.moments[i]) @ acceleration + self.inertias[i] @ alpha + cross(omega) @ spin])
        for i in reversed(range(len(wrenches))):
            if self.parents[i] >= 0:
                force, moment = self._carried(i, *wrenches[i])
                wrenches[self.parents[i]][0] = wrenches[self.parents[i]][0] + force
                wrenches[self.parents[i]][1] = wrenches[self.parents[i]][1] + moment
        return [moment[2] for _, moment in wrenches]

    def _carried(self, body: int, force, moment):
        """A force and a moment in the parent's axes about its origin."""
        force = self.turns[body] @ force
        return force, self.turns[body] @ moment + cross(self.places[body]) @ force

    def mass_matrix(self) -> dict:
        """Elements {(i, ancestor or i)} by the composite-body recursion (Walker, Orin 1982)."""
        masses, moments, inertias = list(self.masses), list(self.moments), list(self.inertias)
        elements = {}
        for i in reversed(range(len(masses))):
            force, moment = np.array([-moments[i][1], moments[i][0], 0.0], dtype=object), inertias[i][:, 2]
            elements[i, i], below = moment[2], i
            for ancestor in self.ancestors(i):
                force, moment = self._carried(below, force, moment)
                elements[i, ancestor], below = moment[2], ancestor
            if (parent := self.parents[i]) < 0:
                continue
            shift, turned = cross(self.places[i]), self.turns[i] @ moments[i]
            mixed = shift @ cross(turned)
            moved = self.turns[i] @ inertias[i] @ self.turns[i].T - mixed - mixed.T - masses[i] * shift @ shift
            inertias[parent] = symmetric(inertias[parent] + moved)
            moments[parent] = moments[parent] + turned + masses[i] * self.places[i]
            masses[parent] += masses[i]
        return elements

    def accelerations(self) -> list:
        """Solves M qdd = tau - bias by L'D L with the sparsity of the tree (Featherstone 2005)."""
        x = [self._torque(i) - torque for i, torque in enumerate(self.bias())]
        m = self.mass_matrix()
        for k in reversed(range(len(x))):
            for i in self.ancestors(k):
                share = m[k, i] / m[k, k]
                for j in (i, *self.ancestors(i)):
                    m[i, j] = m[i, j] - share * m[k, j]
                x[i] = x[i] - share * x[k]
                m[k, i, "share"] = share
        for k in range(len(x)):
            x[k] = x[k] / m[k, k]
            for i in self.ancestors(k):
                x[k] = x[k] - m[k, i, "share"] * x[i]
        return x

    def _torque(self, i: int):
        joint = self.scene.data["bodies"][i]["joint"]
        stiffness, damping, rest = (joint.get(key, 0.0) for key in ("stiffness", "damping", "rest"))
        return self.scene.torques[i] - stiffness * (self.q[i] - rest) - damping * self.qd[i]
