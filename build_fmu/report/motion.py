"""Which outputs tell where a mechanism is, and how far apart two records of them are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from build_fmu.errors import UserError
from build_fmu.run.driver import Staged


@dataclass(frozen=True)
class Positions:
    """Joint positions among the outputs, and the quaternions of spherical joints (their four names in order)."""

    coordinates: list[str]
    quaternions: list[list[str]]
    unit: str

    @property
    def names(self) -> list[str]:
        """Returns all names in the order of a record's columns."""
        return self.coordinates + [name for four in self.quaternions for name in four]

    def error(self, values: np.ndarray, truth: np.ndarray) -> float:
        """Returns the largest distance (m, rad) over all rows and joints; of quaternions the angle between them."""
        count = len(self.coordinates)
        worst = float(np.abs(values[:, :count] - truth[:, :count]).max(initial=0.0))
        for k in range(len(self.quaternions)):
            part = slice(count + 4 * k, count + 4 * k + 4)
            # either sign is the same rotation; the angle is twice the half-angle's sine for all that matters here
            near = np.minimum(np.linalg.norm(values[:, part] - truth[:, part], axis=1), np.linalg.norm(values[:, part] + truth[:, part], axis=1))
            worst = max(worst, float(2 * near.max(initial=0.0)))
        return worst


def positions(fmu: Staged) -> Positions:
    """Returns what moves; raises UserError where nothing is integrated."""
    outputs = fmu.names("output")
    coordinates = [n for n in outputs if n.endswith(".q") and f"{n}d" in outputs]
    heads = [n.removesuffix(".omega[1]") for n in outputs if n.endswith(".omega[1]")]
    quaternions = [[f"{head}.quaternion[{i}]" for i in range(1, 5)] for head in heads]
    if not coordinates and not quaternions:
        raise UserError(f"'{fmu.name}' integrates nothing: its outputs follow from its inputs at once, without an error in time")
    units = list(dict.fromkeys([fmu.variables[n].unit or "1" for n in coordinates] + ["rad"] * bool(quaternions)))
    return Positions(coordinates, quaternions, " or ".join(units))
