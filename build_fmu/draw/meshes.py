"""Mesh files: their triangles and colors, made coarse for drawing."""

from __future__ import annotations

import logging
from functools import lru_cache
from pathlib import Path

import numpy as np

from build_fmu.errors import UserError

MUTE = logging.NullHandler()
MOST_COLOURS = 8  # of a mesh; a texture has more


def drawn_mesh(file: str, most: int) -> list[tuple[np.ndarray, np.ndarray, str | None]]:
    """Returns points (m), triangles and color of the parts of a mesh file, together at most `most` triangles; raises UserError."""
    mesh_parts(file)
    return _drawn(file, Path(file).stat().st_mtime_ns, most)


@lru_cache(maxsize=256)
def _drawn(file: str, changed: int, most: int) -> list[tuple[np.ndarray, np.ndarray, str | None]]:
    parts = _read(file, changed)
    total, shown = sum(len(triangles) for _, triangles, _ in parts), []
    for points, triangles, colours in parts:
        points, triangles, first = coarse(points, triangles, max(12, most * len(triangles) // total))
        for colour, chosen in _groups(colours[first]) if len(first) else ():
            used, corners = np.unique(triangles[chosen], return_inverse=True)
            shown.append((points[used], corners.reshape(-1, 3), colour))
    return shown


def mesh_parts(file: str) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Returns points (m), triangles and their colors (0 to 255, -1: unknown) of each part of a mesh file; raises UserError."""
    if not Path(file).is_file():
        raise UserError(f"mesh file '{file}' does not exist")
    return _read(file, Path(file).stat().st_mtime_ns)


@lru_cache(maxsize=256)
def _read(file: str, changed: int) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Reads a mesh file; `changed`: when it was written, so that a new version is read again."""
    own = _of_mujoco(file)
    if own is not None:
        return [own]
    try:
        import trimesh
    except ImportError:
        raise UserError(f"mesh '{file}' requires the package trimesh: pip install 'build-fmu[mesh]'") from None
    # a missing texture is not an error: without a handler Python prints trimesh's tracebacks
    logging.getLogger("trimesh").addHandler(MUTE)
    try:
        resolver = trimesh.resolvers.FilePathResolver(file)
        resolver.allow_anywhere = True  # textures beside the folder of the mesh; trimesh 4 finds them without
        scene = trimesh.load_scene(file, resolver=resolver)
        parts = [part for part in scene.dump() if len(getattr(part, "faces", ()))]
    except Exception as error:  # the readers of trimesh raise exceptions of any kind
        why = (str(error) or type(error).__name__).splitlines()[0]
        raise UserError(f"mesh file '{file}' cannot be read: {why}") from None
    if not parts:
        raise UserError(f"mesh file '{file}' contains no triangles")
    scale = _metres(str(scene.metadata.get("units") or scene.units or ""))
    return [(np.asarray(part.vertices) * scale, np.asarray(part.faces), _colours(part)) for part in parts]


def _of_mujoco(file: str) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
    """Returns the part of a mesh file in MuJoCo's own format, .msh; None: it has another format, or no triangles."""
    if Path(file).suffix.lower() != ".msh":
        return None
    data = Path(file).read_bytes()
    # numbers of points, normals, texture coordinates and triangles, then these
    counts = np.frombuffer(data[:16], "<i4")
    if len(counts) != 4 or counts.min() < 0 or counts[3] == 0 or len(data) != 16 + 4 * int(counts.astype(np.int64) @ [3, 3, 2, 3]):
        return None
    points = np.frombuffer(data, "<f4", 3 * counts[0], 16).reshape(-1, 3).astype(float)
    triangles = np.frombuffer(data[len(data) - 12 * int(counts[3]) :], "<i4").reshape(-1, 3)
    if triangles.min() < 0 or triangles.max() >= len(points):
        return None
    return points, triangles, np.full((len(triangles), 3), -1.0)


def _metres(units: str) -> float:
    """Returns the length unit of a COLLADA file, "0.001 * meters"; 1 for other files, whose unit is that of the shape."""
    number, _, what = units.partition(" * ")
    return float(number) if what == "meters" else 1.0


def _colours(part) -> np.ndarray:
    """Returns the color of each triangle: of the material, of its texture or of the corners."""
    faces = np.asarray(part.faces)
    try:
        visual = part.visual
        if visual.kind == "texture":
            image = getattr(visual.material, "image", None) or getattr(visual.material, "baseColorTexture", None)
            if image is not None and visual.uv is not None:
                return np.asarray(visual.to_color().vertex_colors, float)[faces, :3].mean(axis=1)
            return np.tile(np.asarray(visual.material.main_color[:3], float), (len(faces), 1))
        if visual.defined:
            return np.asarray(visual.face_colors, float)[:, :3]
    except (AttributeError, ValueError, IndexError, OSError):
        pass  # a material that trimesh does not know
    return np.full((len(faces), 3), -1.0)


def _groups(colours: np.ndarray) -> list[tuple[str | None, np.ndarray]]:
    """Returns the mean color of each group of similar colors, and its triangles."""
    _, group, counts = np.unique(np.round(colours / 32).astype(int) @ [1, 16, 256], return_inverse=True, return_counts=True)
    group = group.ravel()
    means = np.stack([np.bincount(group, colours[:, k]) for k in range(3)], 1) / counts[:, None]
    common = np.argsort(-counts, kind="stable")[:MOST_COLOURS]
    nearest = common[np.linalg.norm(means[:, None] - means[common][None], axis=2).argmin(axis=1)][group]
    shown = []
    for number in np.unique(nearest):
        mean = colours[nearest == number].mean(axis=0)
        shown.append((None if mean.min() < 0 else "#" + "".join(f"{round(x):02x}" for x in mean), nearest == number))
    return shown


def coarse(points: np.ndarray, triangles: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Merges the corners in each cell of a grid, as coarse as necessary for at most `most` triangles.

    Returns points and triangles, and of each triangle the number of one from which it was made.
    """
    low, extent = points.min(axis=0), float(np.ptp(points, axis=0).max()) or 1.0
    cells = 256
    while True:
        places = np.floor((points - low) / extent * cells).astype(np.int64)
        cell = np.unique(places @ [1, 1024, 1024**2], return_inverse=True)[1].ravel()
        merged = np.stack([np.bincount(cell, points[:, k]) for k in range(3)], 1) / np.bincount(cell)[:, None]
        faces, count = _rolled(cell[triangles]), len(merged)
        _, first = np.unique((faces[:, 0] * count + faces[:, 1]) * count + faces[:, 2], return_index=True)
        first = first[has_area(merged, faces[first])]
        if len(first) <= most or cells < 3:
            return merged, faces[first], first
        cells = max(2, int(cells * np.clip(np.sqrt(most / len(first)), 0.5, 0.93)))


def _rolled(triangles: np.ndarray) -> np.ndarray:
    """Returns the triangles with their smallest index first and in the same sense, so that equal ones have equal rows."""
    first = triangles.argmin(axis=1)
    return np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)


def has_area(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Returns which triangles have an area."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-12 * max(float(np.ptp(points, axis=0).max()), 1e-12) ** 2
