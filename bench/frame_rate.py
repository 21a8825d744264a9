#!/usr/bin/env python3
"""Frames per second of a page of `show` in Chromium without a graphics card.

    python bench/frame_rate.py MODEL [--seconds 5] [--browser chromium]

Writes the page of the model file or FMU, plays it in a window of 1300 x 800 pixels, and prints lines `MODEL.metric value`: the frames
that the browser displays in the time of a clock, and the CPU time that the page takes for one, on the plain canvas and by WebGL
in software. A browser displays at most 60 frames per second. Other programs slow it down: the first line is the load of the machine.
"""

from __future__ import annotations

import argparse
import fcntl
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from build_fmu.cli import main as build_fmu

FLAGS = (
    "--headless",
    "--no-sandbox",
    "--no-first-run",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1300,800",
    "--remote-debugging-pipe",
)
DRAWN_BY = {  # the fragment of the page's address, and the flags of the browser
    "canvas": ("", ("--disable-gpu",)),
    "webgl": ("#shadows", ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")),
}
# makes two descriptors 3 and 4 and becomes the browser
START = "import os, sys; os.dup2(int(sys.argv[1]), 3); os.dup2(int(sys.argv[2]), 4); os.execvp(sys.argv[3], sys.argv[3:])"
# counts the frames of so many seconds, in which the page plays
COUNT = """new Promise((done) => {
  let frames = -1, first = 0;
  const count = (stamp) => {
    if (++frames === 0) first = stamp;
    if (stamp - first < SECONDS * 1000) requestAnimationFrame(count);
    else done({ frames, seconds: (stamp - first) / 1000, playing, by: document.documentElement.dataset.drawn });
  };
  requestAnimationFrame(count);
})"""


class Browser:
    """A browser that takes commands of the DevTools protocol, each ended by a zero byte, through a pair of pipes."""

    def __init__(self, commands: int, answers: int) -> None:
        """Takes the ends of the pipes, which it owns."""
        self._commands, self._answers = commands, answers
        self._rest, self._sent, self._events = b"", 0, set()

    def close(self) -> None:
        """Ends the connection."""
        os.close(self._commands)
        os.close(self._answers)

    def call(self, method: str, session: str | None = None, **parameters: Any) -> dict[str, Any]:
        """Returns the result of a command."""
        self._sent += 1
        message = {"id": self._sent, "method": method, "params": parameters, **({"sessionId": session} if session else {})}
        rest = json.dumps(message).encode() + b"\0"
        while rest:
            rest = rest[os.write(self._commands, rest) :]
        while True:
            answer = self._next()
            if answer.get("id") == self._sent:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def wait(self, event: str) -> None:
        """Returns once the browser has reported an event."""
        while event not in self._events:
            self._next()

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            part = os.read(self._answers, 1 << 16)
            if not part:
                raise RuntimeError("the browser has ended")
            self._rest += part
        message, _, self._rest = self._rest.partition(b"\0")
        answer = json.loads(message)
        self._events.add(answer.get("method"))
        return answer


@contextmanager
def browser(program: str, flags: tuple[str, ...], profile: str) -> Iterator[Browser]:
    """Starts a browser, which reads from its descriptor 3 and writes to 4, and ends it."""
    (read_commands, write_commands), (read_answers, write_answers) = os.pipe(), os.pipe()
    theirs = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (read_commands, write_answers)]  # neither is 3 or 4
    for end in (read_commands, write_answers):
        os.close(end)
    command = [sys.executable, "-c", START, *map(str, theirs), program, *FLAGS, *flags, f"--user-data-dir={profile}"]
    with subprocess.Popen(command, pass_fds=theirs, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        for end in theirs:
            os.close(end)
        pipe = Browser(write_commands, read_answers)
        try:
            yield pipe
        finally:
            process.terminate()
            pipe.close()


def measure(program: str, page: Path, drawn_by: str, seconds: float) -> dict[str, float]:
    """Returns frames per second and the CPU time of all processes of the browser for a frame (ms)."""
    fragment, flags = DRAWN_BY[drawn_by]
    # helpers of the browser write to their folder until after its end
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile, browser(program, flags, profile) as chromium:
        target = chromium.call("Target.createTarget", url="about:blank")["targetId"]
        session = chromium.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        chromium.call("Page.enable", session)
        chromium.call("Page.navigate", session, url=page.as_uri() + fragment)
        chromium.wait("Page.loadEventFired")

        def work() -> float:
            return sum(process["cpuTime"] for process in chromium.call("SystemInfo.getProcessInfo")["processInfo"])

        def count(duration: float) -> dict[str, Any]:
            expression = COUNT.replace("SECONDS", f"{duration:g}")
            answer = chromium.call("Runtime.evaluate", session, expression=expression, awaitPromise=True, returnByValue=True)
            if "exceptionDetails" in answer:
                raise RuntimeError(f"the page does not play: {answer['exceptionDetails']['text']}")
            return answer["result"]["value"]

        count(1)  # compiles the scripts and the shaders
        before = work()
        found = count(seconds)
        after = work()
    if not found["playing"] or found["by"].lower() != drawn_by:
        raise RuntimeError(f"the page draws by {found['by']}, playing: {found['playing']}")
    return {"frames_per_second": found["frames"] / found["seconds"], "cpu_ms_per_frame": 1000 * (after - before) / found["frames"]}


def main() -> int:
    """Prints the figures."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("model", type=Path, metavar="MODEL")
    parser.add_argument("--seconds", type=float, default=5.0, metavar="S")
    parser.add_argument("--browser", default="chromium", metavar="PROGRAM")
    options = parser.parse_args()
    program = shutil.which(options.browser)
    if program is None:
        parser.error(f"the program '{options.browser}' is not installed")
    print(f"# load {os.getloadavg()[0]:.2f} on {os.cpu_count()} processors", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        if code := build_fmu(["show", str(options.model), "-o", str(page)]):
            return code
        for drawn_by in DRAWN_BY:
            for metric, value in measure(program, page, drawn_by, options.seconds).items():
                print(f"{options.model.stem}.{drawn_by}_{metric} {value:.3g}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
