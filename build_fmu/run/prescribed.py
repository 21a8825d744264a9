"""Prescribed motions of an FMU between the values that are set (docs/model_file.md, prescribed motion)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import factorial

MOTION = (".q", ".qd", ".qdd")  # endings of the inputs


def motions_of(inputs: Sequence[str]) -> dict[str, list[str]]:
    """Returns the inputs q, qd and qdd of each joint that has all three."""
    heads = [name.removesuffix(MOTION[2]) for name in inputs if name.endswith(MOTION[2])]
    motions = {head: [head + part for part in MOTION] for head in heads}
    return {head: names for head, names in motions.items() if set(names) <= set(inputs)}


class Prescribed:
    """The motions of all joints with the inputs q, qd and qdd."""

    def __init__(self, inputs: Sequence[str], time: float, values: Mapping[str, float]) -> None:
        """Begins at a time (s) with the values of the inputs."""
        names = motions_of(inputs)
        self.motions = {head: _Motion(time, [values[name] for name in parts]) for head, parts in names.items()}
        self.places = {name: (self.motions[head], order) for head, parts in names.items() for order, name in enumerate(parts)}

    def set(self, time: float, values: Mapping[str, float]) -> None:
        """Replaces the values that differ from the ones set last."""
        for name, value in values.items():
            if name in self.places:
                motion, order = self.places[name]
                motion.set(time, order, value)

    def follow(self, begin: float, end: float, slopes: Mapping[str, Sequence[float]]) -> None:
        """Follows the time derivatives of accelerations from `begin` to `end` (s)."""
        for head, motion in self.motions.items():
            if changes := slopes.get(head + MOTION[2]):
                motion.follow(begin, end, changes)

    def at(self, time: float) -> dict[str, float]:
        """Returns all inputs of the motions at a time (s)."""
        return {head + MOTION[order]: motion.at(time, order) for head, motion in self.motions.items() for order in range(3)}


class _Motion:
    """q and its time derivatives at the time `begin` (s), and the values of q, qd and qdd set last."""

    def __init__(self, begin: float, values: Sequence[float]) -> None:
        self.begin, self.parts, self.last = begin, list(values), list(values)

    def at(self, time: float, order: int) -> float:
        """Returns a derivative of q, for order 0 q itself."""
        since = time - self.begin
        return sum(part * since**k / factorial(k) for k, part in enumerate(self.parts[order:]))

    def set(self, time: float, order: int, value: float) -> None:
        """Replaces a derivative unless the value is the one set last."""
        if value != self.last[order]:
            self._begin(time)
            self.parts[order] = self.last[order] = value

    def follow(self, begin: float, end: float, changes: Sequence[float]) -> None:
        """Follows the derivatives of the acceleration."""
        self._begin(begin)
        self.parts += changes
        self._begin(end)
        self.last[2] = self.parts[2]

    def _begin(self, time: float) -> None:
        self.parts, self.begin = [self.at(time, order) for order in range(3)], time
