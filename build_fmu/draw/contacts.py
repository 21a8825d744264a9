"""Outlines of contact shapes, planes and height maps, and force arrows, as lines in the ground frame (m)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

TERRAINS = ("plane", "heightmap")
CIRCLE = [(np.cos(t), np.sin(t)) for t in np.linspace(0, 2 * np.pi, 25)]


def outlines(shape: dict[str, Any]) -> list[np.ndarray]:
    """Returns lines along the edges of a solid shape."""
    kind, radius, half = shape["kind"], shape.get("radius", 0.0), shape.get("half_length", 0.0)
    if kind == "box":
        lines = list(_edges(shape["half_size"]))
    elif kind == "sphere":
        lines = [[(radius * c, radius * s, 0) for c, s in CIRCLE], *_sections(radius, 0.0)]
    elif kind == "capsule":
        lines = [[(radius * c, radius * s, z) for c, s in CIRCLE] for z in (-half, half)] + _sections(radius, half)
    elif kind == "disk":
        lines = [[(radius * c, radius * s, 0) for c, s in CIRCLE], [(-radius, 0, 0), (radius, 0, 0)], [(0, -radius, 0), (0, radius, 0)]]
    else:
        lines = []
    return [_placed(shape, line) for line in lines]


def points_of(shape: dict[str, Any]) -> list[np.ndarray]:
    """Returns points that a picture must include: those of `points`, or of the outlines."""
    if shape["kind"] == "points":
        return list(_placed(shape, shape["points"]))
    return [] if shape["kind"] in TERRAINS else [point for line in outlines(shape) for point in line]


def terrain(shape: dict[str, Any], low: np.ndarray, high: np.ndarray) -> list[np.ndarray]:
    """Returns grid lines: of a height map, or of a plane in the range of its x and y that a box in the ground frame covers."""
    if shape["kind"] == "heightmap":
        grid, heights = shape["grid"], np.array(shape["heights"])
        rows, columns = np.indices(heights.shape) * grid
        surface = np.stack([columns, rows, heights], axis=2)
        every = max(1, max(heights.shape) // 20)
        return [_placed(shape, line) for line in (*surface[::every], *surface.transpose(1, 0, 2)[::every])]
    frame, origin = np.asarray(shape["rotation"], float), np.asarray(shape["origin"], float)
    corners = [(np.where(signs, high, low) - origin) @ frame for signs in np.ndindex(2, 2, 2)]
    left, right = np.min(corners, axis=0)[:2], np.max(corners, axis=0)[:2]
    lines = []
    for share in np.linspace(0, 1, 9):
        x, y = left + share * (right - left)
        lines += [[(x, left[1], 0), (x, right[1], 0)], [(left[0], y, 0), (right[0], y, 0)]]
    return [_placed(shape, line) for line in lines]


def _placed(shape: dict[str, Any], points: Sequence) -> np.ndarray:
    return np.asarray(points, float) @ np.asarray(shape["rotation"], float).T + np.asarray(shape["origin"], float)


def _sections(radius: float, half: float) -> list[list[tuple]]:
    """Returns the sections of a capsule in its x-z and y-z planes; of a sphere with half = 0."""
    flat = [(radius * c, radius * s + (half if s >= 0 else -half)) for c, s in CIRCLE]
    flat.append(flat[0])
    return [[(x, 0, z) for x, z in flat], [(0, x, z) for x, z in flat]]


def _edges(half: Sequence[float]) -> Iterator[np.ndarray]:
    signs = 2 * np.array(list(np.ndindex(2, 2, 2))) - 1
    for i, a in enumerate(signs):
        for b in signs[i + 1 :]:
            if np.sum(a != b) == 1:
                yield np.array([a, b]) * half
