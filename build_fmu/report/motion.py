"""The outputs that define the configuration of a mechanism, and the distance between two results."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from build_fmu.errors import UserError
from build_fmu.run.driver import Staged


@dataclass(frozen=True)
class Positions:
    """Joint positions among the outputs, and quaternions of spherical joints (four names each)."""

    coordinates: list[str]
    quaternions: list[list[str]]
    unit: str

    @property
    def names(self) -> list[str]:
        """Returns all names in the order of a record's columns."""
        return self.coordinates + [name for four in self.quaternions for name in four]

    def error(self, values: np.ndarray, truth: np.ndarray) -> float:
        """Returns the maximum distance (m, rad) over all rows and joints; for quaternions the angle between them."""
        count = len(self.coordinates)
        worst = float(np.abs(values[:, :count] - truth[:, :count]).max(initial=0.0))
        for k in range(len(self.quaternions)):
            part = slice(count + 4 * k, count + 4 * k + 4)
            # q and -q are the same rotation; for small angles the angle is twice the distance
            near = np.minimum(
                np.linalg.norm(values[:, part] - truth[:, part], axis=1), np.linalg.norm(values[:, part] + truth[:, part], axis=1)
            )
            worst = max(worst, float(2 * near.max(initial=0.0)))
        return worst


def positions(fmu: Staged) -> Positions:
    """Returns the positions of an FMU; raises UserError if nothing is integrated."""
    outputs = fmu.names("output")
    coordinates = [n for n in outputs if n.endswith(".q") and f"{n}d" in outputs]
    heads = [n.removesuffix(".omega[1]") for n in outputs if n.endswith(".omega[1]")]
    quaternions = [[f"{head}.quaternion[{i}]" for i in range(1, 5)] for head in heads]
    if not coordinates and not quaternions:
        raise UserError(f"'{fmu.name}' has no integrated states: its outputs are algebraic functions of its inputs")
    units = list(dict.fromkeys([fmu.variables[n].unit or "1" for n in coordinates] + ["rad"] * bool(quaternions)))
    return Positions(coordinates, quaternions, " or ".join(units))
