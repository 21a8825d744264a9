"""The pose explorer of the page: links where the joint values put them, and what its sliders cannot do is said."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from build_fmu.cli import main
from build_fmu.importers.draft import DhFrame
from build_fmu.importers.rigid import pose_of
from tests.packager.test_show import BALL, attribute, browse, data_of, needs_browser, needs_library

NODE = shutil.which("node")
ROOT = Path(__file__).resolve().parents[2]
MODEL = BALL.replace("inertia = [0.1, 0.1, 0.1]\n", "inertia = [0.1, 0.1, 0.1]\nlower = -1\nupper = 1.5\nstop_stiffness = 100\n").replace(
    "qd = [1, 2, 3]\n", ""
)
LOOP = """
[[loop]]
name = "closure"
type = "spherical"
link_a = "ground"
link_b = "body"
point_a = [1, 0, 0.5]
point_b = [0.3, 0.1, -0.4]
"""


def shown(model, tmp_path, *options):
    (tmp_path / "ball.toml").write_text(model, encoding="utf-8")
    assert main(["show", str(tmp_path / "ball.toml"), "--stop", "0.2", "-o", str(tmp_path / "page.html"), *options]) == 0
    return tmp_path / "page.html"


@needs_library
@needs_browser
def test_sliders_put_the_links_where_the_joint_values_have_them(tmp_path):
    page = shown(MODEL, tmp_path)
    dom = browse(f"{page.as_uri()}#pose=1.2,0.6,-0.5,0.4", tmp_path, "--dump-dom")
    turn = Rotation.from_euler("ZXY", [0.6, -0.5, 0.4])
    expected = pose_of(DhFrame(alpha=0.7), "revolute", 1.2) @ pose_of(DhFrame(alpha=0.4, a=1)) @ [*turn.apply([0.3, 0.1, -0.4]), 1]
    assert attribute(dom, "trouble") is None and json.loads(attribute(dom, "tips"))[0] == pytest.approx(expected[:3], abs=1e-9)
    start = dict(option.split("=") for option in re.search(r'<code id="command">--start ([^<]*)</code>', dom)[1].split())
    x, y, z, w = turn.as_quat()
    assert [float(start[f"socket.quaternion0[{k}]"]) for k in (1, 2, 3, 4)] == pytest.approx([w, x, y, z], abs=1e-5)
    assert float(start["arm.q0"]) == 1.2 and "not a result of the run" in dom


@pytest.mark.skipif(not NODE, reason="no node")
def test_the_angles_of_a_ball_give_its_orientation_also_where_they_are_singular():
    angles = [(0.3, np.pi / 2, 0.2), (0.3, -np.pi / 2, 0.2), (3.0, 1.5, -3.0)]
    turns = [Rotation.from_euler("ZXY", triple) for triple in angles]
    script = (ROOT / "build_fmu" / "show" / "pose.js").read_text(encoding="utf-8")
    function = script[script.index("function anglesOf") : script.index("function quaternionOf")]
    matrices = json.dumps([turn.as_matrix().ravel().tolist() for turn in turns])
    done = subprocess.run([NODE, "-p", f"{function} JSON.stringify({matrices}.map(anglesOf))"], capture_output=True, text=True, check=True)
    for turn, found in zip(turns, json.loads(done.stdout), strict=True):
        assert (Rotation.from_euler("ZXY", found).inv() * turn).magnitude() < 1e-12


@needs_library
@needs_browser
def test_stops_bound_a_slider(tmp_path):
    """Also a single one."""
    dom = browse(f"{shown(MODEL, tmp_path).as_uri()}#pose=1", tmp_path, "--dump-dom")
    assert '<input type="range" step="any" min="-1" max="1.5">' in dom
    page = shown(MODEL.replace("upper = 1.5\n", ""), tmp_path)
    assert re.search(
        r'<input type="range" step="any" min="-1" max="3.14[0-9]*">', browse(f"{page.as_uri()}#pose=1", tmp_path, "--dump-dom")
    )


@needs_library
@needs_browser
def test_sliders_begin_at_the_pose_of_the_run(tmp_path):
    page = shown(MODEL, tmp_path)
    poses = [json.loads(attribute(browse(f"{page.as_uri()}#{at}", tmp_path, "--dump-dom"), "tips"))[0] for at in ("t=0", "pose=0")]
    assert poses[1] == pytest.approx(poses[0], abs=1e-6)


@needs_library
@needs_browser
def test_an_open_loop_is_reported(tmp_path):
    page = shown(MODEL + LOOP, tmp_path)
    dom = browse(f"{page.as_uri()}#pose=0.2,0.6,-0.5,0.4", tmp_path, "--dump-dom")
    turn = Rotation.from_euler("ZXY", [0.6, -0.5, 0.4]).as_matrix()
    point_b = next(loop["point_b"] for loop in data_of(page.read_text(encoding="utf-8"))["drawing"]["loops"])
    body = data_of(page.read_text(encoding="utf-8"))["drawing"]["links"][1]
    local = np.array(body["rotation"]).T @ (np.array(point_b) - body["origin"])
    pose = pose_of(DhFrame(alpha=0.7), "revolute", 0.2) @ pose_of(DhFrame(alpha=0.4, a=1))
    gap = np.linalg.norm((pose @ [*(turn @ local), 1])[:3] - [1, 0, 0.5])
    found = re.search(r"Loops are not closed here; distance of their points: closure ([\d.]+) mm", dom)
    assert float(found[1]) == pytest.approx(1000 * gap, abs=0.06) and gap > 0.1
    assert '<code id="command"></code>' in dom
