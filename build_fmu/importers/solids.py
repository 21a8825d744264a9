"""Volume, center and inertia of solids: boxes, cylinders, spheres, capsules, ellipsoids and closed meshes, of density 1."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from build_fmu.draw.meshes import mesh_parts
from build_fmu.importers.obj_faces import obj_faces


@dataclass
class Solid:
    """A shape in a link frame: `size` as in [[shape]], or the half axes of an ellipsoid; `file` of a mesh.

    The size of a mesh may be a matrix of 9 numbers, by rows, which a [[shape]] cannot have.
    """

    kind: str
    size: Sequence[float]
    pose: np.ndarray = field(default_factory=lambda: np.eye(4))
    file: str = ""


@dataclass
class Body:
    """Mass (or volume), center and inertia about the center, in the axes of a link."""

    mass: float = 0.0
    com: np.ndarray = field(default_factory=lambda: np.zeros(3))
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))

    def scaled(self, factor: float) -> Body:
        """Returns the body with another density."""
        return Body(factor * self.mass, self.com, factor * self.inertia)

    def moved(self, pose: np.ndarray) -> Body:
        """Returns the body in the axes in which its own ones have this pose."""
        turn = pose[:3, :3]
        return Body(self.mass, turn @ self.com + pose[:3, 3], turn @ self.inertia @ turn.T)


def joined(bodies: Sequence[Body]) -> Body:
    """Returns one body of rigidly connected ones in the same axes."""
    mass = sum(body.mass for body in bodies)
    if not mass:
        return Body(0.0, np.zeros(3), sum((body.inertia for body in bodies), np.zeros((3, 3))))
    com = sum(body.mass * body.com for body in bodies) / mass
    inertia = sum(body.inertia + about(body.mass, body.com - com) for body in bodies)
    return Body(mass, com, inertia)


def about(mass: float, arm: np.ndarray) -> np.ndarray:
    """Returns the inertia of a point mass at `arm`."""
    return mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))


def body_of(solid: Solid, of_mesh: Callable[[str, tuple[float, ...]], Body] | None = None) -> Body:
    """Returns volume, center and inertia of a solid in its link frame; raises UserError for a mesh that cannot be read.

    `of_mesh` integrates a mesh (default: `mesh_body`).
    """
    if solid.kind == "mesh":
        scale = np.asarray(solid.size, float) if len(solid.size) else np.ones(3)
        scale = scale if len(scale) == 9 else np.broadcast_to(scale, 3)
        own = (of_mesh or mesh_body)(solid.file, tuple(map(float, scale)))
    else:
        own = _primitive(solid.kind, list(map(float, solid.size)))
    return own.moved(solid.pose)


def _primitive(kind: str, size: list[float]) -> Body:
    if kind == "box":
        x, y, z = size
        volume, square = x * y * z, [(y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12]
    elif kind == "sphere":
        volume, square = 4 / 3 * math.pi * size[0] ** 3, [0.4 * size[0] ** 2] * 3
    elif kind == "ellipsoid":
        a, b, c = size
        volume, square = 4 / 3 * math.pi * a * b * c, [(b * b + c * c) / 5, (a * a + c * c) / 5, (a * a + b * b) / 5]
    else:
        r, h = size
        volume, across = math.pi * r * r * h, r * r / 4 + h * h / 12
        square = [across, across, r * r / 2]
        if kind == "capsule":
            caps = 4 / 3 * math.pi * r**3
            # of both half spheres about the center of the capsule
            across = volume * across + caps * (0.4 * r * r + h * h / 4 + 3 / 8 * h * r)
            along = volume * square[2] + caps * 0.4 * r * r
            volume += caps
            square = [across / volume, across / volume, along / volume]
    return Body(volume, np.zeros(3), volume * np.diag(square))


@lru_cache(maxsize=512)
def mesh_body(file: str, scale: tuple[float, ...], first_object: bool = False) -> Body:
    """Returns volume, center and inertia of a mesh; of one that encloses no volume those of its bounding box.

    `first_object`: of the first object of an OBJ file only, as in MuJoCo.
    """
    corners = _corners(file, scale, first_object)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    volume, first, second = _integrals(corners, absolute=False)
    if is_open(file) or abs(volume) < 1e-9 * float((high - low).max()) ** 3:
        return _primitive("box", list(high - low)).moved(np.block([[np.eye(3), ((low + high) / 2)[:, None]], [0, 0, 0, 1]]))
    com, sign = first / volume, math.copysign(1.0, volume)
    central = sign * second - abs(volume) * np.outer(com, com)
    return Body(abs(volume), com, np.trace(central) * np.eye(3) - central)


@lru_cache(maxsize=512)
def mujoco_mesh_body(file: str, scale: tuple[float, ...]) -> Body:
    """Returns what MuJoCo computes by default (`inertia="legacy"`): all tetrahedra from a point inside count as positive."""
    corners = _corners(file, scale, first_object=True)
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    middle = areas @ corners.mean(axis=1) / areas.sum()
    volume, first, _ = _integrals(corners - middle, absolute=True)
    com = middle + first / volume
    volume, _, second = _integrals(corners - com, absolute=True)
    return Body(volume, com, np.trace(second) * np.eye(3) - second)


def _corners(file: str, scale: tuple[float, ...], first_object: bool) -> np.ndarray:
    """Returns the corners of all triangles: triangles x 3 x 3."""
    parts, faces = mesh_parts(file), obj_faces(file)
    if faces is not None:
        return scaled(faces.triangles[: faces.of_first if first_object else None], scale)
    return np.concatenate([scaled(points, scale)[triangles] for points, triangles, _ in parts])


def scaled(points: np.ndarray, scale: Sequence[float]) -> np.ndarray:
    """Returns the points of a mesh by its scale, 3 numbers or a matrix of 9."""
    return points @ np.reshape(scale, (3, 3)).T if len(scale) == 9 else points * scale


def _integrals(corners: np.ndarray, absolute: bool) -> tuple[float, np.ndarray, np.ndarray]:
    """Returns the integrals of 1, x and x x^T over the tetrahedra between the origin and the triangles."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    parts, total = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, a + b + c
    parts = np.abs(parts) if absolute else parts
    squares = np.einsum("i,ij,ik->jk", parts, total, total) + sum(np.einsum("i,ij,ik->jk", parts, x, x) for x in (a, b, c))
    return float(parts.sum()), parts @ total / 4, squares / 20


@lru_cache(maxsize=512)
def is_open(file: str) -> bool:
    """Returns whether an edge of the mesh does not join exactly two triangles in opposite senses."""
    edges: dict[tuple, int] = {}
    for points, triangles, _ in mesh_parts(file):
        _, same = np.unique(np.round(points / (float(np.ptp(points, axis=0).max()) or 1.0), 9), axis=0, return_inverse=True)
        for triangle in same.ravel()[triangles]:
            for i in range(3):
                a, b = int(triangle[i]), int(triangle[(i + 1) % 3])
                if a != b:
                    edges[min(a, b), max(a, b)] = edges.get((min(a, b), max(a, b)), 0) + (1 if a < b else -1)
        if any(edges.values()):
            return True
        edges.clear()
    return False
