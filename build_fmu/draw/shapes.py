"""The [[shape]] tables of a model file as triangles in link frames, for pages, pictures and films."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from build_fmu.draw.meshes import drawn_mesh, has_area, mesh_parts
from build_fmu.errors import UserError
from build_fmu.model.describe import Description

SIDES = 20  # of a round body
MOST_TRIANGLES = 8000  # of all meshes of a model
FEWEST_TRIANGLES, MOST_OF_ONE = 40, 2500  # of one mesh


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
    extents = [_extent(model, shape) for shape in shapes]
    whole, solids, failures = sum(extents) or 1.0, [], []
    for shape, extent in zip(shapes, extents, strict=True):
        try:
            # large meshes get more of the triangles
            solids += _solids(model, shape, int(np.clip(MOST_TRIANGLES * extent / whole, FEWEST_TRIANGLES, MOST_OF_ONE)))
        except UserError as error:
            failures.append(str(error))
    more = f" ({len(failures) - 1} more)" if len(failures) > 1 else ""
    warnings = [f"warning: {failures[0]}; not drawn{more}"] if failures else []
    return replace(model, drawing={**model.drawing, "solids": solids}), warnings


def _extent(model: Description, shape: dict) -> float:
    """Returns the diagonal of a mesh (m), 0 of other shapes and of a mesh that cannot be read."""
    if shape["kind"] != "mesh":
        return 0.0
    try:
        points = np.concatenate([points for points, _, _ in mesh_parts(_file(model, shape))])
    except UserError:
        return 0.0
    return float(np.linalg.norm(np.ptp(points, axis=0) * shape["size"]))


def _file(model: Description, shape: dict) -> str:
    """Returns the file of a mesh beside the model file; of an FMU that was built into another folder, below the current one."""
    file = Path(model.folder or ".") / shape["file"]
    return str(file if file.is_file() or not Path(shape["file"]).is_file() else shape["file"])


def _solids(model: Description, shape: dict, most: int) -> list[Solid]:
    size = shape["size"]
    if shape["kind"] == "mesh":
        parts = drawn_mesh(_file(model, shape), most)
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
    return points, triangles[has_area(points, triangles)]
