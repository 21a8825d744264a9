"""ReDySim input files in our own words, with the numbers of its examples: every signature, every trap."""

import argparse
import math
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.errors import UserError
from build_fmu.importers import matlab_file, matlab_reader, redysim
from build_fmu.importers.rigid import rotation_x, rotation_y, rotation_z
from build_fmu.importers.toml_writer import model_text

GRIPPER = """
function [n dof type alp a b th bt r dx dy dz m g Icxx Icyy Iczz Icxy Icyz Iczx aj al Tp steps] = inputs()
% a gripper: four links in a tree, written by hand
n = 4; dof = 4;   % all joints are free
type = 0;         %{ no block comment here
al = [0.1; 0.05
      0.05; 0.05];
alp = zeros(n, 1);
a = [0 al(1) al(2), ...
     al(1)/2];
b = [0 0 0 0]'; th = [0, 0, 0, pi/2];
bt = [0 1 2 1];
r = [1;1;1;1];
dx = al/2; dy = zeros(4,1); dz = zeros(1,4);
m = [0.4 0.2 0.2 0.2];
g = [0 ; -9.81 ; 0];
Icxx = zeros(n,1); Icyy = zeros(n,1); Iczz = zeros(n,1);
Icyy(1) = (1/12)*m(1)*al(1)*al(1); Icyy(2) = (1/12)*m(2)*al(2)*al(2);
Icyy(3) = Icyy(2); Icyy(4) = Icyy(3);
Iczz = Icyy;
Icxy = zeros(n,1); Icyz = zeros(n,1); Iczx = zeros(n,1);
aj = [1 1 1 1];
Tp = 1; steps = 0.01;
"""
GRIPPER_START = """
function [n y0 ti tf incr rtol atol int_type] = initials()
[n dof type alp a b th bt r] = inputs();
q = [0; 0; 0; pi/2]; dq = zeros(n,1);
y0 = [q; dq; 0];
ti = 0; tf = 1.5; incr = 0.05;
rtol = 1e-4; atol = 1e-6; int_type = 1;
"""
FOUR_BAR = """
function [n dof type alp a b th bt r dx dy dz m g Icxx Icyy Iczz Icxy Icyz Iczx aj al] = inputs()
n=3; dof=1; type=1;
al=[0.05; 0.13; 0.1; 0.15];
alp=[0;0;0]; a=[0; al(4); al(2)]; b=[0;0;0]; bt=[0 0 2]; r=[1 1 1];
th=[0; 145.54*pi/180; 130.54*pi/180];
dx=[al(1)/2 al(2)/2 al(3)/2]; dy=[0 0 0]; dz=[0 0 0];
m=[1.5 5 3]; g=[0 -9.81 0];
Icxx=[1.25e-5 4.16666666667e-05 2.5e-5]; Icyy=[0.0003125 0.00704166666667 0.0025]; Iczz=Icyy;
Icxy=[0 0 0]; Icyz=[0 0 0]; Iczx=[0 0 0]; aj=[1 0 0];
"""
CHAIN = """
function [n dof type alp a b th bt r dx dy dz m g Icxx Icyy Iczz Icxy Icyz Iczx aj al] = inputs()
nlinks = 20; n = nlinks; dof = n; type = 0;
for i = 1:n
  alp(i) = 0; a(i) = 0.03; b(i) = 0; th(i) = 0; bt(i) = i-1; r(i) = 1;
  dx(i) = a(i)/2; dy(i) = 0; dz(i) = 0; m(i) = 0.05;
  Icxx(i) = 4.1666667e-7; Icyy(i) = m(i)*0.03^2/12; Iczz(i) = Icyy(i);
  Icxy(i) = 0; Icyz(i) = 0; Iczx(i) = 0; aj(i) = 1; al(i) = 0.03;
end
al(1) = 0; g = [0, -9.81, 0];
"""
LOOP = "link1:0.05,0,0=link3:0.1,0,0"


needs_library = pytest.mark.usefixtures("built_library")


def write(folder, **files):
    folder.mkdir(exist_ok=True)
    for name, text in files.items():
        (folder / f"{name}.m").write_text(text, encoding="utf-8")
    return folder / "inputs.m"


def imported(path, loop=(), pivot=(), name=None):
    return redysim.read(path, argparse.Namespace(loop=list(loop), pivot=list(pivot), name=name))


def said(draft):
    return " | ".join(draft.lost + draft.doubts)


