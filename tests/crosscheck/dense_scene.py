"""A scene read from its model file and moved by homogeneous transforms: what `dense_motion` needs of it.

Written from docs/model_file.md alone. Poses are truncated Taylor series in time (T, T', T'' while no joint accelerates), so
velocity products need no formula of their own. All numbers are long doubles, or mpmath's where `exact` asks for them.
"""

from __future__ import annotations

import numpy as np

try:
    import mpmath  # only for `exact`
except ImportError:
    mpmath = None

GROUND = -1
TURN, SLIDE, BALL = "turn", "slide", "ball"
# motions of a joint after its frame, as (kind, axis), in the order of docs/model_file.md
FREEDOMS = {
    "revolute": [(TURN, 2)],
    "prismatic": [(SLIDE, 2)],
    "screw": [(TURN, 2)],  # and advances along its axis by the link's pitch
    "fixed": [],
    "universal": [(TURN, 2), (TURN, 1)],
    "cylindrical": [(TURN, 2), (SLIDE, 2)],
    "planar": [(SLIDE, 0), (SLIDE, 1), (TURN, 2)],
    "spherical": [(BALL, 0)],
    "free": [(SLIDE, 0), (SLIDE, 1), (SLIDE, 2), (BALL, 0)],
}
FIELDS = {
    "q": 0,
    "qd": 0,
    "damping": 0,
    "stiffness": 0,
    "rest": 0,
    "friction": 0,
    "static_friction": None,
    "friction_velocity": 0.01,
    "lower": -np.inf,
    "upper": np.inf,
    "stop_stiffness": 0,
    "stop_damping": 0,
    "stop_width": None,
    "armature": 0,
}
ANGLES = ("q", "qd", "rest", "lower", "upper", "stop_width", "friction_velocity")


class Numbers:
    """Arrays of long doubles, or of mpmath's numbers."""

    def __init__(self, exact: bool = False) -> None:
        self.exact = exact
        self.pi = self.one(mpmath.pi) if exact else np.longdouble("3.14159265358979323846264338327950288")

    def one(self, value):
        return mpmath.mpf(value) if self.exact else np.longdouble(value)

    def array(self, values) -> np.ndarray:
        values = np.asarray(values)
        if not self.exact:
            return values.astype(np.longdouble)
        return np.vectorize(self.one, otypes=[object])(values) if values.size else values.astype(object)

    def zeros(self, *shape) -> np.ndarray:
        return self.array(np.zeros(shape))

    def eye(self, n: int) -> np.ndarray:
        return self.array(np.eye(n))

    def cos(self, x):
        return mpmath.cos(x) if self.exact else np.cos(x)

    def sin(self, x):
        return mpmath.sin(x) if self.exact else np.sin(x)

    def sqrt(self, x):
        return mpmath.sqrt(x) if self.exact else np.sqrt(x)

    def atan2(self, y, x):
        return mpmath.atan2(y, x) if self.exact else np.arctan2(y, x)

    def tanh(self, x):
        return mpmath.tanh(x) if self.exact else np.tanh(x)

    def norm(self, v):
        return self.sqrt((v * v).sum())


def cross(a, b) -> np.ndarray:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def skew(w) -> np.ndarray:
    zero = w[0] * 0
    return np.array([[zero, -w[2], w[1]], [w[2], zero, -w[0]], [-w[1], w[0], zero]])


class Dof:
    """One coordinate: its names in the FMU, where it stands, its fields, and at a state its axis and a point of it."""

    def __init__(self, kind: str, joint: str, index: int, count: int, link: int, drive: str) -> None:
        self.kind, self.link, self.drive = kind, link, drive
        ball = kind == BALL
        self.joint = joint
        self.name = f"{joint}[{index + 1}]" if count > 1 and not ball else joint
        self.part = index if ball else None  # of the angular velocity
        self.fields: dict = {}
        self.pitch = 0  # m/rad
        self.axis = self.point = None

    @property
    def turns(self) -> bool:
        return self.kind != SLIDE

    @property
    def prescribed(self) -> bool:
        return self.drive in ("motion", "locked")

    def variable(self, what: str) -> str:
        if self.part is None:
            return f"{self.name}.{what}"
        return f"{self.joint}.{ {'qd': 'omega', 'qdd': 'alpha', 'tau': 'tau'}[what] }[{self.part + 1}]"


class Link:
    def __init__(self, table: dict) -> None:
        self.table, self.name = table, table["name"]
        self.parent = GROUND
        self.joint = table.get("joint", "revolute")
        self.dofs: list[int] = []  # its own
        self.path: list[int] = []  # all that move it
        self.pose: tuple = ()


