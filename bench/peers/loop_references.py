#!/usr/bin/env python3
"""Writes the references of the scenes in bench/scenes with loops or stiff springs: closed forms, or the dense formulation in long doubles.

    .venv/bin/python bench/peers/loop_references.py

Prints the largest difference of the dense formulation from a run at a hundred times the tolerance.
"""

from __future__ import annotations

import sys
from collections.abc import Callable

import numpy as np
from scenes import ROOT, Scene, all_scenes, write

sys.path.insert(0, str(ROOT / "bench"))
import benchmark_references

from tests.crosscheck.dense_run import Run

TOLERANCE = 1e-13


def governor(times: np.ndarray) -> np.ndarray:
    """Arms have equal angles."""
    return benchmark_references.governor_motion(times)[[0, 1, 2, 2]].T


def three_four_bars(times: np.ndarray) -> np.ndarray:
    """All four rods have the same angle, the three bars the opposite one."""
    angle = benchmark_references.four_bars(3)(times)
    return np.column_stack([*[angle] * 4, *[-angle] * 3])


def dense(scene: Scene) -> np.ndarray:
    def law(_t: float, _q: np.ndarray, _qd: np.ndarray) -> np.ndarray:
        return np.array(scene.torques)

    def positions(rtol: float) -> np.ndarray:
        run = Run(scene.model.stem, law)
        start, _ = run.closed(run.q, run.qd, run.free)
        found = run.until(np.arange(1, scene.rows + 1) * scene.step, rtol)
        return np.array([start, *(q for q, _ in found.values())])

    rows = positions(TOLERANCE)
    print(f"{scene.name}: differs by {np.abs(rows - positions(100 * TOLERANCE)).max():.1e} at a hundred times the tolerance", flush=True)
    return rows


CLOSED_FORMS: dict[str, Callable] = {"iftomm_governor": governor, "three_four_bars": three_four_bars}


def main() -> None:
    for scene in all_scenes():
        if scene.name not in (*CLOSED_FORMS, "iftomm_squeezer", "three_rrr"):
            continue
        times = np.arange(scene.rows + 1) * scene.step
        rows = CLOSED_FORMS[scene.name](times) if scene.name in CLOSED_FORMS else dense(scene)
        write(scene, rows)


if __name__ == "__main__":
    main()
