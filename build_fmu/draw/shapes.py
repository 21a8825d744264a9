"""The [[shape]] tables of a model file as triangles in link frames, for pages, pictures and films."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError
from build_fmu.model.describe import Description

SIDES = 20  # of a round body
MOST_TRIANGLES = 8000  # of all meshes of a model
FEWEST_TRIANGLES, MOST_OF_ONE = 60, 1500  # of one mesh


@dataclass(frozen=True)
class Solid:
    """Triangles of one colour, fixed to a link (-1: ground): corners in its frame (m), indices of three corners each."""

    link: int
    points: np.ndarray
    triangles: np.ndarray
    colour: str | None  # "#rrggbb"; None: that of the link


def with_solids(model: Description) -> tuple[Description, list[str]]:
    """Returns the model with its solids in the drawing table, and a warning if meshes cannot be drawn."""
    shapes = model.drawing.get("shapes", [])
    if not shapes:
        return model, []
    meshes = sum(shape["kind"] == "mesh" for shape in shapes)
    most = int(np.clip(MOST_TRIANGLES / max(meshes, 1), FEWEST_TRIANGLES, MOST_OF_ONE))
    solids, failures = [], []
    for shape in shapes:
        try:
            solids += _solids(model, shape, most)
        except UserError as error:
            failures.append(str(error))
    more = f" ({len(failures) - 1} more)" if len(failures) > 1 else ""
    warnings = [f"warning: {failures[0]}; not drawn{more}"] if failures else []
    return replace(model, drawing={**model.drawing, "solids": solids}), warnings


def _solids(model: Description, shape: dict, most: int) -> list[Solid]:
    size = shape["size"]
    if shape["kind"] == "mesh":
        parts = _mesh(str(Path(model.folder or ".") / shape["file"]), most)
        parts = [(points * size, triangles if np.prod(size) > 0 else triangles[:, ::-1], colour) for points, triangles, colour in parts]
    else:
        parts = [(*(block(size) if shape["kind"] == "box" else revolved(shape["kind"], size, SIDES)), None)]
    given = "#" + "".join(f"{round(255 * part):02x}" for part in shape["color"][:3]) if "color" in shape else None
    # from the frame of the shape to that of the link, both at the start
    turn, place = np.eye(3), np.zeros(3)
    if shape["link"] >= 0:
        link = model.drawing["links"][shape["link"]]
        turn, place = np.array(link["rotation"], float), np.array(link["origin"], float)
    own = turn.T @ np.array(shape["rotation"], float)
    at = turn.T @ (np.array(shape["origin"], float) - place)
    return [Solid(shape["link"], points @ own.T + at, triangles, given or colour) for points, triangles, colour in parts]


def block(size: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Returns corners and triangles of a box."""
    points = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return points, np.array([triangle for a, b, c, d in quads for triangle in ((a, b, c), (a, c, d))])


def _profile(kind: str, size: list[float]) -> list[tuple[float, float]]:
    """Returns radius and height along the outline of a body of revolution about z, from bottom to top."""
    radius, half = size[0], (size[1] / 2 if len(size) > 1 else 0.0)
    if kind == "cylinder":
        return [(0, -half), (radius, -half), (radius, half), (0, half)]
    quarter = [(radius * np.cos(t), radius * np.sin(t)) for t in np.linspace(0, np.pi / 2, 6)]
    return [(r, -z - half) for r, z in reversed(quarter)] + [(r, z + half) for r, z in quarter]


def revolved(kind: str, size: list[float], sides: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns corners and triangles of a cylinder, sphere or capsule about z."""
    profile, turns = _profile(kind, size), 2 * np.pi * np.arange(sides) / sides
    points = np.array([(r * np.cos(t), r * np.sin(t), z) for r, z in profile for t in turns])
    i, j = (part.ravel() for part in np.meshgrid(np.arange(len(profile) - 1), np.arange(sides), indexing="ij"))
    below, beside = i * sides + j, i * sides + (j + 1) % sides
    triangles = np.concatenate([np.stack([below, beside, beside + sides], 1), np.stack([below, beside + sides, below + sides], 1)])
    return points, _with_area(points, triangles)


@lru_cache(maxsize=256)
def _mesh(file: str, most: int) -> list[tuple[np.ndarray, np.ndarray, str | None]]:
    """Returns the parts of a mesh file with at most `most` triangles."""
    parts = mesh_parts(file)
    total = sum(len(triangles) for _, triangles, _ in parts)
    return [(*_coarse(points, triangles, max(12, most * len(triangles) // total)), colour) for points, triangles, colour in parts]


def mesh_parts(file: str) -> list[tuple[np.ndarray, np.ndarray, str | None]]:
    """Returns points (m), triangles and colour of each part of a mesh file; raises UserError."""
    if not Path(file).is_file():
        raise UserError(f"mesh file '{file}' does not exist")
    try:
        import trimesh
    except ImportError:
        raise UserError(f"mesh '{file}' requires the package trimesh: pip install 'build-fmu[mesh]'") from None
    try:
        scene = trimesh.load_scene(file)
        parts = [part for part in scene.dump() if len(getattr(part, "faces", ()))]
    except Exception as error:  # the readers of trimesh raise exceptions of any kind
        why = (str(error) or type(error).__name__).splitlines()[0]
        raise UserError(f"mesh file '{file}' cannot be read: {why}") from None
    if not parts:
        raise UserError(f"mesh file '{file}' contains no triangles")
    scale = _metres(str(scene.metadata.get("units") or scene.units or ""))
    return [(np.asarray(part.vertices) * scale, np.asarray(part.faces), _colour(part)) for part in parts]


def _metres(units: str) -> float:
    """Returns the length unit of a COLLADA file, "0.001 * meters"; 1 for other files, whose unit is that of the shape."""
    number, _, what = units.partition(" * ")
    return float(number) if what == "meters" else 1.0


def _colour(part) -> str | None:
    try:
        visual = part.visual
        rgb = visual.material.main_color if visual.kind == "texture" else visual.main_color if visual.defined else None
    except AttributeError:
        rgb = None
    return None if rgb is None else "#" + "".join(f"{int(x):02x}" for x in rgb[:3])


def _coarse(points: np.ndarray, triangles: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """Merges the corners in each cell of a grid, as coarse as necessary for at most `most` triangles."""
    low, extent = points.min(axis=0), float(np.ptp(points, axis=0).max()) or 1.0
    cells = 256
    while True:
        _, first, cell = np.unique(np.floor((points - low) / extent * cells).astype(int), axis=0, return_index=True, return_inverse=True)
        cell = cell.ravel()
        merged = np.stack([np.bincount(cell, points[:, k]) for k in range(3)], 1) / np.bincount(cell)[:, None]
        kept = _with_area(merged, np.unique(_rolled(cell[triangles]), axis=0))
        if len(kept) <= most or cells < 3:
            return merged, kept
        cells = max(2, int(cells * np.clip(np.sqrt(most / len(kept)), 0.5, 0.93)))


def _rolled(triangles: np.ndarray) -> np.ndarray:
    """Returns the triangles with their smallest index first and in the same sense, so that equal ones have equal rows."""
    first = triangles.argmin(axis=1)
    return np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)


def _with_area(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Returns the triangles that have an area."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return triangles[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-12 * max(float(np.ptp(points, axis=0).max()), 1e-12) ** 2]