class Scene:
    """The links of a parsed model file, parents first, and their coordinates."""

    def __init__(self, file: dict, exact: bool = False) -> None:
        self.file, self.numbers = file, Numbers(exact)
        n = self.numbers
        self.unit = n.pi / 180 if file.get("angle_unit", "rad") == "deg" else n.one(1)
        self.gravity = n.array(file.get("gravity", [0, 0, -9.81]))
        self.links: list[Link] = []
        self.dofs: list[Dof] = []
        self._sort(file["link"])
        self.index = {link.name: i for i, link in enumerate(self.links)} | {"ground": GROUND}
        # polynomials in time, in the file's unit
        self.courses = {t["joint"]: t["coefficients"] for t in file.get("trajectory", [])}
        for i, link in enumerate(self.links):
            link.parent = self.index[link.parent_name]
            self._add_dofs(i, link)
            self._constants(link)

    def _sort(self, tables: list[dict]) -> None:
        before, drafts = "ground", []
        for table in tables:
            link = Link(table)
            link.parent_name = table.get("parent", before)
            before = link.name
            drafts.append(link)
        known = {"ground"}
        while drafts:
            ready = next(link for link in drafts if link.parent_name in known)
            drafts.remove(ready)
            known.add(ready.name)
            self.links.append(ready)

    def _add_dofs(self, i: int, link: Link) -> None:
        table, motions = link.table, FREEDOMS[link.joint]
        drive = table.get("drive", "torque")
        if self.file.get("inverse") and drive == "torque" and link.joint not in ("spherical", "free"):
            drive = "motion"
        name = table.get("joint_name", link.name)
        link.path = list(self.links[link.parent].path) if link.parent != GROUND else []
        for k, (kind, _) in enumerate(motions):
            for part in range(3 if kind == BALL else 1):
                dof = Dof(kind, name, part if kind == BALL else k, len(motions), i, drive)
                if kind != BALL:
                    dof.fields = self._fields(table, k, len(motions), kind)
                    dof.pitch = self.numbers.one(table.get("pitch", 0))
                link.dofs.append(len(self.dofs))
                self.dofs.append(dof)
        link.path += link.dofs

    def _fields(self, table: dict, k: int, count: int, kind: str) -> dict:
        fields = {}
        for key, default in FIELDS.items():
            value = table.get(key, default)
            if isinstance(value, list):
                value = value[k]
            if value is None:
                value = fields["friction"] if key == "static_friction" else 0.01 if kind == TURN else 0.001
                fields[key] = value if key == "static_friction" else self.numbers.one(value)
                continue
            scale = self.unit if kind == TURN and key in ANGLES and key in table else 1
            fields[key] = self.numbers.one(value) * scale
        return fields

    def _constants(self, link: Link) -> None:
        n, table = self.numbers, link.table
        get = lambda key: n.one(table.get(key, 0))
        frame = self._turn(2, get("gamma") * self.unit) @ self._shift(2, get("b"))
        frame = frame @ self._turn(0, get("alpha") * self.unit) @ self._shift(0, get("a"))
        link.frame = frame @ self._turn(2, get("theta") * self.unit) @ self._shift(2, get("d"))
        link.mass, link.com = get("mass"), n.array(table.get("com", [0, 0, 0]))
        xx, yy, zz, xy, xz, yz = [n.one(v) for v in (list(table.get("inertia", [0, 0, 0])) + [0, 0, 0])[:6]]
        link.inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])

    # --- poses ---

    def _turn(self, axis: int, angle) -> np.ndarray:
        n, T = self.numbers, self.numbers.eye(4)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        T[i, i] = T[j, j] = n.cos(angle)
        T[j, i] = n.sin(angle)
        T[i, j] = -T[j, i]
        return T

    def _shift(self, axis: int, by) -> np.ndarray:
        T = self.numbers.eye(4)
        T[axis, 3] = by
        return T

    def _motion(self, kind: str, axis: int, q, qd, pitch) -> tuple:
        """T, T', T'' of one motion at constant speed."""
        if kind == SLIDE:
            first = self.numbers.zeros(4, 4)
            first[axis, 3] = qd
            return self._shift(axis, q), first, self.numbers.zeros(4, 4)
        T = self._turn(axis, q) if kind == TURN else self.numbers.eye(4)
        spin = self.numbers.zeros(4, 4)
        if kind == TURN:
            spin[:3, :3] = skew(self.numbers.eye(3)[axis] * qd)
            T[axis, 3], spin[axis, 3] = pitch * q, pitch * qd
        else:
            T[:3, :3] = rotation(q, self.numbers)
            spin[:3, :3] = skew(qd)
        return T, T @ spin, T @ spin @ spin

    def start(self) -> dict:
        """The state that the file gives: joint variable -> number, or quaternion and angular velocity."""
        state = {}
        for link in self.links:
            name, slides = link.table.get("joint_name", link.name), 3 if link.joint == "free" else 0
            q, qd = link.table.get("q", 0), link.table.get("qd", 0)
            if link.joint not in ("spherical", "free"):
                for k in link.dofs:
                    dof = self.dofs[k]
                    state[dof.variable("q")], state[dof.variable("qd")] = dof.fields["q"], dof.fields["qd"]
                continue
            q = list(q) if q else [0] * slides + [1, 0, 0, 0]
            qd = list(qd) if qd else [0] * (slides + 3)
            for k in range(slides):
                state[f"{name}[{k + 1}].q"], state[f"{name}[{k + 1}].qd"] = q[k], qd[k]
            state[f"{name}.quaternion"] = self._quaternion(q[slides:])
            state[f"{name}.omega"] = self.numbers.array(qd[slides:]) * self.unit
        return state

    def acceleration(self, dof: Dof, inputs: dict):
        """The acceleration of a prescribed joint at the start."""
        if dof.name not in self.courses:
            return self.numbers.one(inputs.get(dof.variable("qdd"), 0))
        return self.numbers.one(self.courses[dof.name][2]) * 2 * (self.unit if dof.turns else 1)

    def _quaternion(self, given: list) -> np.ndarray:
        if len(given) == 4:
            return self.numbers.array(given)
        phi, theta, psi = [self.numbers.one(angle) * self.unit for angle in given]
        return quaternion_of((self._turn(2, phi) @ self._turn(0, theta) @ self._turn(1, psi))[:3, :3], self.numbers)

    def move(self, state: dict) -> None:
        """Sets the poses of all links and the axes of all coordinates."""
        n = self.numbers
        still = (n.eye(4), n.zeros(4, 4), n.zeros(4, 4))
        for link in self.links:
            parent = self.links[link.parent].pose if link.parent != GROUND else still
            pose = tuple(T @ link.frame for T in parent)
            k = 0
            for kind, axis in FREEDOMS[link.joint]:
                dof = self.dofs[link.dofs[k]]
                if kind == BALL:
                    q, qd = n.array(state[f"{dof.joint}.quaternion"]), n.array(state[f"{dof.joint}.omega"])
                else:
                    q, qd = n.one(state[dof.variable("q")]), n.one(state[dof.variable("qd")])
                    dof.q, dof.qd = q, qd
                    dof.axis, dof.point = pose[0][:3, axis], pose[0][:3, 3]
                pose = product(pose, self._motion(kind, axis, q, qd, dof.pitch))
                for part in range(3 if kind == BALL else 0):
                    ball = self.dofs[link.dofs[k + part]]
                    ball.qd, ball.axis, ball.point = qd[part], pose[0][:3, part], pose[0][:3, 3]
                k += 3 if kind == BALL else 1
            link.pose = pose

    def pose(self, link: int) -> tuple:
        n = self.numbers
        return self.links[link].pose if link != GROUND else (n.eye(4), n.zeros(4, 4), n.zeros(4, 4))

    def path(self, link: int) -> list[int]:
        return self.links[link].path if link != GROUND else []

    def ratios(self, coupling: dict) -> dict:
        """Coordinate to ratio of a coupling."""
        by_name = {dof.name: k for k, dof in enumerate(self.dofs) if dof.part is None}
        return {by_name[name]: self.numbers.one(ratio) for name, ratio in zip(coupling["joints"], coupling["ratios"], strict=True)}

    def way(self, a: int, b: int):
        """The lengths of all frames and slides between two links, added up."""
        length = self.numbers.one(0)
        while a != b:
            link = self.links[max(a, b)]
            slides = [self.dofs[k].q * (self.dofs[k].pitch if self.dofs[k].turns else 1) for k in link.dofs if self.dofs[k].part is None]
            length += self.numbers.norm(link.frame[:3, 3]) + sum(abs(q) for q in slides)
            a, b = (link.parent, b) if a > b else (a, link.parent)
        return length

    def point(self, link: int, position) -> list:
        """Place, velocity and acceleration of a point of a link."""
        p = np.append(self.numbers.array(position), self.numbers.one(1))
        return [(T @ p)[:3] for T in self.pose(link)]

    def axes(self, frame: dict, key: str = "rpy") -> np.ndarray:
        """The axes of a frame in those of its link, by columns."""
        roll, pitch, yaw = [self.numbers.one(angle) * self.unit for angle in frame.get(key, [0, 0, 0])]
        return (self._turn(2, yaw) @ self._turn(1, pitch) @ self._turn(0, roll))[:3, :3]

    def direction(self, link: int, vector) -> list:
        return [T[:3, :3] @ vector for T in self.pose(link)]


def product(a: tuple, b: tuple) -> tuple:
    return a[0] @ b[0], a[1] @ b[0] + a[0] @ b[1], a[2] @ b[0] + 2 * (a[1] @ b[1]) + a[0] @ b[2]


def rotation(quaternion, n: Numbers) -> np.ndarray:
    w, x, y, z = quaternion / n.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_of(R, n: Numbers) -> np.ndarray:
    """The quaternion of a rotation, from its largest part."""
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    squares = [1 + trace] + [1 + 2 * R[k, k] - trace for k in range(3)]
    k = int(np.argmax(np.array(squares, dtype=float)))
    largest = n.sqrt(squares[k]) / 2
    q = np.array([largest] * 4)
    w = [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]
    for j in range(4):
        if j == k:
            continue
        if j == 0 or k == 0:
            q[j] = w[max(j, k) - 1] / (4 * largest)
        else:
            q[j] = (R[j - 1, k - 1] + R[k - 1, j - 1]) / (4 * largest)
    return q