def test_gripper(tmp_path):
    write(tmp_path / "Robotic gripper", inputs=GRIPPER, initials=GRIPPER_START, torque="function tau = torque()\n")
    for path in ("inputs.m", "initials.m", "."):
        draft = imported(tmp_path / "Robotic gripper" / path)
        assert draft.name == "Robotic_gripper" and draft.gravity == [0, -9.81, 0]
    fourth = draft.links[3]
    assert (fourth.parent, fourth.dh.a, fourth.q, fourth.dh.theta, fourth.mass, fourth.com[0]) == (
        "link1",
        0.05,
        math.pi / 2,
        0,
        0.2,
        0.025,
    )
    assert draft.links[0].inertia[1] == pytest.approx(0.4 * 0.01 / 12)
    assert draft.solver == {"method": "bdf", "rtol": 1e-4, "atol": 1e-6} and draft.fmu == {"stop_time": 1.5, "step_size": 0.05}
    assert "torque.m (the control law)" in said(draft) and "ReDySim's own tolerance" in said(draft)


def test_prismatic_values_and_products_of_inertia(tmp_path):
    text = (
        GRIPPER.replace("r = [1;1;1;1]", "r = [1;0;1;1]").replace("b = [0 0 0 0]'", "b = [0.3 0.2 0 0]'").replace("th = [0,", "th = [0.5,")
    )
    text = text.replace("Icxy = zeros(n,1); Icyz = zeros(n,1); Iczx = zeros(n,1)", "Icxy = [1 0 0 0]; Icyz = [2 0 0 0]; Iczx = [3 0 0 0]")
    text = text.replace("zeros(n, 1);\na =", "[0 pi/2 0 0];\na =").replace("th = [0.5, 0,", "th = [0.5, 0.7,")
    first, second, *_ = imported(write(tmp_path / "x", inputs=text)).links
    # without y0 the nominal values are the start: th of a hinge, b of a slider
    assert (first.q, first.dh.theta, first.dh.d) == (0.5, 0, 0.3)
    assert (second.joint, second.q, second.dh.theta, second.dh.d, second.dh.alpha) == ("prismatic", 0.2, 0.7, 0, math.pi / 2)
    assert first.inertia[3:] == [1, 3, 2]


def test_long_chain_from_a_loop(tmp_path):
    draft = imported(write(tmp_path / "chain", inputs=CHAIN))
    assert len(draft.links) == 20 and draft.links[0].parent == "ground" and draft.links[19].parent == "link19"
    assert draft.links[7].inertia[1] == pytest.approx(3.75e-6)


def test_four_bar_needs_its_loop(tmp_path):
    path = write(tmp_path / "fourbar", inputs=FOUR_BAR, jacobian="")
    draft = imported(path)
    assert "--loop 'LINK:x,y,z=LINK:x,y,z'" in said(draft) and "2 constraints in total" in said(draft) and "jacobian.m" in said(draft)
    draft = imported(path, [LOOP])
    assert "violates loop1 by 26.1 mm" in said(draft)
    assert draft.loops[0].fields["directions"] == [[1, 0, 0], [0, 1, 0]]
    assert [link.hold for link in draft.links] == [True, False, False] and [link.drive for link in draft.links] == [
        "torque",
        "free",
        "free",
    ]
    closed = FOUR_BAR.replace("145.54*pi/180; 130.54*pi/180", "acos(-0.65); acos(-0.65)")
    assert "open by" not in said(imported(write(tmp_path / "closed", inputs=closed), [LOOP]))


def test_a_loop_fragment_is_taken_over(tmp_path):
    fragment = tmp_path / "loops.toml"
    fragment.write_text('[[loop]]\nname = "pin"\ntype = "spherical"\nlink_a = "link1"\nlink_b = "link3"\n')
    assert 'name = "pin"' in model_text(imported(write(tmp_path / "x", inputs=FOUR_BAR), [str(fragment)]))


def test_missing_pivots(tmp_path):
    text = FOUR_BAR.replace("a=[0; al(4); al(2)]", "a=[0; 0; al(2)]")
    draft = imported(write(tmp_path / "x", inputs=text), [LOOP])
    assert "link1, link2 share the ground point (0, 0, 0)" in said(draft)
    draft = imported(
        write(tmp_path / "x", inputs=text.replace("145.54*pi/180; 130.54*pi/180", "acos(-0.65); acos(-0.65)")), [LOOP], ["link2=0.15,0,0"]
    )
    assert "ground point" not in said(draft) and "open by" not in said(draft) and draft.links[1].dh.a == pytest.approx(0.15)


