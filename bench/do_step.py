#!/usr/bin/env python3
"""CPU time of a communication step of 1 ms and share of the right-hand side: FMU of the KUKA KR5, erk at rtol 1e-6, all torques changed at
every step, compiled master. Prints lines `scene.metric value`: medians over rounds; both are timed successively in each round.
"""

from __future__ import annotations

import argparse
import statistics
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "bench" / "peers"))
import built
import run
from peers import fmu_command
from worker import Worker

STEPS, CUTS, ROUNDS = 100, 10, 9


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--programs", type=Path, default=ROOT / "build" / "bench" / "bench" / "peers")
    options = parser.parse_args()
    program = built.program("dynamics_bench")
    work = ROOT / "build" / "peers_work"
    work.mkdir(parents=True, exist_ok=True)
    command = fmu_command(options.programs / "fmu_runner", ROOT / "models" / "kuka_kr5.toml", work, STEPS, 0.01, [0.0] * 6)
    worker = Worker(command, str(work / "do_step.log"))
    steps, shares = [], []
    for _ in range(ROUNDS):
        answers = [worker.ask(f"erk/{CUTS}", 1e-6) for _ in range(3)]
        failure = next((answer.failure for answer in answers if answer.rows is None), None)
        if failure:
            sys.exit(f"the FMU's run failed: {failure}")
        evaluations = answers[0].rows[-1, -1] / (STEPS * CUTS)
        times, _ = run.run(program, "^kuka_kr5/right_hand_side", 3, 0.005)
        steps.append(1e9 * statistics.median(answer.seconds for answer in answers) / (STEPS * CUTS))
        shares.append(evaluations * statistics.median(times["kuka_kr5"]["right_hand_side"]) / steps[-1])
    worker.close()
    print(f"kuka_kr5.do_step_1ms_ns {statistics.median(steps):.4g}")
    print(f"kuka_kr5.do_step_1ms_right_hand_sides {evaluations:.3g}")
    print(f"kuka_kr5.do_step_1ms_share_of_right_hand_sides {statistics.median(shares):.2g}")


if __name__ == "__main__":
    main()
