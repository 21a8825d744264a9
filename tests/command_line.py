"""Runs commands of build_fmu inside the test process, which saves the start of an interpreter and its imports for each call.

tests/packager/test_cli.py and tests/packager/test_real_fmu.py run the command line as a program, too.
"""

from __future__ import annotations

from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from subprocess import CompletedProcess

from build_fmu.cli import main


def command(*arguments: object) -> CompletedProcess[str]:
    """Returns exit code and output of one command."""
    words, out, err = [str(argument) for argument in arguments], StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = main(words)
    return CompletedProcess(words, code, out.getvalue(), err.getvalue())
