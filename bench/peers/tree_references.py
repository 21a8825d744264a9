#!/usr/bin/env python3
"""Writes the references of the trees of bench/scenes: heyoka's Taylor series in 80-bit arithmetic (symbolic.py).

    build/peers/bin/python bench/peers/tree_references.py

Prints the largest difference from a run at a thousand times the tolerance.
"""

from __future__ import annotations

import heyoka
import numpy as np
from heyoka_peer import equations
from scenes import Scene, all_scenes, write

FINEST = 1e-18


def motion(scene: Scene, tolerance: float) -> np.ndarray:
    """Returns the positions at the output times, one row each."""
    start = np.array([*scene.data["initial"]["q"], *scene.data["initial"]["qd"]], dtype=np.longdouble)
    integrator = heyoka.taylor_adaptive(equations(scene), start, tol=np.longdouble(tolerance), fp_type=np.longdouble, compact_mode=True)
    times = (np.arange(scene.rows + 1) * scene.step).astype(np.longdouble)
    return integrator.propagate_grid(times)[-1][:, : scene.joints]


def main():
    for scene in all_scenes():
        if scene.name not in ("humanoid", "panda", "puma560"):
            continue
        rows = motion(scene, FINEST)
        print(f"{scene.name}: differs by {np.abs(rows - motion(scene, 1e3 * FINEST)).max():.1e} rad at a thousand times the tolerance")
        write(scene, rows)


if __name__ == "__main__":
    main()
