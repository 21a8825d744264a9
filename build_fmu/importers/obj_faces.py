"""Faces of OBJ files with more than three corners: quadrangles are split along the shorter diagonal, as MuJoCo does."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np


@lru_cache(maxsize=512)
def split_faces(file: str) -> tuple[np.ndarray, int] | None:
    """Returns the corners of all triangles of a readable OBJ file, triangles x 3 x 3, and the number of faces with more than four corners.

    MuJoCo may split these otherwise, or drop them. None: all faces are triangles, or it is another file.
    """
    if Path(file).suffix.lower() != ".obj":
        return None
    points, faces = [], []
    for line in Path(file).read_text(encoding="utf-8", errors="replace").replace("\\\n", " ").splitlines():
        kind, *words = line.partition("#")[0].split() or [""]
        if kind == "v":
            points.append([float(word) for word in words[:3]])
        elif kind == "f":
            numbers = [int(word.partition("/")[0]) for word in words]
            faces.append([number - 1 if number > 0 else len(points) + number for number in numbers])
    if all(len(face) == 3 for face in faces):
        return None
    single = np.array(points, np.float32)
    triangles = [triangle for face in faces for triangle in _split(face, single)]
    return np.array(points)[triangles], sum(len(face) > 4 for face in faces)


def _split(face: list[int], points: np.ndarray) -> list[list[int]]:
    if len(face) == 4:
        # in single precision, as MuJoCo compares them
        first, second = (float(np.sum((points[face[i + 2]] - points[face[i]]) ** 2)) for i in (0, 1))
        face = face if first < second else [*face[1:], face[0]]
    return [[face[0], *face[i : i + 2]] for i in range(1, len(face) - 1)]
