"""Accelerations, drive forces and multipliers of a scene by one dense system: Gauss's principle in the mass metric.

    minimise (qdd - qdd_free)^T M (qdd - qdd_free) / 2   subject to   J qdd = rhs

M and the forces are sums over bodies of Jacobians, the rank of J is that of its levers, rows and columns scaled to one size. Every
result comes with a scale: the sum of the magnitudes of what it is made of.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tests.crosscheck import dense_contact
from tests.crosscheck.dense_loops import Rows
from tests.crosscheck.dense_scene import GROUND, Scene, cross, quaternion_of, skew

# share with which accelerations that other forces cancel count: 1e-10 of it is 1e-14, or 1e-16 over the smallest singular
# value of the levers
CANCELLED, CONDITION = 1e-4, 1e-6
SINGULAR = 1e-9  # singular values of the scaled levers below this are rounding


@dataclass
class Forces:
    """Generalised forces and the sum of the magnitudes of their parts."""

    value: np.ndarray
    size: np.ndarray

    def add(self, path: list[int], columns: np.ndarray, vector, norm, sizes: np.ndarray) -> None:
        self.value[path] += vector @ columns
        self.size[path] += sizes * norm


@dataclass
class Motion:
    qdd: np.ndarray
    scale: np.ndarray  # of qdd
    response: np.ndarray  # size of qdd for each generalized force that others cancel
    force: np.ndarray  # M qdd - (all known forces): what drives and loops have to give
    force_scale: np.ndarray
    rows: Rows
    multipliers: np.ndarray
    multiplier_scale: np.ndarray
    unique: np.ndarray  # rows whose multiplier is
    rank: int
    surplus: int  # rows that are dependent only because motions are prescribed
    gap: tuple[float, float]  # smallest singular value that counts, largest that does not
    pivot: float  # smallest of the scaled mass matrix
    kinetic: float = 0.0
    potential: float = 0.0
    energy_scale: float = 0.0
    row_size: np.ndarray = field(default_factory=lambda: np.zeros(0))


class Dense:
    """One scene: `Dense(file).solve(state, inputs)`."""

    def __init__(self, file: dict, exact: bool = False) -> None:
        self.scene = Scene(file, exact)
        self.n = self.scene.numbers

    # --- forces ---

    def _jacobian(self, link: int, x) -> tuple:
        """Columns of the velocity of point x and of the angular velocity, and the norms of the former."""
        s = self.scene
        path = s.path(link)
        linear, angular = self.n.zeros(3, len(path)), self.n.zeros(3, len(path))
        for c, k in enumerate(path):
            dof = s.dofs[k]
            linear[:, c] = cross(dof.axis, x - dof.point) + dof.pitch * dof.axis if dof.turns else dof.axis
            if dof.turns:
                angular[:, c] = dof.axis
        sizes = np.array([self.n.norm(linear[:, c]) for c in range(len(path))])
        turns = np.array([self.n.one(1 if s.dofs[k].turns else 0) for k in path])
        return path, linear, angular, sizes, turns

    def _bodies(self, forces: Forces) -> np.ndarray:
        """M; adds gravity and velocity products to the forces, sets the energies."""
        s, n = self.scene, self.n
        M = n.zeros(len(s.dofs), len(s.dofs))
        self.kinetic = self.potential = self.energy_scale = n.one(0)
        for i, link in enumerate(s.links):
            x, v, a = s.point(i, link.com)
            if link.mass == 0 and not (link.inertia != 0).any():
                continue
            R, R1, R2 = [T[:3, :3] for T in link.pose]
            spin, turned = R1 @ R.T, R2 @ R.T + R1 @ R1.T
            omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
            alpha = np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]) / 2
            inertia = R @ link.inertia @ R.T
            spun = cross(omega, inertia @ omega)
            self.kinetic += (link.mass * (v * v).sum() + (omega * (inertia @ omega)).sum()) / 2
            self.potential -= link.mass * (s.gravity * x).sum()
            self.energy_scale += link.mass * n.norm(s.gravity) * n.norm(x)
            path, linear, angular, sizes, turns = self._jacobian(i, x)
            if not path:
                continue
            M[np.ix_(path, path)] += link.mass * (linear.T @ linear) + angular.T @ inertia @ angular
            forces.add(path, linear, link.mass * (s.gravity - a), link.mass * (n.norm(s.gravity) + n.norm(a)), sizes)
            size = n.norm(inertia @ alpha) + n.norm(spun)
            forces.add(path, angular, -(inertia @ alpha + spun), size, turns)
        return M

    def _joints(self, forces: Forces, M: np.ndarray, inputs: dict) -> None:
        n = self.n
        for k, dof in enumerate(self.scene.dofs):
            parts = []
            if not dof.prescribed:
                parts.append(n.one(inputs.get(dof.variable("tau"), 0)))
            if dof.fields:
                f = dof.fields
                M[k, k] += f["armature"]
                self.kinetic += f["armature"] * dof.qd**2 / 2
                self.potential += f["stiffness"] * (dof.q - f["rest"]) ** 2 / 2
                parts += [-f["stiffness"] * (dof.q - f["rest"]), -f["damping"] * dof.qd, -self._friction(dof), self._stop(dof)]
            forces.value[k] += sum(parts)
            forces.size[k] += sum(abs(part) for part in parts)

    def _friction(self, dof):
        f, n = dof.fields, self.n
        s = dof.qd / f["friction_velocity"]
        return f["friction"] * n.tanh(4 * s) + (f["static_friction"] - f["friction"]) * s / (s * s / 4 + n.one(0.75)) ** 2

    def _stop(self, dof):
        """The force of the stop that is pressed; adds its energy."""
        f, n = dof.fields, self.n
        over, under = dof.q - f["upper"], f["lower"] - dof.q
        if not (over > 0 or under > 0):
            return n.one(0)
        side, x = (1, over) if over > 0 else (-1, under)
        w, k = f["stop_width"], f["stop_stiffness"]
        h = lambda x: x**3 / w**2 - x**4 / (2 * w**3)
        energy = lambda x: x**4 / (4 * w**2) - x**5 / (10 * w**3)
        depth = h(x) if x < w else x - w / 2
        self.potential += k * (energy(x) if x < w else energy(w) + (x * x - w * w) / 2 - w / 2 * (x - w))
        s = f["stop_damping"] * side * dof.qd
        return -side * k * depth * (s + n.sqrt(1 + s * s))

    def _couplings(self, forces: Forces) -> None:
        """Elastic couplings; adds their energy."""
        s, n = self.scene, self.n
        for coupling in s.file.get("coupling", []):
            if "stiffness" not in coupling:
                continue
            ratios = s.ratios(coupling)
            y = sum(ratio * s.dofs[k].q for k, ratio in ratios.items()) - n.one(coupling.get("offset", 0))
            rate = sum(ratio * s.dofs[k].qd for k, ratio in ratios.items())
            stiffness, damping, play = (n.one(coupling.get(key, 0)) for key in ("stiffness", "damping", "backlash"))
            if play:
                w, x = n.one(coupling.get("width", 0.1 * coupling["backlash"])), abs(y) - play / 2
                u = min(max(x / w, n.one(0)), n.one(1))
                beyond = max(x - w, n.one(0))
                force = stiffness * (w * (u**3 - u**4 / 2) + beyond) * (1 if y > 0 else -1) + damping * (3 * u * u - 2 * u**3) * rate
                self.potential += stiffness * (w * w * (u**4 / 4 - u**5 / 10) + beyond * w / 2 + beyond * beyond / 2)
            else:
                force = stiffness * y + damping * rate
                self.potential += stiffness * y * y / 2
            for k, ratio in ratios.items():
                forces.value[k] -= ratio * force
                forces.size[k] += abs(ratio * force)
            size = stiffness * sum(abs(ratio * s.dofs[k].q) for k, ratio in ratios.items()) + abs(force)
            self.coupling_forces[coupling["name"]] = (force, size)

    def _push(self, forces: Forces, link: int, x, force, moment=None, rounding=0) -> None:
        if link == GROUND:
            return
        path, linear, angular, sizes, turns = self._jacobian(link, x)
        if not path:
            return
        forces.add(path, linear, force, self.n.norm(force) + rounding, sizes)
        if moment is not None:
            forces.add(path, angular, moment, self.n.norm(moment), turns)

    def _springs(self, forces: Forces) -> None:
        s, n = self.scene, self.n
        for spring in s.file.get("spring", []):
            a, b = s.index[spring["link_a"]], s.index[spring["link_b"]]
            x_a, x_b = s.point(a, spring.get("point_a", [0, 0, 0])), s.point(b, spring.get("point_b", [0, 0, 0]))
            line = x_b[0] - x_a[0]
            length = n.norm(line)
            u = line / length
            stretch = length - n.one(spring.get("rest_length", 0))
            k, c = n.one(spring.get("stiffness", 0)), n.one(spring.get("damping", 0))
            tension = k * stretch + c * (u * (x_b[1] - x_a[1])).sum()
            self.potential += k * stretch * stretch / 2
            self._push(forces, a, x_a[0], u * tension)
            self._push(forces, b, x_b[0], -u * tension)

    def _bushings(self, forces: Forces) -> None:
        """V = (d K d + phi K phi) / 2; the moment is the solution of J_l^T moment = K phi, omega = J_l phi'."""
        s, n = self.scene, self.n
        for table in s.file.get("bushing", []):
            a, b = s.index[table["link_a"]], s.index[table["link_b"]]
            (x_a, v_a, _), (x_b, v_b, _) = (s.point(link, table.get(f"point_{k}", [0, 0, 0])) for link, k in ((a, "a"), (b, "b")))
            A, B = (s.pose(link)[0][:3, :3] @ s.axes(table, f"rpy_{k}") for link, k in ((a, "a"), (b, "b")))
            spins = [s.pose(link)[1][:3, :3] @ s.pose(link)[0][:3, :3].T for link in (a, b)]
            omega_a, omega_b = (np.array([spin[2, 1], spin[0, 2], spin[1, 0]]) for spin in spins)
            K, C = (n.array(table.get(key, [0] * 6)) for key in ("stiffness", "damping"))
            line = x_b - x_a
            d, rate = A.T @ line, A.T @ (v_b - v_a - cross(omega_a, line))
            q = quaternion_of(A.T @ B, n)
            q = q if q[0] > 0 else -q
            size = n.norm(q[1:])
            angle = 2 * n.atan2(size, q[0])
            phi = q[1:] * (angle / size)
            P = skew(phi)
            J = n.eye(3) + P * ((1 - n.cos(angle)) / angle**2) + P @ P * ((angle - n.sin(angle)) / angle**3)
            rows = [cross(J[:, 1], J[:, 2]), cross(J[:, 2], J[:, 0]), cross(J[:, 0], J[:, 1])]  # inverse, times det J
            moment = sum(row * k for row, k in zip(rows, K[3:] * phi, strict=True)) / (rows[0] @ J[:, 0])
            pull = A @ (K[:3] * d + C[:3] * rate)
            twist = A @ (moment + C[3:] * (A.T @ (omega_b - omega_a)))
            self.potential += ((K[:3] * d * d).sum() + (K[3:] * phi * phi).sum()) / 2
            self._push(forces, a, x_b, pull, twist)
            self._push(forces, b, x_b, -pull, -twist)

    def _ports(self, forces: Forces, inputs: dict) -> None:
        s, n = self.scene, self.n
        for frame in s.file.get("frame", []):
            port = frame.get("port", "none")
            if port == "none":
                continue
            link = s.index[frame["link"]]
            force, moment = (n.array([inputs.get(f"{frame['name']}.{what}[{k}]", 0) for k in (1, 2, 3)]) for what in ("force", "torque"))
            if port == "frame":
                force, moment = (s.direction(link, s.axes(frame) @ vector)[0] for vector in (force, moment))
            self._push(forces, link, s.point(link, frame.get("position", [0, 0, 0]))[0], force, moment)

    # --- the solution ---

    def solve(self, state: dict, inputs: dict) -> Motion:
        s, n = self.scene, self.n
        s.move(state)
        nv = len(s.dofs)
        forces = Forces(n.zeros(nv), n.zeros(nv))
        M = self._bodies(forces)
        self._joints(forces, M, inputs)
        self._springs(forces)
        self._bushings(forces)
        self.coupling_forces: dict = {}
        self._couplings(forces)
        dense_contact.add(self, forces)
        self._ports(forces, inputs)
        rows = Rows(s)
        motion = constrained(
            M,
            forces,
            rows,
            [k for k in range(nv) if not s.dofs[k].prescribed],
            [s.acceleration(dof, inputs) if dof.prescribed else n.one(0) for dof in s.dofs],
            n,
        )
        motion.kinetic, motion.potential = float(self.kinetic), float(self.potential)
        motion.energy_scale = float(self.energy_scale + self.kinetic + abs(self.potential))
        self.M, self.forces, self.rows = M, forces, rows
        return motion


