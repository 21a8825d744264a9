"""One page in a headless Chromium, steered through its debugging pipe: evaluate, mouse, screenshot, messages of the console."""

from __future__ import annotations

import base64
import fcntl
import json
import os
import subprocess
import time
from pathlib import Path
from typing import Any

from tests.packager.test_show import BROWSER, FLAGS


class Page:
    """A page that is open while the `with` block runs."""

    def __init__(self, address: str, folder: Path, *options: str) -> None:
        self.trouble: list[str] = []  # errors and warnings of the console, and exceptions
        self.number = 0
        there, self.write = os.pipe()
        self.read, back = os.pipe()

        def connect() -> None:
            # the browser reads from its descriptor 3 and writes to 4
            ends = [fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (there, back)]
            for number, end in zip((3, 4), ends, strict=True):
                os.dup2(end, number)

        words = [BROWSER, *FLAGS, *options, f"--user-data-dir={folder / 'profile'}", "--remote-debugging-pipe", "about:blank"]
        quiet = subprocess.DEVNULL
        self.process = subprocess.Popen(words, pass_fds=(3, 4), preexec_fn=connect, stdin=quiet, stdout=quiet, stderr=quiet)
        os.close(there)
        os.close(back)
        self.buffer, self.session = b"", None
        target = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Page"):
            self.call(f"{domain}.enable")
        self.call("Page.navigate", url=address)
        self.wait("document.readyState === 'complete' && location.href !== 'about:blank'")

    def __enter__(self) -> Page:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.terminate()
        self.process.wait(20)
        os.close(self.write)
        os.close(self.read)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Returns the answer to a command."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters} | ({"sessionId": self.session} if self.session else {})
        os.write(self.write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._message()
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return answer["result"]

    def _message(self) -> dict[str, Any]:
        while b"\0" not in self.buffer:
            piece = os.read(self.read, 1 << 20)
            assert piece, "the browser ended"
            self.buffer += piece
        text, _, self.buffer = self.buffer.partition(b"\0")
        message = json.loads(text)
        method, said = message.get("method"), message.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.trouble.append(said["exceptionDetails"].get("exception", {}).get("description", str(said)))
        if method == "Runtime.consoleAPICalled" and said["type"] in ("error", "warning", "assert"):
            self.trouble.append(str(said["args"]))
        if method == "Log.entryAdded" and said["entry"]["level"] in ("error", "warning"):
            self.trouble.append(said["entry"]["text"])
        return message

    def value(self, expression: str) -> Any:
        """Returns the value of an expression of the page's script."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, condition: str, seconds: float = 60) -> None:
        """Waits until an expression is true."""
        end = time.monotonic() + seconds
        while not self.value(f"Boolean({condition})"):
            assert time.monotonic() < end, f"{condition} was false for {seconds} s; {self.trouble}"
            time.sleep(0.05)

    def tip(self) -> tuple[float, float]:
        """Returns where the first end of the mechanism is in the window of a live page."""
        return tuple(
            self.value(
                "(() => { const q = project(tipOf(tips[0], posesAt(last()))), box = canvas.getBoundingClientRect();"
                " return [q[0] + box.left, q[1] + box.top]; })()"
            )
        )

    def mouse(self, kind: str, x: float, y: float) -> None:
        """Moves, presses or releases the left button at a place of the window."""
        words = {"moved": "mouseMoved", "pressed": "mousePressed", "released": "mouseReleased"}
        button = {"button": "left", "buttons": 0 if kind == "released" else 1, "clickCount": 1}
        self.call("Input.dispatchMouseEvent", type=words[kind], x=x, y=y, **button)

    def screenshot(self, file: Path) -> None:
        """Writes a picture (.png) of the window."""
        file.write_bytes(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))
