"""Both ends of the protocol with a simulator's process (described in serve.hpp)."""

from __future__ import annotations

import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

ENOUGH = 0.02  # s; shorter runs are repeated


def serve(run: Callable[[str, float], tuple[float, np.ndarray]]) -> None:
    """Answers requests from standard input; `run` returns CPU time in s and rows, or raises."""
    for line in sys.stdin:
        method, value = line.split()
        seconds, runs, rows = 0.0, 0, None
        try:
            while seconds < ENOUGH:
                spent, rows = run(method, float(value))
                seconds += spent
                runs += 1
        except Exception as error:  # a peer's failure is a result
            print("failed", " ".join(str(error).split())[:200] or type(error).__name__, flush=True)
            continue
        print(repr(seconds / runs), *rows.shape)
        for row in rows:
            print(*(repr(float(x)) for x in row))
        sys.stdout.flush()


LIMIT = 60.0  # s; time limit for an answer


class Gone(Exception):
    """The process of the simulator ended or exceeded its time limit."""


@dataclass
class Answer:
    seconds: float
    rows: np.ndarray | None
    failure: str = ""


class Worker:
    """A simulator's process with one scene, running during the whole comparison."""

    def __init__(self, command: list[str], log: str):
        self.log = open(log, "w")
        self.process = subprocess.Popen(
            [str(x) for x in command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, text=True
        )

    def ask(self, method: str, value: float, limit: float = LIMIT) -> Answer:
        """Returns the answer; raises Gone."""
        watch = threading.Timer(limit, self.process.kill)
        watch.start()
        try:
            return self._ask(method, value)
        finally:
            watch.cancel()

    def _ask(self, method: str, value: float) -> Answer:
        try:
            self.process.stdin.write(f"{method} {value!r}\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            raise Gone from None
        # skip messages of libraries on standard output
        while True:
            head = self.process.stdout.readline()
            if not head:
                raise Gone
            if head.startswith("failed"):
                return Answer(float("nan"), None, head[7:].strip())
            words = head.split()
            if len(words) == 3 and words[1].isdigit() and words[2].isdigit():
                break
        rows = [[float(x) for x in self.process.stdout.readline().split()] for _ in range(int(words[1]))]
        return Answer(float(words[0]), np.array(rows))

    def close(self) -> None:
        self.process.stdin.close()
        self.process.wait()
        self.log.close()