@needs_library
def test_the_three_legged_platform_closes(tmp_path, capsys):
    """3-RRR with pivots from the command line: two loops, each planar."""
    text = """n=7; dof=3; type=1; al=[0.4 0.6 0.4 0.4 0.6 0.4 0.6];
    alp=zeros(7,1); a=[0 0.4 0.6 0 0.4 0 0.4]; b=zeros(7,1); bt=[0 1 2 0 4 0 6]; r=ones(1,7);
    th=[1.0467, 5.42076942, -2.5496539, 4.1883, -2.10303541, 5.7637, -0.97998177];
    dx=[0.2 0.3 0.2 0.2 0.3 0.2 0.3]; dy=[0 0 0.1155 0 0 0 0]; dz=zeros(7,1); m=[3 4 8 3 4 3 4]; g=[0;-9.81;0];
    Icxx=zeros(7,1); Icyy=[0.04 0.12 0.106666666667 0.04 0.12 0.04 0.12]; Iczz=[0.04 0.12 0.16 0.04 0.12 0.04 0.12]; aj=[1 0 0 1 0 1 0];
    """
    path = write(tmp_path / "rrr", inputs=text)
    loops = [
        "--loop",
        "link3:0.4,0,0=link5:0.6,0,0",
        "--loop",
        f"link3:{0.4 * math.cos(math.pi / 3)},{0.4 * math.sin(math.pi / 3)},0=link7:0.6,0,0",
    ]
    pivots = ["--pivot", "link4=1,0,0", "--pivot", "link6=0.5,0.866,0"]
    model = tmp_path / "rrr.toml"
    assert main(["import", str(path), "-o", str(model), *loops, *pivots]) == 0
    assert "open by" not in capsys.readouterr().err
    assert main(["simulate", str(model), "--stop", "0.1"]) == 0


@needs_library
def test_the_four_bar_starts_closed_and_keeps_its_crank(tmp_path, capsys):
    model = tmp_path / "fb.toml"
    assert main(["import", str(write(tmp_path / "fb", inputs=FOUR_BAR)), "--loop", LOOP, "-o", str(model)]) == 0
    assert "26.1 mm" in capsys.readouterr().err
    assert main(["simulate", str(model), "--stop", "0.01", "--csv", str(tmp_path / "o.csv"), "--output", "*.q"]) == 0
    start = np.genfromtxt(tmp_path / "o.csv", delimiter=",", skip_header=1)[0, 1:]
    assert start == pytest.approx([0, math.acos(-0.65), math.acos(-0.65)], abs=1e-9)


def test_gravity_that_points_up(tmp_path):
    text = GRIPPER.replace("g = [0 ; -9.81 ; 0]", "g = [9.81 ; 0 ; 0]")
    assert "check its sign" in said(imported(write(tmp_path / "x", inputs=text)))
    assert "sign" not in said(imported(write(tmp_path / "y", inputs=GRIPPER)))


def test_every_signature(tmp_path):
    """The oldest release has no r, no th and angs."""
    old = (
        GRIPPER.replace("th = [0, 0, 0, pi/2];", "angs = [0.1 0.2 0.3 0.4];")
        .replace("r = [1;1;1;1];", "")
        .replace(" th bt r ", " bt ")
        .replace("Tp steps]", "angs]")
    )
    assert [link.q for link in imported(write(tmp_path / "old", inputs=old)).links] == [0.1, 0.2, 0.3, 0.4]
    manual = GRIPPER.replace(" al Tp steps]", " T steps]").replace("Tp = 1;", "T = 2;")
    assert imported(write(tmp_path / "manual", inputs=manual)).fmu == {"stop_time": 2, "step_size": 0.01}


SATELLITE = """
function [n nq alp a b bt dx dy dz al alt m g Icxx Icyy Iczz Icxy Icyz Iczx] = inputs()
n = 4; nq = 0; alp = zeros(n,1); a = [0 0.5 1 1]; b = zeros(n,1); bt = [0 1 2 3]; al = ones(n,1); alt = [0.5 1 1 1];
dx = [0 0.5 0.5 0.5]; dy = zeros(n,1); dz = zeros(n,1); m = [500 10 10 10]; g = [0; 0; 0];
Icxx = [83.61 0.01 0.01 0.01]; Icyy = [83.61 1.05 1.05 1.05]; Iczz = Icyy; Icxy = zeros(n,1); Icyz = zeros(n,1); Iczx = zeros(n,1);
"""
SATELLITE_START = """
function [y0, ti, tf, incr, rtol, atol] = initials()
q = [0; 0; 0; 0; 0; 0]; th = [0.3803; -0.6198; 1.2867]; dq = zeros(6,1); dth = zeros(3,1);
y0 = [q; th; dq; dth; 0]; ti = 0; tf = 30; incr = 0.1; rtol = 1e-5; atol = 1e-7;
"""


