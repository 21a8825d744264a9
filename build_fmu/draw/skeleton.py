"""Links without shapes as solids: rods between the joints, joints as cylinders, blocks and spheres."""

from __future__ import annotations

from typing import Any

import numpy as np

from build_fmu.draw.contacts import TERRAINS
from build_fmu.draw.shapes import block, revolved
from build_fmu.model.planar import free_joints

METAL, STUD = "#8b97a3", "#dfe6ec"
PIECE = 4  # thicknesses; long rods are divided, because triangles are sorted by their centers
SIDES = 12  # of rods and joints


class Skeleton:
    """The triangles of the links that are not shaped, in the ground frame; an owner is a link, -1 for the ground, or a color."""

    def __init__(self, drawing: dict[str, Any], shaped: set[int], size: float) -> None:
        self.links, self.shaped = drawing["links"], shaped
        self.origin = [np.asarray(link["origin"], float) for link in self.links]
        self.floating = set().union(*free_joints(self.links))
        lengths = [np.linalg.norm(origin - self._base(i)) for i, origin in enumerate(self.origin) if i not in self.floating]
        lengths = [length for length in lengths if length > 1e-9] or [size]
        self.thick = min(0.018 * size, 0.16 * float(np.median(lengths)))
        self.parts: list[tuple[np.ndarray, int | str]] = []
        for i, link in enumerate(self.links):
            self._link(i, link)
        self._feet(drawing)
        names = {link["name"]: i for i, link in enumerate(self.links)}
        for loop in drawing.get("loops", []):
            for side in "ab":
                carrier = names.get(loop[f"link_{side}"], -1)  # the ground is not a link
                if carrier >= 0 and carrier not in shaped:
                    self._rod(self.origin[carrier], np.asarray(loop[f"point_{side}"], float), carrier, 1.0)

    def _base(self, index: int) -> np.ndarray:
        parent = self.links[index]["parent"]
        return np.zeros(3) if parent < 0 else self.origin[parent]

    def _link(self, index: int, link: dict[str, Any]) -> None:
        origin, parent = self.origin[index], link["parent"]
        # the parent link extends from its own joint to this one
        if parent not in self.shaped and index not in self.floating:
            self._rod(self._base(index), origin, parent, 1.0 if parent >= 0 else 0.55)
        if index in self.shaped:
            return
        if link["mass"] > 0:
            is_tip = all(other["parent"] != index for other in self.links)
            self._rod(origin, np.asarray(link["com"], float), index, 1.0 if is_tip else 0.35)
        if parent not in self.shaped and index not in self.floating:
            self._joint(index, link)

    def _joint(self, index: int, link: dict[str, Any]) -> None:
        axis, thick, turn = np.asarray(link["rotation"], float)[:, 2], self.thick, np.asarray(link["rotation"], float)
        if link["type"] == "spherical":
            self._add(*revolved("sphere", [1.6 * thick], SIDES), np.eye(3), self.origin[index], index)
        for wanted, half, radius, owner in (
            (link["turn"], 1.7, 1.28, index),
            (link["turn"], 2.0, 0.5, STUD),
            (link["slide"], 4.5, 0.35, METAL),
        ):
            if wanted:
                self._rod(self.origin[index] - half * thick * axis, self.origin[index] + half * thick * axis, owner, radius)
        if link["slide"] and not link["turn"]:
            self._add(*block([3 * thick, 3 * thick, 4.2 * thick]), turn, self.origin[index], index)

    def _feet(self, drawing: dict[str, Any]) -> None:
        """End links extend to their contact shapes."""
        parents, feet = {link["parent"] for link in self.links}, {}
        for contact in drawing.get("contacts", []):
            for shape in (contact["a"], contact["b"]):
                if shape["kind"] not in TERRAINS:
                    feet.setdefault(shape["link"], np.asarray(shape["origin"], float))
        for i, link in enumerate(self.links):
            if link["name"] in feet and i not in parents and i not in self.shaped and i not in self.floating:
                self._rod(self.origin[i], feet[link["name"]], i, 1.0)

    def _rod(self, start: np.ndarray, end: np.ndarray, owner: int | str, width: float) -> None:
        length = float(np.linalg.norm(end - start))
        if length < 1e-9:
            return
        axis = (end - start) / length
        across = np.cross(axis, [0, 0, 1] if abs(axis[2]) < 0.9 else [1, 0, 0])
        across /= np.linalg.norm(across)
        turn, count = np.stack([across, np.cross(axis, across), axis], 1), int(np.clip(length / (PIECE * self.thick), 1, 12))
        for k in range(count):
            points, triangles = revolved("cylinder", [width * self.thick, length / count], SIDES)
            self._add(points, triangles, turn, start + (k + 0.5) / count * (end - start), owner)

    def _add(self, points: np.ndarray, triangles: np.ndarray, turn: np.ndarray, place: np.ndarray, owner: int | str) -> None:
        self.parts.append(((points @ turn.T + place)[triangles], owner))