def scaled_levers(J: np.ndarray, lever: np.ndarray) -> tuple:
    """J with rows and columns scaled so that the longest lever of each is near 1, and the scale of the rows."""
    E, J = np.abs(lever.astype(float)), J.astype(float)
    rows, columns = np.ones(E.shape[0]), np.ones(E.shape[1])
    for _ in range(8):
        top = np.sqrt((E * rows[:, None] * columns).max(axis=1, initial=0))
        rows = np.where(top > 0, rows / np.where(top > 0, top, 1), 0)
        top = np.sqrt((E * rows[:, None] * columns).max(axis=0, initial=0))
        columns = np.where(top > 0, columns / np.where(top > 0, top, 1), 0)
    return J * rows[:, None] * columns, rows


def independent(A: np.ndarray) -> tuple:
    """Independent rows of A, the coefficients of the others, and the singular values on both sides of the rank decision."""
    if A.size == 0 or not A.any():
        return [], np.zeros((A.shape[0], 0)), (np.inf, 0.0)
    values = np.linalg.svd(A, compute_uv=False)
    rank = int((values > SINGULAR).sum())
    border = (float(values[rank - 1]) if rank else np.inf, float(values[rank]) if rank < len(values) else 0.0)
    left, chosen = A.copy(), []
    for _ in range(rank):
        sizes = (left**2).sum(axis=1)
        sizes[chosen] = -1
        row = int(np.argmax(sizes))
        chosen.append(row)
        q = left[row] / np.sqrt((left[row] ** 2).sum())
        for _ in range(2):
            left = left - np.outer(left @ q, q)
    chosen.sort()
    follows = np.linalg.lstsq(A[chosen].T, A.T, rcond=None)[0].T if chosen else np.zeros((A.shape[0], 0))
    return chosen, follows, border