@needs_library
def test_a_planar_satellite_is_the_one_among_the_models(tmp_path):
    """Its own file is held against ReDySim's results in tests/fmi."""
    model = tmp_path / "satellite.toml"
    assert main(["import", str(write(tmp_path / "s", inputs=SATELLITE, initials=SATELLITE_START)), "-o", str(model)]) == 0
    torque = [
        "--input",
        "joint{}.tau=3*sin(t)",
        "joint{}.tau=-2",
        "--output",
        "joint*.q",
        "--stop",
        "2",
        "--step",
        "0.1",
        "--tolerance",
        "1e-9",
    ]
    ends = []
    for file, first in ((model, 2), (Path(__file__).parents[2] / "models" / "space_robot.toml", 1)):
        out = tmp_path / f"{file.stem}.csv"
        assert main(["simulate", str(file), *(word.format(first + (word[-1] != ")")) for word in torque), "--csv", str(out)]) == 0
        ends.append(np.genfromtxt(out, delimiter=",", skip_header=1)[-1, 1:])
    assert np.abs(ends[0] - [0.3803, -0.6198, 1.2867]).max() > 0.5
    assert ends[0] == pytest.approx(ends[1], abs=1e-5)  # at the file's own tolerance


def test_a_base_in_space_starts_as_its_angles_say(tmp_path):
    start = SATELLITE_START.replace("q = [0; 0; 0; 0; 0; 0]", "q = [1; 2; 3; 0.4; -0.5; 0.6]").replace(
        "dq = zeros(6,1)", "dq = [4; 5; 6; 0.7; 0.8; -0.9]"
    )
    base = imported(write(tmp_path / "s", inputs=SATELLITE.replace("nq = 0", "nq = 1"), initials=start)).links[0]
    assert (base.joint, base.drive, base.q, base.qd[:3]) == ("free", "free", [1, 2, 3, 0.4, -0.5, 0.6], [4, 5, 6])

    def turn(time):
        phi, theta, psi = np.array([0.4, -0.5, 0.6]) + time * np.array([0.7, 0.8, -0.9])
        return rotation_z(phi) @ rotation_x(theta) @ rotation_y(psi)

    slope = turn(0).T @ (turn(1e-5) - turn(-1e-5)) / 2e-5
    assert base.qd[3:] == pytest.approx([slope[2, 1], slope[0, 2], slope[1, 0]], abs=1e-9)
    with pytest.raises(UserError, match="'y0' must have 2 \\(n \\+ 5\\) \\+ 1 = 19 entries"):
        imported(write(tmp_path / "t", inputs=SATELLITE, initials=start.replace("dth; 0]", "dth; 0; 0]")))
    assert "two 3-link arms" in said(imported(tmp_path / "s"))


@needs_library
def test_a_four_bar_on_a_satellite(tmp_path, capsys):
    text = """n = 4; nq = 0; type = 1; dof = 4; alp = zeros(4,1); a = [0 0.4475 1.152 -0.4475 0]; b = zeros(5,1); bt = [0 1 2 1]; aj = [0 0 1];
    dx = [0 0.576 0.576 0.19]; dy = zeros(4,1); dz = zeros(4,1); m = [500 10 10 10]; g = [0 0 0];
    Icxx = [83.61 0.01 0.01 0.01]; Icyy = [83.61 1.05 1.05 1.05]; Iczz = Icyy; y0 = [0 0 0 0 0 0 2.1572 1.9687 3.1416 0 0 0 0 0 0 0 0 0 0];
    """
    model = tmp_path / "s.toml"
    assert main(["import", str(write(tmp_path / "s", inputs=text)), "--loop", "link3:1.152,0,0=link4:0.38,0,0", "-o", str(model)]) == 0
    assert "violates loop1 by 0.0" in capsys.readouterr().err
    assert [link.hold for link in imported(tmp_path / "s", ["link3:1.152,0,0=link4:0.38,0,0"]).links] == [False, False, False, True]
    assert main(["simulate", str(model), "--stop", "0.1"]) == 0


