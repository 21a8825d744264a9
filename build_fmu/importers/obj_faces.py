"""Faces of OBJ files: quadrangles, and objects of which MuJoCo reads the first one only."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from build_fmu.errors import UserError


class ObjFaces(NamedTuple):
    """The faces of an OBJ file as triangles, in the order of the file.

    MuJoCo may split faces with more than four corners otherwise, or drop them.
    """

    triangles: np.ndarray  # their corners, triangles x 3 x 3
    large_faces: int  # faces with more than four corners
    objects: int  # groups of faces between statements "o" or "g"
    of_first: int  # triangles of the first object


@lru_cache(maxsize=512)
def obj_faces(file: str) -> ObjFaces | None:
    """Returns the faces of a readable OBJ file, None of another file. Raises UserError.

    Quadrangles are split along the shorter diagonal, as MuJoCo does.
    """
    if Path(file).suffix.lower() != ".obj":
        return None
    try:
        return _read(file)
    except (ValueError, IndexError):
        raise UserError(f"mesh file '{file}' cannot be read: a vertex or a face is invalid") from None


def _read(file: str) -> ObjFaces:
    points: list[list[float]] = []
    objects: list[list[list[int]]] = [[]]
    for line in Path(file).read_text(encoding="utf-8", errors="replace").replace("\\\n", " ").splitlines():
        kind, *words = line.partition("#")[0].split() or [""]
        if kind == "v":
            points.append([float(word) for word in words[:3]])
        elif kind in ("o", "g") and objects[-1]:
            objects.append([])
        elif kind == "f":
            numbers = [int(word.partition("/")[0]) for word in words]
            objects[-1].append([number - 1 if number > 0 else len(points) + number for number in numbers])
    objects = [faces for faces in objects if faces]
    single = np.array(points, np.float32)
    triangles = [[triangle for face in faces for triangle in _split(face, single)] for faces in objects]
    return ObjFaces(
        np.array(points)[[triangle for own in triangles for triangle in own]],
        sum(len(face) > 4 for faces in objects for face in faces),
        len(objects),
        len(triangles[0]),
    )


def _split(face: list[int], points: np.ndarray) -> list[list[int]]:
    if len(face) == 4:
        # in single precision, as MuJoCo compares them
        first, second = (float(np.sum((points[face[i + 2]] - points[face[i]]) ** 2)) for i in (0, 1))
        face = face if first < second else [*face[1:], face[0]]
    return [[face[0], *face[i : i + 2]] for i in range(1, len(face) - 1)]
