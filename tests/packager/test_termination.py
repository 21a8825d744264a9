"""SIGTERM in a separate process: no temporary files remain, and a long call of a library does not delay the end."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
IN_A_CALL = """
import ctypes
from build_fmu.cli.termination import cleaned_up_at_sigterm
lock, mutex = ctypes.CDLL(None).pthread_mutex_lock, ctypes.create_string_buffer(64)
lock(mutex)
with cleaned_up_at_sigterm():
    print(flush=True)
    lock(mutex)  # never returns
"""

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="SIGTERM of POSIX")


def process(folder, *arguments):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(folder)}
    return subprocess.Popen(
        [sys.executable, *arguments], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    )


def test_a_command_removes_its_temporary_files(tmp_path):
    with process(tmp_path, "-m", "build_fmu", "check", "-") as run:  # waits for the model
        end = time.monotonic() + 60
        while not any(tmp_path.iterdir()) and time.monotonic() < end:
            time.sleep(0.01)
        time.sleep(0.1)
        assert any(tmp_path.iterdir())
        run.terminate()
        try:
            assert run.wait(20) == 128 + signal.SIGTERM
        finally:
            run.kill()
    assert not any(tmp_path.iterdir())


def test_a_call_of_a_library_is_ended(tmp_path):
    with process(tmp_path, "-c", IN_A_CALL) as run:
        run.stdout.readline()
        run.terminate()
        try:
            assert run.wait(20) == 128 + signal.SIGTERM
        finally:
            run.kill()
