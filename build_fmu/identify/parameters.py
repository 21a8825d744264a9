"""The parameters that enter the torques linearly, their columns of the regressor, and their conversion to numbers of the model file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from build_fmu.arguments import numbers
from build_fmu.errors import UserError, unknown
from build_fmu.run.simulate import matches

INERTIAL = ("m", "mx", "my", "mz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")  # about the origin, the order of docs/equations.md
LOSSES = ("damping", "friction", "armature")
PLACES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))  # of the six entries of an inertia


@dataclass(frozen=True)
class Plant:
    """A model with prescribed motion of its `joints`.

    `values` are the numbers of the model file by the name of their FMI parameter. `evaluate(q, qd, qdd)` takes rows of n joints and
    returns the torques (rows x n) and the regressor of the links (rows x n x 10 links).
    """

    joints: Sequence[str]
    torques: Sequence[str]  # names of the measured outputs
    links: Sequence[str]
    losses: Sequence[str]  # parameters of joints
    values: Mapping[str, float]
    sliding: np.ndarray  # mask of the joints with positions in m
    size: float  # m, the largest length of the model
    gravity: float  # m/s2
    evaluate: Callable[[np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]

    @property
    def names(self) -> list[str]:
        """Names of all parameters `pi`: ten per link, then those of the joints."""
        return [f"{link}.{letters}" for link in self.links for letters in INERTIAL] + list(self.losses)

    def start(self) -> np.ndarray:
        """Returns `pi` of the model file."""
        inertial = [inertial_vector(*self.body(link)) for link in self.links]
        return np.concatenate([*inertial, [self.values[name] for name in self.losses]])

    def body(self, link: str) -> tuple[float, np.ndarray, np.ndarray]:
        """Returns mass, center of mass, and inertia about it (3 x 3)."""
        com = np.array([self.values[f"{link}.com[{k}]"] for k in (1, 2, 3)])
        return self.values[f"{link}.mass"], com, symmetric([self.values[f"{link}.inertia[{k}]"] for k in range(1, 7)])

    def equations(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the torques of the model file (rows x n), and W (rows x n x parameters): their derivatives by `pi`."""
        q, qd, qdd = (np.atleast_2d(numbers(values, "q, qd and qdd")) for values in (q, qd, qdd))
        if not q.shape == qd.shape == qdd.shape == (len(q), len(self.joints)):
            raise UserError(f"q, qd and qdd must have the shape (rows, {len(self.joints)}), got {q.shape}, {qd.shape} and {qdd.shape}")
        torques, inertial = self.evaluate(q, qd, qdd)
        losses = np.zeros((*torques.shape, len(self.losses)))
        for k, name in enumerate(self.losses):
            joint, _, what = name.rpartition(".")
            j = self.joints.index(joint)
            if what == "friction":
                losses[:, j, k] = np.tanh(4 * qd[:, j] / self.values[f"{joint}.friction_velocity"])
            else:
                losses[:, j, k] = (qd if what == "damping" else qdd)[:, j]
        return torques, np.concatenate([inertial, losses], axis=2)

    def owners(self) -> list[str]:
        """Returns the link or the parameter of a joint that each parameter belongs to."""
        return [*(link for link in self.links for _ in INERTIAL), *self.losses]

    def chosen(self, patterns: Sequence[str]) -> np.ndarray:
        """Returns which parameters (mask) belong to the links and parameters of joints that match, with * as wildcard; default: all."""
        known, found = [*self.links, *self.losses], set()
        for pattern in patterns:
            if not (names := matches(pattern, known)):
                raise unknown("link or parameter of a joint", pattern, known)
            found.update(names)
        return np.array([not patterns or name in found for name in self.owners()])


def symmetric(six: Sequence[float]) -> np.ndarray:
    """Returns the matrix of xx, yy, zz, xy, xz, yz."""
    matrix = np.zeros((3, 3))
    for (i, j), value in zip(PLACES, six, strict=True):
        matrix[i, j] = matrix[j, i] = value
    return matrix


def inertial_vector(mass: float, com: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Returns the ten parameters, about the origin."""
    origin = inertia + mass * (com @ com * np.eye(3) - np.outer(com, com))
    return np.array([mass, *(mass * com), *(origin[i, j] for i, j in PLACES)])


def body_of(vector: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Returns mass, center of mass, and inertia about it, of a body with mass."""
    mass, com = vector[0], vector[1:4] / vector[0]
    return mass, com, symmetric(vector[4:]) - mass * (com @ com * np.eye(3) - np.outer(com, com))


def pseudo_inertia(vector: np.ndarray) -> np.ndarray:
    """Returns the matrix of second moments (4 x 4), positive definite for every body of positive density."""
    origin = symmetric(vector[4:])
    second = np.trace(origin) / 2 * np.eye(3) - origin
    return np.block([[second, vector[1:4, None]], [vector[None, 1:4], vector[:1, None]]])


def vector_of(pseudo: np.ndarray) -> np.ndarray:
    """Returns the ten parameters of a matrix of second moments."""
    second = pseudo[:3, :3]
    origin = np.trace(second) * np.eye(3) - second
    return np.array([pseudo[3, 3], *pseudo[:3, 3], *(origin[i, j] for i, j in PLACES)])
