"""ReDySim's legged robots: the ground (g_prop) becomes contacts of the feet."""

import re

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.errors import UserError
from tests.packager.test_import_redysim import SATELLITE, SATELLITE_START, imported, needs_library, said, write


def legged(g_prop="2000 1 4.5 0.7 1000 2 1 3", **changes):
    text = SATELLITE.replace("nq = 0;", f"nq = 1; g_prop = [{g_prop}];").replace("g = [0; 0; 0]", "g = [0; -9.81; 0]")
    for old, new in changes.items():
        assert f"{old} = " in text
        text = text.replace(f"{old} = ", f"{new}; unused = ", 1)
    return text


def test_a_legged_robot_stands_on_its_feet(tmp_path):
    """Links without children: a shank touches with its tip, a foot with both ends and at the ankle."""
    draft = imported(write(tmp_path / "s", inputs=legged(bt="bt = [0 1 2 1]", alt="alt = [0.5 1 1 0.25]")))
    assert draft.links[0].joint == "free" and "ground" not in " ".join(draft.lost)
    law = {"normal_b": [0, 1, 0], "law": "redysim", "K": 2000, "Cv": 1, "v_max": 4.5, "mu": 0.7, "Ch": 1000}
    assert [(tie.name, tie.fields) for tie in draft.contacts] == [
        ("foot1", {"link_a": "link3", "shape_a": "points", "points_a": [[1, 0, 0]]} | law),
        ("foot2", {"link_a": "link4", "shape_a": "points", "points_a": [[0.25, 0, 0], [0, 0, 0], [-0.75, 0, 0]]} | law),
    ]
    assert "link3 at x = 1 m; link4 at x = 0.25, 0, -0.75 m" in said(draft)
    draft = imported(write(tmp_path / "t", inputs=legged("2000 1 4.5 0.7 1000 3 1 2")))
    assert [tie.fields["normal_b"] for tie in draft.contacts] == [[0, 0, 1]]


@pytest.mark.parametrize(
    ("g_prop", "sentence"),
    [
        ("2000 1 4.5", "'g_prop' must have 8 entries (K, Cv, v_max, mu, Ch and three axes), got 3"),
        ("2000 1 0 0.7 1000 2 1 3", "'g_prop' v_max must be > 0, got 0"),
        ("2000 1 4.5 0.7 1000 2 2 3", "'g_prop' entries 6 to 8 must be the axes 1, 2 and 3 in any order"),
    ],
)
def test_a_ground_that_cannot_be_read(tmp_path, g_prop, sentence):
    with pytest.raises(UserError, match=re.escape(sentence)):
        imported(write(tmp_path / "s", inputs=legged(g_prop)))


@needs_library
def test_a_leg_stands_on_its_imported_ground(tmp_path):
    """A robot of 530 kg on one straight leg sinks: m x" = m g - Cv x' - K x, overdamped."""
    start = SATELLITE_START.replace("q = [0; 0; 0; 0; 0; 0]", "q = [0; 3; 0; -pi/2; 0; 0]").replace(
        "[0.3803; -0.6198; 1.2867]", "zeros(3,1)"
    )
    text = legged("1e6 1e5 4.5 0.7 1000 2 1 3", a="a = [0 0 1 1]")
    model = tmp_path / "leg.toml"
    assert main(["import", str(write(tmp_path / "s", inputs=text, initials=start)), "-o", str(model)]) == 0
    assert main(["simulate", str(model), "--stop", "0.1", "--step", "0.01", "--csv", str(tmp_path / "leg.csv")]) == 0
    rows = np.genfromtxt(tmp_path / "leg.csv", delimiter=",", names=True, deletechars="")
    mass, time = 530, rows["time"]
    fast, slow = np.roots([mass, 1e5, 1e6])
    depth = mass * 9.81 / 1e6 * (1 + (slow * np.exp(fast * time) - fast * np.exp(slow * time)) / (fast - slow))
    assert depth[-1] > 2e-3 and rows["base[2].q"] == pytest.approx(3 - depth, abs=2e-5)
