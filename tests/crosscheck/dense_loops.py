"""Rows of the loops and rigid couplings of a dense scene: residual, Jacobian, what phi'' has at no acceleration, and how large each lever could be."""

from __future__ import annotations

import numpy as np

from tests.crosscheck.dense_scene import Scene, cross

ROUNDING = 1e-11  # a lever below this part of the lengths that it is the difference of is none


class Rows:
    """All rows, in the order of the file: J qdd = rhs, J qd = rate. `lever` bounds |J| entry by entry whatever cancels."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.n = scene, scene.numbers
        self.names: list[str] = []
        self.turns: list[bool] = []
        self._J, self._lever, self._phi, self._rate, self._rhs, self._terms, self._length = [], [], [], [], [], [], []
        for loop in scene.file.get("loop", []):
            self._add(loop)
        for coupling in scene.file.get("coupling", []):
            if "stiffness" not in coupling:
                self._couple(coupling)
        count, nv = len(self.names), len(scene.dofs)
        stack = lambda rows: np.array(rows) if rows else self.n.zeros(0, nv)
        self.J, self.lever = stack(self._J), stack(self._lever)
        lists = (self._phi, self._rhs, self._terms, self._length)
        self.phi, self.rhs, self.terms, self.length = (np.array(v) if count else self.n.zeros(0) for v in lists)

    def _frame(self, axis, x) -> np.ndarray:
        """Columns x, axis cross x, axis; x made perpendicular."""
        n = self.n
        z = axis / n.norm(axis)
        x = x - z * (z * x).sum()
        x = x / n.norm(x)
        return np.array([x, cross(z, x), z]).T

    def _add(self, loop: dict) -> None:
        n, s = self.n, self.scene
        a, b = s.index[loop["link_a"]], s.index[loop["link_b"]]
        points = (loop.get("point_a", [0, 0, 0]), loop.get("point_b", [0, 0, 0]))
        kind = loop["type"]
        if kind == "point":
            for k, direction in enumerate(loop["directions"]):
                d = n.array(direction)
                self._position(loop, k, a, b, points, d / n.norm(d), on_ground=True, alone=len(loop["directions"]) < 3)
            return
        axis_a, axis_b = n.array(loop.get("axis_a", [0, 0, 1])), n.array(loop.get("axis_b", [0, 0, 1]))
        frame_a = self._frame(axis_a, n.array(loop.get("x_a", [1, 0, 0])))
        frame_b = self._frame(axis_b, n.array(loop.get("x_b", [1, 0, 0])))
        slides = kind in ("prismatic", "cylindrical")
        row = 0
        for row in range(2 if slides else 3):
            self._position(loop, row, a, b, points, frame_a[:, row])
        pairs = {"spherical": [], "universal": [(2, 2)], "cylindrical": [(0, 2), (1, 2)], "revolute": [(0, 2), (1, 2)]}
        for i, j in pairs.get(kind, [(0, 2), (1, 2), (0, 1)]):
            row += 1
            self._rotation(loop, row, a, b, frame_a[:, i], frame_b[:, j])

    def _couple(self, coupling: dict) -> None:
        n = self.n
        ratios = self.scene.ratios(coupling)
        self.names.append(f"{coupling['name']}.lambda")
        self.turns.append(True)
        J = n.zeros(len(self.scene.dofs))
        for k, ratio in ratios.items():
            J[k] = ratio
        self._J.append(J)
        self._lever.append(abs(J))
        self._phi.append(sum(ratio * self.scene.dofs[k].q for k, ratio in ratios.items()) - n.one(coupling.get("offset", 0)))
        self._rhs.append(n.one(0))
        self._terms.append(n.one(0))
        self._length.append(n.one(1))

    def _start(self, loop: dict, index: int, turns: bool) -> tuple:
        self.names.append(f"{loop['name']}.lambda[{index + 1}]")
        self.turns.append(turns)
        nv = len(self.scene.dofs)
        return self.n.zeros(nv), self.n.zeros(nv)

    def _position(self, loop, index, a, b, points, u, on_ground=False, alone=False) -> None:
        n, s = self.n, self.scene
        J, lever = self._start(loop, index, False)
        zero = n.zeros(3)
        d = [u, zero, zero] if on_ground else s.direction(a, u)
        x_a, x_b = s.point(a, points[0]), s.point(b, points[1])
        r = [q - p for p, q in zip(x_a, x_b, strict=True)]
        on_a, on_b = set(s.path(a)), set(s.path(b))
        length = s.way(a, b) + n.norm(n.array(points[0])) + n.norm(n.array(points[1]))
        nothing = ROUNDING * length
        # directions of the ground measure positions from there
        self._length.append(length + (n.norm(x_a[0]) if on_ground else 0))
        for k in on_a | on_b:
            dof = s.dofs[k]
            if k in on_a and k in on_b:
                # a joint outside the loop: it carries both ends, but not a direction of the ground
                if alone and dof.turns and n.norm(r[0]) > nothing:
                    J[k], lever[k] = (d[0] * cross(dof.axis, r[0])).sum(), n.norm(r[0])
                continue
            if not dof.turns:
                moved, bound = dof.axis, n.one(1)
            else:
                arm = (x_a[0] if on_ground and k in on_a else x_b[0]) - dof.point
                moved, bound = cross(dof.axis, arm) + dof.pitch * dof.axis, n.norm(arm) + abs(dof.pitch)
                if bound <= nothing:
                    continue
            J[k] = (d[0] * moved).sum() * (1 if k in on_b else -1)
            lever[k] = bound
        self._J.append(J)
        self._lever.append(lever)
        self._phi.append((d[0] * r[0]).sum())
        self._rhs.append(-(d[0] * r[2] + 2 * d[1] * r[1] + d[2] * r[0]).sum())
        size = n.norm(d[1]) * n.norm(r[1]) * 2 + n.norm(d[2]) * n.norm(r[0])
        self._terms.append(size + n.norm(x_a[2]) + n.norm(x_b[2]))

    def _rotation(self, loop, index, a, b, u, v) -> None:
        n, s = self.n, self.scene
        J, lever = self._start(loop, index, True)
        self._length.append(n.one(1))
        u, v = s.direction(a, u), s.direction(b, v)
        normal = cross(v[0], u[0])
        on_a, on_b = set(s.path(a)), set(s.path(b))
        for k in on_a ^ on_b:
            dof = s.dofs[k]
            if dof.turns:
                J[k] = (dof.axis * normal).sum() * (1 if k in on_b else -1)
                lever[k] = n.one(1)
        self._J.append(J)
        self._lever.append(lever)
        self._phi.append((u[0] * v[0]).sum())
        self._rhs.append(-(u[2] * v[0] + 2 * u[1] * v[1] + u[0] * v[2]).sum())
        self._terms.append(n.norm(u[2]) + 2 * n.norm(u[1]) * n.norm(v[1]) + n.norm(v[2]))
