#!/usr/bin/env python3
"""Measures every figure of docs/performance.md, docs/stability_peers.md, docs/contact.md, docs/benchmarks.md and docs/specialise.md.

scripts/bench.sh builds what it needs.

    python bench/all.py              about half an hour on two processors; figures, plots and pages in out/bench
    python bench/all.py --quick      a few minutes, approximate figures: tests that everything runs
    python bench/all.py --docs       also updates docs/
    python bench/all.py -s parts peers --docs      selected stages; other figures are unchanged

Each stage is an independent script. A stage that exceeds its time limit is ended, and its figures are unchanged.
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
HERE = ROOT / "bench"
SILENCE = 30  # s between progress lines


@dataclass(frozen=True)
class Stage:
    """`output`: file for the standard output of the script; bound in minutes."""

    name: str
    title: str
    command: tuple[str, ...]
    quick: tuple[str, ...] = ()
    output: str = ""
    bound: float = 10
    usual: float = 1


def stages(folder: Path) -> list[Stage]:
    out = ("-o", str(folder))
    return [
        Stage("core", "the recursions", ("run.py",), ("-r", "3", "-t", "0.002"), "core.txt", 8, 2),
        Stage("do_step", "a communication step", ("do_step.py",), (), "do_step.txt", 3, 0.2),
        Stage(
            "latency",
            "latency, start-up and many instances",
            ("latency.py",),
            ("-n", "500", "--instances", "1", "100"),
            "latency.txt",
            8,
            1,
        ),
        Stage("accuracy", "accuracy", ("accuracy.py",), (), "accuracy.txt", 5, 0.2),
        Stage("parts", "cost of unused parts", ("parts.py",), ("--no-time", "-p", "all_these"), "parts.txt", 50, 27),
        Stage("straight_line", "libraries for one model", ("straight_line.py",), ("-r", "3", "--no-library"), "straight_line.txt", 6, 2),
        Stage(
            "peers",
            "error against CPU time, with other simulators",
            ("peers/work_precision.py", *out),
            ("-r", "1", "--longest", "0.05"),
            "",
            100,
            45,
        ),
        Stage("extreme", "extreme cases, with other simulators", ("peers/extreme.py", *out), ("--limit", "5"), "", 12, 3),
        Stage("contact", "contact, with other simulators", ("contact.py", *out), ("-r", "1", "--longest", "0.05"), "", 12, 4),
        Stage("benchmarks", "multibody benchmarks", ("benchmarks.py", *out), ("-r", "1"), "", 10, 3),
        Stage("picture", "work-precision diagram of the KUKA KR5", ("accuracy_picture.py", *out), ("--quick",), "", 6, 1),
    ]


def run(stage: Stage, folder: Path, quick: bool) -> str:
    """Runs a stage and prints its output; returns the reason of a failure, or an empty text. Its file is replaced only when complete."""
    command = [sys.executable, str(HERE / stage.command[0]), *stage.command[1:], *(stage.quick if quick else ())]
    partial = folder / f"{stage.output}.part" if stage.output else None
    late = threading.Event()
    # a separate process group, so that the peers' processes end with it
    process = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, text=True, start_new_session=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
    )

    def end() -> None:
        late.set()
        os.killpg(process.pid, signal.SIGKILL)

    watch, over = threading.Timer(60 * stage.bound, end), threading.Event()
    begin = time.monotonic()

    def still_there() -> None:
        while not over.wait(SILENCE):
            print(f"  … {stage.name}, {time.monotonic() - begin:.0f} s", flush=True)

    watch.start()
    threading.Thread(target=still_there, daemon=True).start()
    try:
        with open(partial or os.devnull, "w", encoding="utf-8") as file:
            for line in process.stdout:
                print(f"  {line}", end="", flush=True)
                file.write(line)
        code = process.wait()
    finally:
        watch.cancel()
        over.set()
        # a keyboard interrupt is not sent to the group
        if process.poll() is None:
            end()
    if late.is_set():
        return f"exceeded {stage.bound:g} minutes and was ended"
    if code:
        return f"failed with code {code}"
    if partial:
        partial.replace(folder / stage.output)
    return ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--docs", action="store_true", help="also update figures and plots in docs/")
    parser.add_argument("--quick", action="store_true", help="approximate figures in a few minutes")
    parser.add_argument("-s", "--stages", nargs="+", metavar="STAGE", help="only these: " + ", ".join(stage.name for stage in stages(ROOT)))
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    if options.docs and options.quick:
        parser.error("--quick cannot be combined with --docs")
    folder = (options.output or ROOT / "out" / ("bench_quick" if options.quick else "bench")).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    every = stages(folder)
    unknown = set(options.stages or ()) - {stage.name for stage in every}
    if unknown:
        parser.error(f"unknown stage {', '.join(sorted(unknown))}")
    wanted = [stage for stage in every if not options.stages or stage.name in options.stages]
    begin = time.monotonic()
    loads, failures = [os.getloadavg()[0]], []
    for number, stage in enumerate(wanted, 1):
        passed = (time.monotonic() - begin) / 60
        usual = "" if options.quick else f", usually {stage.usual:g} min, at most {stage.bound:g}"
        print(f"== {number}/{len(wanted)} {stage.name}: {stage.title} ({passed:.0f} min elapsed{usual})", flush=True)
        why = run(stage, folder, options.quick)
        loads.append(os.getloadavg()[0])
        if why:
            failures.append(f"{stage.name}: {why}")
            print(f"  {why}", flush=True)
    minutes = (time.monotonic() - begin) / 60
    (folder / "load.txt").write_text(
        f"{min(loads):.1f} {max(loads):.1f} {minutes:.0f}{' quick' if options.quick else ''}\n", encoding="utf-8"
    )
    document = [sys.executable, str(HERE / "document.py"), "--figures", str(folder), *(["--docs"] if options.docs else [])]
    if subprocess.run(document, cwd=ROOT).returncode:
        failures.append("the pages were not updated")
    print(f"== {minutes:.0f} minutes" + "".join(f"\n   {line}" for line in failures))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
