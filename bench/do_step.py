#!/usr/bin/env python3
"""What a communication step of 1 ms costs and how much of it is the right-hand side: the KUKA KR5's FMU, erk at rtol 1e-6,
all torques changed at every step, through a compiled master. Prints lines `scene.metric value`.

    python bench/do_step.py --core out/bench/core.txt      the file holds what bench/run.py printed
"""

from __future__ import annotations

import argparse
import statistics
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "bench" / "peers"))
from peers import fmu_command  # noqa: E402
from worker import Worker  # noqa: E402

STEPS, CUTS, ROUNDS = 100, 10, 21


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--core", type=Path, required=True)
    parser.add_argument("--programs", type=Path, default=ROOT / "build" / "bench" / "bench" / "peers")
    options = parser.parse_args()
    core = dict(line.split() for line in options.core.read_text().splitlines() if line and not line.startswith("#"))
    work = ROOT / "build" / "peers_work"
    work.mkdir(parents=True, exist_ok=True)
    command = fmu_command(options.programs / "fmu_runner", ROOT / "models" / "kuka_kr5.toml", work, STEPS, 0.01, [0.0] * 6)
    worker = Worker(command, str(work / "do_step.log"))
    answers = [worker.ask(f"erk/{CUTS}", 1e-6) for _ in range(ROUNDS)]
    worker.close()
    failure = next((answer.failure for answer in answers if answer.rows is None), None)
    if failure:
        sys.exit(f"the FMU's run failed: {failure}")
    step = 1e9 * statistics.median(answer.seconds for answer in answers) / (STEPS * CUTS)
    evaluations = answers[0].rows[-1, -1] / (STEPS * CUTS)
    print(f"kuka_kr5.do_step_1ms_ns {step:.4g}")
    print(f"kuka_kr5.do_step_1ms_right_hand_sides {evaluations:.3g}")
    share = evaluations * float(core["kuka_kr5.right_hand_side_ns"]) / step
    print(f"kuka_kr5.do_step_1ms_share_of_right_hand_sides {share:.2g}")


if __name__ == "__main__":
    main()