def cholesky(M: np.ndarray, n) -> tuple:
    L, smallest = M.copy(), float("inf")
    for k in range(len(L)):
        smallest = min(smallest, float(L[k, k]))
        if not L[k, k] > 0:
            raise ArithmeticError("the mass matrix is singular")
        L[k:, k] = L[k:, k] / n.sqrt(L[k, k])
        L[k, k + 1 :] = n.one(0)
        L[k + 1 :, k + 1 :] -= np.outer(L[k + 1 :, k], L[k + 1 :, k])
    return L, smallest


def lower_solve(L: np.ndarray, b: np.ndarray) -> np.ndarray:
    x = b.copy()
    for k in range(len(L)):
        x[k] = x[k] / L[k, k]
        x[k + 1 :] -= np.multiply.outer(L[k + 1 :, k], x[k])
    return x


def upper_solve(U: np.ndarray, b: np.ndarray) -> np.ndarray:
    return lower_solve(U[::-1, ::-1], b[::-1])[::-1]


def orthonormal(W: np.ndarray, n) -> tuple:
    """W = Q R by Gram and Schmidt, each column twice."""
    Q, R = W.copy(), n.zeros(W.shape[1], W.shape[1])
    for k in range(W.shape[1]):
        for _ in range(2):
            along = Q[:, :k].T @ Q[:, k]
            R[:k, k] = R[:k, k] + along
            Q[:, k] = Q[:, k] - Q[:, :k] @ along
        R[k, k] = n.norm(Q[:, k])
        Q[:, k] = Q[:, k] / R[k, k]
    return Q, R


