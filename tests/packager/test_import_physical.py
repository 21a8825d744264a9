"""URDFs that no simulation can take as they are: impossible inertias, joints without a mass, massless links between three axes."""

import numpy as np
import pytest

from build_fmu.importers import urdf
from build_fmu.importers.physical import possible
from build_fmu.importers.rigid import matrix_of
from tests.packager.import_options import import_options

MASS = '<inertial><mass value="1"/><inertia ixx="{}" iyy="0.2" izz="0.3"/></inertial>'
HIP = '<robot name="hip"><link name="base"/><link name="leg">' + MASS.format(0.2) + "</link>{}</robot>"


def chain(axes, mass=""):
    """Returns a robot whose links between base and leg are `mass`; one revolute joint for each axis, all through one point."""
    names = ["base", *(f"v{i}" for i in range(1, len(axes))), "leg"]
    links = "".join(f'<link name="{name}">{mass}</link>' for name in names[1:-1])
    joints = "".join(
        f'<joint name="j{i}" type="continuous"><parent link="{names[i]}"/><child link="{names[i + 1]}"/><axis xyz="{axis}"/></joint>'
        for i, axis in enumerate(axes)
    )
    return HIP.format(links + joints)


def doubts(tmp_path, text):
    (tmp_path / "hip.urdf").write_text(text, encoding="utf-8")
    draft = urdf.read(tmp_path / "hip.urdf", import_options())
    return draft, [line for line in draft.doubts if "snap" not in line]


def test_an_impossible_inertia_becomes_that_of_the_nearest_masses():
    # masses of one sign on three axes give non-negative second moments
    rng = np.random.default_rng(3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    given = turn @ np.diag([-0.1, 0.2, 0.3]) @ turn.T
    second = np.trace(given) / 2 * np.eye(3) - given
    used = possible(given)
    distance = np.linalg.norm(np.trace(used) / 2 * np.eye(3) - used - second)
    assert np.linalg.eigvalsh(np.trace(used) / 2 * np.eye(3) - used)[0] > -1e-15
    for _ in range(200):
        half = rng.normal(size=(3, 3)) * 0.3
        assert np.linalg.norm(half @ half.T - second) >= distance
    sound = matrix_of([0.1, 0.2, 0.25, 0.01, 0, 0])
    assert possible(sound) is sound


def test_an_impossible_inertia_is_listed_with_its_line(tmp_path):
    draft, lines = doubts(tmp_path, chain(["0 0 1"]).replace('ixx="0.2"', 'ixx="-0.2"'))
    assert "hip.urdf:1: the inertia of 'leg' has a negative principal moment (-0.2, 0.2, 0.3 kg m2)" in lines[0]
    assert sorted(draft.links[-1].inertia[:3]) == pytest.approx([0, 0.35, 0.35])


def test_joints_that_move_no_mass_are_locked(tmp_path):
    finger = (
        '<link name="finger"/><joint name="bend" type="revolute"><parent link="leg"/><child link="finger"/><limit lower="0" upper="1"/></joint>'
        '<joint name="tip" type="continuous"><parent link="finger"/><child link="nail"/><mimic joint="bend"/></joint><link name="nail"/>'
    )
    draft, lines = doubts(tmp_path, chain(["0 0 1"]).replace("</robot>", finger + "</robot>"))
    assert [link.drive for link in draft.links] == ["torque", "locked", "locked"]
    assert lines[0].startswith("bend, tip move no mass and are locked") and "their couplings tip_mimic are omitted" in lines[0]
    assert not draft.couplings


def test_three_axes_through_massless_links_are_a_gimbal(tmp_path):
    _, lines = doubts(tmp_path, chain(["0 0 1", "1 0 0", "0 1 0"]))
    assert len(lines) == 1 and lines[0].startswith("neither mass nor inertia: v1, v2 (axes j0, j1, j2); in a pose where")


@pytest.mark.parametrize("text", [chain(["0 0 1", "1 0 0"]), chain(["0 0 1", "1 0 0", "0 1 0"], MASS.format(0.2))])
def test_two_axes_or_links_with_mass_are_not(tmp_path, text):
    assert doubts(tmp_path, text)[1] == []
