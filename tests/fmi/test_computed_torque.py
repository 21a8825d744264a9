"""examples/computed_torque.py as a reader runs it: the inverse FMU controls the plant FMU."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "computed_torque.py"


def test_the_inverse_fmu_makes_the_plant_follow_its_trajectory(fmu_file, tmp_path):
    (tmp_path / "out").mkdir()
    for name in ("kuka_kr5", "kuka_kr5_inverse"):
        shutil.copy(fmu_file(name), tmp_path / "out")
    done = subprocess.run(
        [sys.executable, str(EXAMPLE)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        env={**os.environ, "MPLCONFIGDIR": str(tmp_path)},
    )
    assert done.returncode == 0, done.stderr
    pd, computed = (line.split() for line in done.stdout.splitlines())
    # "...: largest error 0.0500 rad, after 1.5 s 1.6e-04 rad"
    assert float(computed[-7]) < 0.0501 and float(computed[-2]) < 1e-3
    assert float(pd[-7]) > 0.3 and float(pd[-2]) > 0.1
    assert (tmp_path / "out" / "computed_torque.png").stat().st_size > 10000