def test_a_range_may_stand_in_parentheses(tmp_path):
    text = GRIPPER.replace("m = [0.4 0.2 0.2 0.2];", "m = (1:n)';").replace("dx = al/2;", "dx = 0.1*(3:-1:0)';")
    links = imported(write(tmp_path / "x", inputs=text)).links
    assert [link.mass for link in links] == [1, 2, 3, 4]
    assert [link.com[0] for link in links] == pytest.approx([0.3, 0.2, 0.1, 0], abs=1e-16)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("m = [0.4 0.2 0.2 0.2];", "", "m' is undefined"),
        ("m = [0.4 0.2 0.2 0.2];", "m = [0.4 0.2];", "inputs.m:15: 'm' has 2 entries; n = 4 are required"),
        ("m = [0.4 0.2 0.2 0.2];", "m = [0.4 -0.2 0.2 0.2];", "inputs.m:15: 'm' entry 2 must be >= 0, got -0.2"),
        ("bt = [0 1 2 1];", "bt = [0 3 2 1];", "inputs.m:12: 'bt' has cyclic parent references: link2, link3"),
        ("bt = [0 1 2 1];", "bt = [0 1 2 9];", "inputs.m:12: 'bt' entry 4 must be the number of another link"),
        ("g = [0 ; -9.81 ; 0];", "", "'g' is missing"),
        ("g = [0 ; -9.81 ; 0];", "g = [0 ; -9.81];", "inputs.m:16: 'g' must be a vector of 3 numbers"),
        ("dx = al/2;", "dxx = al/2;", "'dx' is missing; did you mean 'dxx'?"),
        ("dx = al/2;", "dx = all/2;", "inputs.m:14: 'all' is undefined; did you mean 'al'?"),
        ("dx = al/2;", "dx = al(9);", "inputs.m:14: index 9 exceeds the 4 elements of 'al'"),
        ("dx = al/2;", "dx = [al/2 1];", "the rows of the matrix differ in length"),
        ("dx = al/2;", "dx = al/0;", "inputs.m:14: the result is not a finite real number"),
        ("dx = al/2;", "dx = [al(1;", "inputs.m:14"),
        ("dx = al/2;", "dx = __import__('os');", "inputs.m:14"),
        ("dx = al/2;", "dx = system('ls');", "inputs.m:14"),
        ("dx = al/2;", "while 1", "unsupported statement 'while'"),
        ("dx = al/2;", "for i = 1:3", "a 'for' without 'end'"),
        ("dx = al/2;", "dx = zeros(1e6, 1e6);", "is not supported"),
        ("dx = al/2;", "dx(1e9) = 1;", "an index of 'dx'"),
        ("dx = al/2;", "for i = 1:1e9 \n end", "a range of more than"),
        ("dx = al/2;", "dx = " + "(" * 400 + "1" + ")" * 400 + ";", "nested too deeply"),
        ("r = [1;1;1;1];", "r = [1;2;1;1];", "'r' entry 2 must be 1 (revolute) or 0 (prismatic), got 2"),
        ("n = 4;", "n = 4.5;", "'n' must be an integer, got 4.5"),
    ],
)
def test_mistakes(tmp_path, old, new, sentence):
    assert old in GRIPPER
    with pytest.raises(UserError) as error:
        imported(write(tmp_path / "x", inputs=GRIPPER.replace(old, new, 1)))
    assert sentence in str(error.value) and "inputs.m" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("loop", "pivot", "sentence"),
    [
        (["link1=link9"], [], "unknown link 'link9'; did you mean"),
        (["link1:1,2=link3"], [], "a point must be three numbers in m"),
        (["link1"], [], "is not a loop"),
        ([LOOP], ["link3=0,0,0"], "the parent of 'link3' is 'link2', not ground"),
        ([LOOP], ["lnk1=0,0,0"], "did you mean 'link1'?"),
        (["missing.toml"], [], "cannot read 'missing.toml'"),
    ],
)
def test_mistakes_in_loops(tmp_path, loop, pivot, sentence):
    with pytest.raises(UserError) as error:
        imported(write(tmp_path / "x", inputs=FOUR_BAR), loop, pivot)
    assert sentence in str(error.value)


def values(tmp_path, text):
    path = tmp_path / "t.m"
    path.write_text(text, encoding="utf-8")
    return {name: array.tolist() for name, array in matlab_reader.read_values(path).arrays.items()}


