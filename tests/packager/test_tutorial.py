"""The tutorial as a new user types it: each command of the page runs, and the files that it speaks of are there. Slow."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "tutorial.md").read_text(encoding="utf-8")
pytestmark = pytest.mark.slow

INPUTS = """function [n dof type alp a b th bt r dx dy dz m g Icxx Icyy Iczz Icxy Icyz Iczx aj al Tp steps] = inputs()
n = 2; dof = 2; type = 0; al = [0.3; 0.25]; alp = [0; 0]; a = [0; al(1)]; b = [0; 0]; th = [0; 0]; bt = [0 1]; r = [1 1];
dx = [al(1)/2; al(2)/2]; dy = [0; 0]; dz = [0; 0]; m = [0.5; 0.4]; g = [0; -9.81; 0];
Icxx = [0; 0]; Icyy = [m(1)*al(1)*al(1)/12; m(2)*al(2)*al(2)/12]; Iczz = Icyy; Icxy = zeros(2, 1); Icyz = Icxy; Iczx = Icxy;
aj = [1 1]; Tp = 3; steps = 0.01;
"""


def block(language):
    return re.search(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)[1]


def test_every_command_of_the_page(tmp_path):
    folder = tmp_path / "my_robots"
    for name in ("bin", "my_robots"):
        (tmp_path / name).mkdir()
    program = tmp_path / "bin" / "build-fmu"
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m build_fmu "$@"\n')
    program.chmod(0o755)
    for name in ("pendulum.urdf", "panda.urdf"):
        (folder / name).write_text(block("xml"))
    (folder / "arm.csv").write_text(block("text"))
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    (folder / "MyRobot").mkdir()
    (folder / "MyRobot" / "inputs.m").write_text(INPUTS)
    commands = "\n".join(re.findall(r"```sh\n(.*?)```", TEXT, re.DOTALL))
    commands += (
        f"build-fmu simulate my_robot.toml --redysim-layout run\ncat >use.py <<'END'\n{block('py')}END\n\"{sys.executable}\" use.py\n"
    )
    environment = {**os.environ, "PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        ["sh", "-eu"], input=commands, cwd=folder, env=environment, capture_output=True, text=True, timeout=900, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    for name in (
        "panda.html",
        "panda.fmu",
        "arm.html",
        "my_robot.html",
        "arm.png",
        "arm.gif",
        "ball.html",
        "standing_dog.html",
        "arm.fmu",
        "arm_inverse.fmu",
        "run/statevar.dat",
    ):
        assert (folder / name).stat().st_size > 0, name
    # two seconds of fall: the last line is (time, q, balance)
    time, angle, balance = map(float, re.findall(r"-?\d[\d.e-]*", done.stdout.splitlines()[-1]))
    assert time == 2 and abs(angle) > 0.1 and abs(balance) < 1e-5
