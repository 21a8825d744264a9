"""heyoka's Taylor method with the equations of a tree, compiled by LLVM, for work_precision.py (see serve.hpp).

    python heyoka_peer.py SCENE.json

Method: `taylor`; value: tolerance, which sets order and step size without an error test. The rows come from `propagate_grid`, so Python
runs once per simulation. Compiling is not timed.
"""

import sys
import time
from pathlib import Path

import heyoka
import numpy as np
from scenes import Scene, read
from symbolic import Tree
from worker import serve

LARGEST = 7  # joints: above, code without loops would take many minutes to compile


def equations(scene: Scene) -> list[tuple]:
    """Returns the variables q, then w, each with the expression of its rate."""
    n = scene.joints
    variables = np.array(heyoka.make_vars(*(f"{name}{i}" for name in ("q", "w") for i in range(n))), dtype=object)
    qdd = Tree(scene, variables[:n], variables[n:], heyoka.sin, heyoka.cos).accelerations()
    return list(zip(variables, [*variables[n:], *qdd], strict=True))


def main():
    scene = read(Path(sys.argv[1]))
    system = equations(scene)
    start = [*scene.data["initial"]["q"], *scene.data["initial"]["qd"]]
    times = np.arange(scene.rows + 1) * scene.step
    compiled = {}

    def run(_, value: float):
        if value not in compiled:
            compiled[value] = heyoka.taylor_adaptive(system, start, tol=value, fast_math=True, compact_mode=scene.joints > LARGEST)
        integrator = compiled[value]
        integrator.time, integrator.state[:] = 0.0, start
        begin = time.process_time()
        outcome = integrator.propagate_grid(times)
        seconds = time.process_time() - begin
        rows = outcome[-1]
        if len(rows) != len(times):
            raise RuntimeError(str(outcome[0]))
        return seconds, rows[:, : scene.joints]

    serve(run)


if __name__ == "__main__":
    main()
