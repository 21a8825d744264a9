"""The instruction count of bench/parts.py: it contains the steps, and a count without them is refused."""

import shutil
from pathlib import Path

import pytest

from build_fmu.run.driver import stage_model

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def parts(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    import parts

    monkeypatch.setattr(parts, "COUNTED", 20)
    return parts


@pytest.fixture
def arm(parts, tmp_path):
    return stage_model(parts.bare(ROOT / "models" / "double_pendulum.toml", tmp_path), tmp_path / "staged")


@pytest.mark.skipif(not shutil.which("valgrind"), reason="Valgrind is not installed")
def test_a_count_contains_all_stages_of_each_step(parts, arm):
    stages, joints = 4, 2  # the fewest stages of a table of `erk`
    assert parts.instructions(arm) > 19 * stages * joints * parts.LEAST_PER_JOINT


def test_a_count_without_right_hand_sides_is_refused(parts, arm, monkeypatch):
    monkeypatch.setattr(parts, "executed", lambda fmu, steps: 1_000_000 + 4 * steps)
    with pytest.raises(SystemExit, match="76 instructions in 19 steps of 'double_pendulum', fewer than one right-hand side takes"):
        parts.instructions(arm)