def test_the_grammar(tmp_path):
    found = values(
        tmp_path,
        """
      a = [1 -2]; b = [1 - 2]; c = [1 , -2 3]; d = [1
      2];  e = a'; f = [a; 3 4]; g = f(2,1); h = f(2, 1:2); k = -2^2; l = 2^-1;
      model.l1 = 0.3; m = model.l1*sin(pi/6); n = sum([1 2 3])/numel(a); o(2,3) = 7; p = a(end); q = 1e3 + 1.5d-3; s = [a(1) -a(2)];
      t = [1, ...
           2]; for i = 3:2, u = 1; end
      for (i = 1:3) v(i) = i^2; end
      %{
      w = 1;
      %}
      x = 5 % y = 6
      z = [1 2].';
    """,
    )
    assert found == {
        "a": [[1, -2]], "b": [[-1]], "c": [[1, -2, 3]], "d": [[1], [2]], "e": [[1], [-2]], "f": [[1, -2], [3, 4]], "g": [[3]], "h": [[3, 4]], "k": [[-4]],
        "l": [[0.5]], "model.l1": [[0.3]], "m": [[pytest.approx(0.15)]], "n": [[3]], "o": [[0, 0, 0], [0, 0, 7]], "p": [[-2]], "q": [[1000.0015]],
        "s": [[1, 2]], "t": [[1, 2]], "i": [[3]], "v": [[1, 4, 9]], "x": [[5]], "z": [[1], [2]],
    }  # fmt: skip


def element(kind, data):
    return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


def matrix(name, array, kind=6, data_type=9, code="<f8"):
    array = np.atleast_2d(array)
    body = element(6, struct.pack("<II", kind, 0)) + element(5, struct.pack("<ii", *array.shape)) + element(1, name.encode())
    return element(14, body + element(data_type, array.astype(code).tobytes(order="F")))


def mat_file(path, parts, compressed=False):
    if compressed:
        parts = [struct.pack("<II", 15, len(zlib.compress(part))) + zlib.compress(part) for part in parts]
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124, b" ") + struct.pack("<H", 0x0100) + b"IM" + b"".join(parts))
    return path


@pytest.mark.parametrize("compressed", [False, True])
def test_mat_files(tmp_path, compressed):
    source = imported(write(tmp_path / "text", inputs=GRIPPER), name="g")
    arrays = matlab_reader.read_values(tmp_path / "text" / "inputs.m").arrays
    parts = [matrix(name, array) for name, array in arrays.items() if name != "bt"]
    # integers are stored small, and as a column or a row
    parts.append(matrix("bt", arrays["bt"].T, kind=9, data_type=2, code="u1"))
    folder = tmp_path / "mat"
    folder.mkdir()
    draft = imported(mat_file(folder / "inputs.mat", parts, compressed), name="g")
    assert model_text(draft).replace("mat/inputs.mat", "text/inputs.m") == model_text(source)


def test_scipy_writes_the_same(tmp_path):
    scipy_io = pytest.importorskip("scipy.io")
    content = {
        "n": 4,
        "bt": np.array([[0, 1, 2]], dtype=np.int16),
        "x": np.array([[1.5, 2], [3, 4]]),
        "s": {"gx": 1.0, "t": "text"},
        "word": "text",
    }
    for compressed in (False, True):
        scipy_io.savemat(tmp_path / "a.mat", content, do_compression=compressed)
        found = matlab_file.read_values(tmp_path / "a.mat").arrays
        assert {name: array.tolist() for name, array in found.items()} == {
            "n": [[4]],
            "bt": [[0, 1, 2]],
            "x": [[1.5, 2], [3, 4]],
            "gx": [[1]],
        }


def stored(folder, text, **more):
    """A folder of the GUI release: the values in inputs.mat, and inputs.m that loads them into a struct."""
    folder.mkdir(exist_ok=True)
    (folder / "values.m").write_text(text, encoding="utf-8")
    found = matlab_reader.read_values(folder / "values.m")
    (folder / "values.m").unlink()
    mat_file(folder / "inputs.mat", [matrix(name, array) for name, array in sorted(found.arrays.items())], compressed=True)
    fields = "".join(f"{name} = stored.{name};\n" for name in found.outputs)
    load = f"function [{' '.join(found.outputs)}]=inputs()\nstored = load ('inputs.mat');\n{fields}end"
    write(folder, **({"inputs": load} | more))
    return folder


