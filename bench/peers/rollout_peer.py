"""Many runs by `mujoco.rollout` on one thread, for batch.py: reads an .npz file, writes final angles beside it, prints CPU seconds.

python rollout_peer.py RUNS.npz INTEGRATOR STEPS_PER_ROW
"""

import sys
import time
from pathlib import Path

import mujoco
import numpy as np
from mujoco import rollout

CHUNK = 100  # runs at once: their torques and states of all steps are in memory


def main() -> None:
    file, integrator, cuts = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
    given = np.load(file)
    model = mujoco.MjModel.from_xml_string(str(given["xml"]))
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    model.opt.timestep = float(given["step"]) / cuts
    data, ends, begin = mujoco.MjData(model), [], time.process_time()
    for first in range(0, len(given["starts"]), CHUNK):
        starts, torques = (given[name][first : first + CHUNK] for name in ("starts", "torques"))
        state = np.hstack([np.zeros((len(starts), 1)), starts])  # time, qpos, qvel
        held = np.repeat(torques, cuts, axis=1)
        control = mujoco.mjtState.mjSTATE_QFRC_APPLIED.value
        rows, _ = rollout.rollout(model, data, state, held, control_spec=control)
        ends.append(rows[:, -1, 1 : 1 + model.nq])
    print(time.process_time() - begin)
    np.save(file.with_suffix(".ends.npy"), np.concatenate(ends))


main()