def constrained(M, forces: Forces, rows: Rows, free: list[int], prescribed, n) -> Motion:
    nv = len(M)
    qdd = np.array(prescribed)
    A, row_size = scaled_levers(rows.J[:, free], rows.lever[:, free])
    chosen, follows, border = independent(A)
    whole, _ = scaled_levers(rows.J, rows.lever)
    surplus = len(independent(whole)[0]) - len(chosen)
    d = np.array([1 / n.sqrt(M[k, k]) if M[k, k] > 0 else n.one(1) for k in free]) if free else n.zeros(0)
    L, pivot = cholesky(M[np.ix_(free, free)] * d[:, None] * d, n) if free else (n.zeros(0, 0), 1.0)
    J = rows.J[np.ix_(chosen, free)] if chosen and free else n.zeros(0, len(free))
    Q, R = orthonormal(lower_solve(L, (J * d).T), n)
    force = forces.value[free] - M[free] @ qdd
    size = forces.size[free] + abs(M[free]) @ abs(qdd)
    rhs = rows.rhs[chosen] - rows.J[chosen] @ qdd if chosen else n.zeros(0)
    terms = rows.terms[chosen] + abs(rows.J[chosen]) @ abs(qdd) if chosen else n.zeros(0)
    y = lower_solve(L, d * force)
    z = lower_solve(R.T, rhs)
    along = Q.T @ y
    qdd[free] = d * upper_solve(L.T, y - Q @ along + Q @ z)
    # how strongly each force and each term of phi'' reaches each acceleration and multiplier
    G = upper_solve(L.T, n.eye(len(free))) * d[:, None]
    K, C = abs(G @ (n.eye(len(free)) - Q @ Q.T) @ G.T), abs(upper_solve(R, Q.T @ G.T))
    scale = n.zeros(nv)
    multipliers, multiplier_scale = n.zeros(len(rows.J)), n.zeros(len(rows.J))
    multipliers[chosen] = upper_solve(R, z - along)
    others = [k for k in range(len(rows.J)) if k not in chosen]
    unique = np.zeros(len(rows.J), dtype=bool)
    if chosen:
        unique[chosen] = (np.abs(follows[others]) < 1e-12).all(axis=0) if others else True
    force_scale = forces.size + abs(M) @ abs(qdd) + abs(rows.J.T) @ abs(multipliers)
    reached = abs(G.T) @ force_scale[free]
    cancelled = abs(G) @ (reached + abs(Q) @ (abs(Q.T) @ reached))
    share = max(CANCELLED, CONDITION / border[0])
    inverse = upper_solve(R, n.eye(len(chosen)))
    multiplier_scale[chosen] = C @ size + abs(inverse @ inverse.T) @ terms + share * (abs(inverse) @ (abs(Q.T) @ reached))
    scale[free] = K @ size + C.T @ terms + size * d * d + share * cancelled
    response = n.zeros(nv, nv)
    response[np.ix_(free, free)] = share * abs(G @ G.T)
    return Motion(
        qdd,
        scale,
        response,
        M @ qdd - forces.value,
        force_scale,
        rows,
        multipliers,
        multiplier_scale,
        unique,
        len(chosen),
        surplus,
        border,
        pivot,
        row_size=row_size,
    )
