"""An imported URDF keeps all digits: accelerations against a Newton-Euler recursion in 50 digits, written from the URDF itself.

Angles such as 1.5708 leave axes that are nearly parallel across a fixed joint; their common normal is kilometres away.
"""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from build_fmu.cli import main

mp = pytest.importorskip("mpmath")
ROBOT = """<robot name="lift">
  <link name="floor"/>
  <joint name="rise" type="prismatic"><parent link="floor"/><child link="lift"/><origin xyz="0 0.1 0.8" rpy="0 0 1.57079"/><axis xyz="0 0 1"/></joint>
  <link name="lift"><inertial><mass value="4.3"/><origin xyz="0.01 0.02 -0.3"/>
    <inertia ixx="0.2" iyy="0.19" izz="0.015" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
  <joint name="flip" type="revolute"><parent link="lift"/><child link="torso"/><origin xyz="0.06 0 0.01" rpy="-1.5708 0 0"/><axis xyz="0 0 1"/></joint>
  <link name="torso"><inertial><mass value="0.7"/><origin xyz="0.06 0 0"/>
    <inertia ixx="0.0013" iyy="0.0024" izz="0.0012" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="mount" type="fixed"><parent link="torso"/><child link="shoulder"/><origin xyz="0.04 0.26 0.02" rpy="1.57079 0 0"/></joint>
  <link name="shoulder"/>
  <joint name="arm" type="revolute"><parent link="shoulder"/><child link="upper"/><origin xyz="0.03 0.1 0.2" rpy="-1.5708 0 0.3"/><axis xyz="0 0 1"/></joint>
  <link name="upper"><inertial><mass value="0.9"/><origin xyz="0.03 -0.09 0.005"/>
    <inertia ixx="0.0027" iyy="0.001" izz="0.003" ixy="0.0004" ixz="0.0001" iyz="-0.0002"/></inertial></link>
  <joint name="wrist" type="revolute"><parent link="upper"/><child link="hand"/><origin xyz="0.1 -0.2 0" rpy="1e-6 -2e-6 0.2"/><axis xyz="0 0 1"/></joint>
  <link name="hand"><inertial><mass value="0.05"/><origin xyz="0.02 -0.01 0.002"/>
    <inertia ixx="2e-6" iyy="1.1e-5" izz="1.2e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
</robot>"""
STATE = {"rise": (0.3, 0.4, 1.5), "flip": (-0.6, 0.7, -0.4), "arm": (0.9, -0.8, 0.3), "wrist": (-0.2, 0.5, -0.1)}  # q, qd, tau


def numbers(text):
    return np.array([mp.mpf(word) for word in text.split()])


def about(axis, angle):
    """Rodrigues' rotation."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3, dtype=int) + mp.sin(angle) * cross + (1 - mp.cos(angle)) * (cross @ cross)


def placed(element):
    origin = element.find("origin")
    roll, pitch, yaw = numbers(origin.get("rpy", "0 0 0"))
    return about((0, 0, 1), yaw) @ about((0, 1, 0), pitch) @ about((1, 0, 0), roll), numbers(origin.get("xyz", "0 0 0"))


def joint_forces(root, q, qd, qdd, gravity):
    """Newton and Euler for each body in the axes of the root, forces and moments about its origin."""
    links = {link.get("name"): link for link in root.findall("link")}
    zero = numbers("0 0 0")
    frames = {"floor": (about((0, 0, 1), mp.mpf(0)), zero, zero, zero, numbers(f"0 0 {gravity}"))}  # R, p, omega, alpha, acceleration of p
    bodies = []
    for joint in root.findall("joint"):
        name, child = joint.get("name"), joint.find("child").get("link")
        R, p, w, dw, a = frames[joint.find("parent").get("link")]
        turn, shift = placed(joint)
        r, R = R @ shift, R @ turn
        axis = R @ numbers("0 0 1")
        slide = joint.get("type") == "prismatic"
        if slide:
            r = r + q[name] * axis
        p, a = p + r, a + np.cross(dw, r) + np.cross(w, np.cross(w, r))
        if slide:
            a = a + qdd[name] * axis + 2 * qd[name] * np.cross(w, axis)
        elif name in q:
            w, dw, R = w + qd[name] * axis, dw + qdd[name] * axis + qd[name] * np.cross(w, axis), R @ about((0, 0, 1), q[name])
        frames[child] = R, p, w, dw, a
        force, moment = zero, zero
        inertial = links[child].find("inertial")
        if inertial is not None:
            e = inertial.find("inertia")
            I = np.array([[mp.mpf(e.get("i" + "".join(sorted(x + y)))) for y in "xyz"] for x in "xyz"])
            I, c = R @ I @ R.T, R @ placed(inertial)[1]
            force = mp.mpf(inertial.find("mass").get("value")) * (a + np.cross(dw, c) + np.cross(w, np.cross(w, c)))
            moment = I @ dw + np.cross(w, I @ w) + np.cross(p + c, force)
        bodies.append([child, joint.find("parent").get("link"), name, slide, axis, p, force, moment])
    found = {}
    for child, _, name, slide, axis, p, force, moment in reversed(bodies):
        carried = [body for body in bodies if body[1] == child]
        force, moment = force + sum(body[6] for body in carried), moment + sum(body[7] for body in carried)
        next(body for body in bodies if body[0] == child)[6:] = force, moment
        if name in q:
            found[name] = axis @ (force if slide else moment - np.cross(p, force))
    return [found[name] for name in q]


def accelerations(text):
    """Solves M qdd = tau - h; columns of M are forces for single accelerations."""
    root = ET.fromstring(text)
    with mp.workdps(50):
        q, qd, tau = ({name: mp.mpf(values[k]) for name, values in STATE.items()} for k in range(3))
        still = dict.fromkeys(STATE, mp.mpf(0))
        h = joint_forces(root, q, qd, still, "9.81")
        columns = [joint_forces(root, q, still, still | {name: mp.mpf(1)}, "0") for name in STATE]
        M, right = mp.matrix(columns).T, mp.matrix([tau[name] - x for name, x in zip(STATE, h, strict=True)])
        return [float(x) for x in mp.lu_solve(M, right)]


@pytest.mark.usefixtures("built_library")
def test_nearly_parallel_axes_keep_all_digits(tmp_path):
    (tmp_path / "lift.urdf").write_text(ROBOT)
    model, out = tmp_path / "lift.toml", tmp_path / "out.csv"
    assert main(["import", str(tmp_path / "lift.urdf"), "-o", str(model)]) == 0
    model.write_text(model.read_text() + '\n[fmu]\noutputs = ["acceleration"]\n')
    start = [word for name, (q, qd, _) in STATE.items() for word in ("--start", f"{name}.q0={q}", "--start", f"{name}.qd0={qd}")]
    drive = [word for name, (_, _, tau) in STATE.items() for word in ("--input", f"{name}.tau={tau}")]
    assert main(["simulate", str(model), *start, *drive, "--stop", "1e-6", "--step", "1e-6", "--output", "*.qdd", "--csv", str(out)]) == 0
    table = np.genfromtxt(out, delimiter=",", names=True, deletechars="")
    expected = accelerations(ROBOT)
    found = [table[f"{name}.qdd"][0] for name in STATE]
    # the condition number of M is 1e4 here, of M with rows and columns of unit diagonal about 10
    assert found == pytest.approx(expected, rel=1e-13, abs=1e-13 * max(map(abs, expected)))