def test_the_gui_release_loads_its_values(tmp_path):
    plain = write(tmp_path / "g", inputs=GRIPPER, initials=GRIPPER_START).parent
    text = model_text(imported(plain))
    # a struct, the workspace, a command; without the name's ending, some of the variables
    loads = ("load('inputs.mat');", "load inputs.mat", "load inputs", 'load("inputs.mat", "n", "bt"); load inputs;')
    header = GRIPPER[: GRIPPER.index("%")]
    folders = [stored(tmp_path / "s" / "g", GRIPPER, initials=GRIPPER_START) if (tmp_path / "s").mkdir() is None else None]
    for i, load in enumerate(loads):
        (tmp_path / f"w{i}").mkdir()
        folders.append(stored(tmp_path / f"w{i}" / "g", GRIPPER, initials=GRIPPER_START, inputs=header + load))
    for folder in folders:
        assert model_text(imported(folder)) == text
        # the .mat itself holds names, but no order of results
        assert model_text(imported(folder / "inputs.mat")) == text.replace("inputs.m ", "inputs.mat ", 1)


@pytest.mark.parametrize(
    ("load", "sentence"),
    [
        ("s = load('other.mat');", "inputs.m:2: load: 'other.mat' does not exist in the folder of this file"),
        ("s = load(name);", "inputs.m:2: load: 'name.mat' does not exist in the folder of this file"),
        ("s = load(['a' 'b']);", "inputs.m:2: load requires the name of a .mat file"),
        ("s = load('inputs.mat'); n = s.nn;", "inputs.m:2: 's.nn' is undefined; did you mean 's.n'?"),
    ],
)
def test_mistakes_in_load(tmp_path, load, sentence):
    folder = stored(tmp_path / "g", GRIPPER, inputs=f"function [n] = inputs()\n{load}\n")
    with pytest.raises(UserError) as error:
        imported(folder)
    assert sentence in str(error.value)


BASE_ONLY = SATELLITE_START.replace("y0 = [q; th; dq; dth; 0]", "y0 = [q; dq; 0]").replace(
    "q = [0; 0; 0; 0; 0; 0]", "q = [1; 2; 0; 0.3; 0; 0]"
)
CYCLOID = """
function [th_d dth_d ddth_d] = trajectory(t, n, tf)
first = [0.1; 0.2; 0.3]; last = [pi; 0; -pi];
for i = 1:n-1
  x(i,1) = first(i) + (last(i) - first(i))/tf*(t - tf/(2*pi)*sin(2*pi/tf*t)) + 0*tf;
  v(i,1) = tf/10 + t;
end
th_d = x; dth_d = v; ddth_d = zeros(n-1, 1);
"""


def test_an_inverse_demo_holds_the_base_only(tmp_path):
    """Its joints start where the trajectory does."""
    folder = write(tmp_path / "s", inputs=SATELLITE, initials=BASE_ONLY, trajectory=CYCLOID).parent
    base, *arm = imported(folder).links
    assert (
        base.q == [1, 2, 0.3]
        and [link.q for link in arm] == pytest.approx([0.1, 0.2, 0.3])
        and [link.qd for link in arm] == pytest.approx([3, 3, 3])
    )
    assert "the joints start at the initial values of trajectory.m" in said(imported(folder))
    legged = CYCLOID.replace("th_d = x; dth_d = v", "th_d = [0; x]; dth_d = [0; v]")
    assert [link.q for link in imported(write(tmp_path / "s", trajectory=legged).parent).links[1:]] == pytest.approx([0.1, 0.2, 0.3])
    for text, reason in (
        ("function x = trajectory(t)\nwhile t > 0\nend\n", "trajectory.m:2: unsupported statement 'while'"),
        ("function x = trajectory(t)\nx = t;\n", "trajectory.m does not return 3 joint positions and rates"),
        ("function [x v] = trajectory(t)\nx = t;\n", "trajectory.m does not assign 'v'"),
        ("function [x v] = trajectory(t)\n[x v] = trajectory(t);\n", "trajectory.m: the function 'trajectory' calls itself"),
    ):
        draft = imported(write(tmp_path / "s", trajectory=text).parent)
        assert draft.links[0].q == [1, 2, 0.3] and [link.q for link in draft.links[1:]] == [0, 0, 0]
        assert f"and the joints start at 0: {reason}" in said(draft)


