"""The machine, program version and load of a measurement."""

from __future__ import annotations

import os
import platform
import subprocess
from datetime import date
from pathlib import Path

from build_fmu import __version__
from build_fmu.native import SOURCE_TREE

HAS_LOAD = hasattr(os, "getloadavg")  # not on Windows
TIME = "wall-clock time" if os.name == "nt" else "CPU time"  # what fmu_driver measures, see drive/computing_time.hpp


def processor() -> str:
    """Returns the processor's name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def commit() -> str:
    """Returns the source tree's commit, or an empty string outside one."""

    def git(*arguments: str) -> str:
        try:
            return subprocess.run(("git", "-C", str(SOURCE_TREE), *arguments), capture_output=True, text=True, check=False).stdout.strip()
        except OSError:
            return ""

    if not (SOURCE_TREE / ".git").exists():
        return ""
    return git("rev-parse", "--short", "HEAD") + (" with changes" if git("status", "--porcelain", "--untracked-files=no") else "")


def load() -> float:
    """Returns the mean number of runnable processes during the last minute; 0 where the system does not count them."""
    return os.getloadavg()[0] if HAS_LOAD else 0.0


def processors() -> int:
    """Returns the number of processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def busy(before: float, after: float) -> str:
    """Returns a sentence if other programs used the machine, from the load before and after a measurement."""
    others, available = max(before, after - 1), processors()
    if others <= 0.5 * available:
        return ""
    return f"busy machine: other programs had a load of {others:.1f} on {available} processors; repeat the measurement on an idle machine"


def machine_lines() -> list[str]:
    """Returns processor, load, system, version and date."""
    at_load = f"load {load():.1f}, " if HAS_LOAD else ""
    lines = [f"{processor()}, {os.cpu_count()} processors, {at_load}{platform.system()} {platform.release()}"]
    at = commit()
    lines.append(f"build-fmu {__version__}{f', commit {at}' if at else ''}, {date.today().isoformat()}")
    return lines
