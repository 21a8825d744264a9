"""Completion: the shell code is read by the shells where they are installed, and bash completes with it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from build_fmu.cli import main
from build_fmu.cli.completion import SHELLS

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("shell", SHELLS)
def test_the_shell_reads_it(shell, capsys):
    assert main(["completion", shell]) == 0
    text = capsys.readouterr().out
    assert "build-fmu" in text
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed")
    done = subprocess.run([shell, "-n"], input=text, text=True, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def completed(line, folder, capsys):
    """Returns what bash offers at the end of the line."""
    program = folder / "build-fmu"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m build_fmu "$@"\n')
    program.chmod(0o755)
    main(["completion", "bash"])
    words = " ".join(f"'{word}'" for word in line.split(" "))
    text = (
        f"{capsys.readouterr().out}\nCOMP_WORDS=({words})\nCOMP_CWORD={len(line.split(' ')) - 1}\nCOMP_LINE='{line}'\nCOMP_POINT={len(line)}\n"
        'COMP_TYPE=9\n_python_argcomplete build-fmu\nprintf "%s\\n" "${COMPREPLY[@]}"\n'
    )
    environment = {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    return subprocess.run(["bash", "--norc"], input=text, text=True, capture_output=True, check=True, env=environment).stdout.split()


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash is not installed")
def test_bash_completes(tmp_path, capsys):
    assert completed("build-fmu si", tmp_path, capsys) == ["simulate"]
    assert completed("build-fmu simulate --red", tmp_path, capsys) == ["--redysim-layout"]
    assert completed("build-fmu import --dh s", tmp_path, capsys) == ["standard"]
    assert set(SHELLS) <= set(completed("build-fmu completion ", tmp_path, capsys))