LEGGED_START = """
function [yo, t_initial, t_final, incr, rtol, atol, type] = initials()
[th, dth, x] = trajectory(0); q = [x; 0.25; 0; 0; 0; 0]; n = length(th);
yo = [q; th(2:n); zeros(6,1); dth(2:n); 0; 0; q; q]; t_initial = 0; t_final = 2; incr = 0.01;
rtol = 1e-6; atol = 1e-8; type = 1;
"""


def test_a_start_that_needs_the_trajectory(tmp_path):
    """It costs the start values, never the robot; the results have other names in the legged release."""
    text = SATELLITE.replace("nq = 0;", "nq = 1; g_prop = [2000 1 4.5 0.7 1000 2 1 3];")
    folder = stored(tmp_path / "s", text.replace("Iczx] =", "Iczx g_prop] ="), initials=LEGGED_START)
    draft = imported(folder)
    assert draft.solver == {"method": "bdf", "rtol": 1e-6, "atol": 1e-8} and draft.fmu == {"stop_time": 2, "step_size": 0.01}
    assert [link.q for link in draft.links] == [[0] * 6, 0, 0, 0]
    assert "initials.m:3: unknown function 'trajectory': trajectory.m does not exist in the folder of this file" in said(draft)
    assert "no start values (y0) found: the base starts at the origin" in said(draft) and str(tmp_path) not in said(draft)
    gait = "function [th, dth, x, xx] = trajectory(s)\nth = [0; 1; 2; 3] + s; dth = ones(4, 1); x = helper(2);\nfunction y = helper(z)\ny = z;\n"
    write(folder, trajectory=gait, helper="function y = helper(z)\ny = z/4;\n")
    draft = imported(folder)
    assert [link.q for link in draft.links] == [[0.5, 0.25, 0, 0, 0, 0], 1, 2, 3] and "trajectory" not in said(draft).replace(
        "trajectory.m (", ""
    )
    # a value that was there before a statement that fails is not taken for the result
    write(folder, initials=LEGGED_START.replace("[th, dth, x] =", "yo = zeros(22, 1); th = yo; [th, dth, x, y, z] ="))
    assert "returns 4 results, 5 are requested" in said(imported(folder)) and imported(folder).links[1].q == 0


def test_start_values_with_one_unknown_element_are_omitted(tmp_path):
    lines = "y0 = zeros(9,1); y0(1) = fzero(2);\ny0(2) = 0.5; y0(9) = 0;"
    folder = stored(tmp_path / "g", GRIPPER, initials=GRIPPER_START.replace("y0 = [q; dq; 0];", lines))
    draft = imported(folder)
    assert [link.q for link in draft.links] == [0, 0, 0, pytest.approx(math.pi / 2)]
    assert "unknown function 'fzero'" in said(draft) or "'fzero' is undefined" in said(draft)
    assert "no start values (y0) found" in said(draft)
    # a later complete assignment counts
    write(folder, initials=GRIPPER_START.replace("y0 = [q; dq; 0];", f"{lines} y0 = [q; dq; 0]; y0(2) = 0.25;"))
    assert [link.q for link in imported(folder).links] == [0, 0.25, 0, pytest.approx(math.pi / 2)]


def test_damaged_mat_files(tmp_path):
    good = mat_file(tmp_path / "a.mat", [matrix("n", [[4]]), matrix("bt", [[0, 1]])]).read_bytes()
    for cut in range(1, len(good) - 128, 3):
        (tmp_path / "b.mat").write_bytes(good[:-cut])
        try:
            matlab_file.read_values(tmp_path / "b.mat")
        except UserError as error:
            assert "damaged" in str(error)
    for content, sentence in ((b"", "not a MATLAB level 5"), (b"\x89HDF" + b" " * 200, "7.3")):
        (tmp_path / "b.mat").write_bytes(content)
        with pytest.raises(UserError, match=sentence):
            matlab_file.read_values(tmp_path / "b.mat")


def test_random_text_never_breaks_the_reader(tmp_path):
    rng = np.random.default_rng(0)
    words = [
        "a",
        "b(1)",
        "=",
        "[",
        "]",
        "(",
        ")",
        ";",
        ",",
        "\n",
        "1",
        "-",
        "+",
        "*",
        "/",
        "'",
        "for",
        "end",
        ":",
        "i",
        "...",
        "%",
        "sum",
        "function",
        "@",
        "{",
        "}",
    ]
    path = Path(tmp_path / "t.m")
    for _ in range(2000):
        path.write_text(" ".join(rng.choice(words, 12)), encoding="utf-8")
        try:
            matlab_reader.read_values(path)
        except UserError as error:
            assert str(error).startswith(str(path))
