"""Contact through the FMU: closed forms, laws of energy, steps that meet a contact, refusals."""

from __future__ import annotations

import ctypes as c
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from build_fmu.report.sweep import METHODS
from tests.command_line import command
from tests.fmi.raw import OK, Slave

G = 9.81

DROP = """
name = "drop"
gravity = [0, 0, {gravity}]
[[link]]
name = "mass"
joint = "prismatic"
mass = 1
q = {q}
qd = {qd}
drive = "free"
[[contact]]
name = "floor"
link_a = "mass"
{shape}
stiffness = 1e5
width = {width}
damping = {damping}
outputs = ["force", "depth", "point", "slip", "torque"]
[solver]
method = "{method}"
rtol = {rtol}
atol = {atol}
"""

BODY = """
name = "body"
gravity = [{g_x}, 0, {g_z}]
[[link]]
name = "body"
joint = "free"
mass = 2
inertia = {inertia}
q = {q}
qd = {qd}
drive = "free"
[[contact]]
name = "floor"
link_a = "body"
{shape}
{law}
outputs = ["force", "depth", "point", "slip", "torque"]
[[frame]]
name = "center"
link = "body"
port = "ground"
outputs = ["pose", "velocity"]
[solver]
method = "{method}"
rtol = {rtol}
atol = {atol}
"""

POINT = 'shape_a = "points"\npoints_a = [[0, 0, 0]]'
SPHERE = 'shape_a = "sphere"\nradius_a = 0.1'


def drop(**values) -> str:
    fields = {"gravity": -G, "q": 0.5, "qd": 0, "shape": POINT, "width": 1e-4, "damping": 0, "method": "erk", "rtol": 1e-12, "atol": 1e-14}
    return DROP.format(**{**fields, **values})


def body(**values) -> str:
    fields = {
        "g_x": 0,
        "g_z": -G,
        "inertia": [0.008, 0.008, 0.008],
        "q": [0, 0, 0.5, 1, 0, 0, 0],
        "qd": [0, 0, 0, 0, 0, 0],
        "shape": SPHERE,
        "law": "stiffness = 1e5",
        "method": "auto",
        "rtol": 1e-8,
        "atol": 1e-10,
    }
    return BODY.format(**{**fields, **values})


@pytest.fixture
def slave(built, instance):
    """Returns a function: text of a model and tables beside it -> an initialised instance."""
    return lambda text, **tables: instance(built(text, **tables)).initialize()


def refused(tmp_path, text: str) -> str:
    (tmp_path / "model.toml").write_text(text)
    done = command("check", tmp_path / "model.toml")
    assert done.returncode == 1
    return done.stdout + done.stderr


# --- closed forms ---


@pytest.mark.parametrize(("width", "height"), [(1e-4, 0.485558969824437), (1e-9, 0.485507947197677)])
@pytest.mark.parametrize("method", METHODS)
def test_an_elastic_bounce_in_one_step(slave, method, width, height):
    one = slave(drop(width=width, method=method))
    assert one.step(0, 2.0) == OK
    # dirk: stages on both sides of a bend of 1e-9 m, 3e-11 to 2.4e-8 m at rtol 0.9e-12 to 1.1e-12
    bound = 1e-7 if (method, width) == ("dirk", 1e-9) else 1e-9
    assert one.get("mass.q") == pytest.approx(height, abs=bound)


@pytest.mark.parametrize("width", [1e-4, 1e-2])
def test_the_restitution_of_a_lossy_bounce(slave, width):
    """(1 + b^2)^1.5 + b^3 = (1 + a^2)^1.5 - a^3 with a = 0.2, b = a e: e = 0.882557480734 for any stiffness and width."""
    one = slave(drop(gravity=0, q=0.1, qd=-1, damping=0.2, width=width))
    assert one.step(0, 0.5) == OK
    assert one.get("mass.qd") == pytest.approx(0.882557480734, abs=1e-9)
    assert abs(one.get("energy.balance")) < 1e-9


def test_a_sphere_slides_then_rolls(slave):
    k, weight, width = 1e5, 2 * G, 1e-4
    depth = weight / k + width / 2
    law = f"stiffness = {k}\nwidth = {width}\nfriction = 0.3\nfriction_velocity = 1e-2"
    one = slave(body(q=[0, 0, 0.1 - depth, 1, 0, 0, 0], qd=[3, 0, 0, 0, 0, 0], law=law, rtol=1e-10, atol=1e-12))
    assert one.step(0, 2.0) == OK
    arm = 0.1 - depth / 2
    mu = lambda slip: 0.3 * math.tanh(4 * slip / 1e-2)
    slope = lambda _, y: [-mu(y[0]) * G * (1 + arm**2 / (0.4 * 0.1**2)), -mu(y[0]) * G, y[1]]
    truth = solve_ivp(slope, (0, 2), [3, 3, 0], rtol=1e-12, atol=1e-14, method="DOP853").y[:, -1]
    assert one.get("center.position[1]") == pytest.approx(truth[2], abs=1e-8)
    assert one.get("center.velocity[1]") == pytest.approx(truth[1], abs=1e-8)
    assert abs(one.get("floor.slip")) < 1e-8


@pytest.mark.parametrize("part", [0.5, 0.9])
def test_a_block_on_an_incline_creeps(slave, part):
    """Below the angle of friction: v = friction_velocity artanh(part) / 4."""
    mu, v = 0.4, 1e-3
    angle = math.atan(part * mu)
    box = 'shape_a = "box"\nsize_a = [0.2, 0.2, 0.1]'
    law = f"stiffness = 1e6\ndamping = 2\nfriction = {mu}\nfriction_velocity = {v}"
    one = slave(body(g_x=G * math.sin(angle), g_z=-G * math.cos(angle), q=[0, 0, 0.05, 1, 0, 0, 0], shape=box, law=law, method="bdf"))
    assert one.step(0, 2.0) == OK
    assert one.get("center.velocity[1]") == pytest.approx(v * math.atanh(part) / 4, abs=1e-9)


def test_rolling_resistance_stops_a_sphere(slave):
    law = "stiffness = 1e5\nfriction = 0.5\nfriction_velocity = 1e-2\nrolling = 0.001\nspin_velocity = 0.1\ntorsion = 0.002"
    one = slave(body(q=[0, 0, 0.0998, 1, 0, 0, 0], qd=[1, 0, 0, 0, 10, 5], law=law))
    assert one.step(0, 0.5) == OK
    # rolling: 7/5 m a = -N rolling / r; pivoting: I alpha = -N torsion
    assert one.get("center.velocity[1]") == pytest.approx(1 - 0.5 * 5 / 7 * G * 0.001 / 0.1, abs=2e-3)
    assert one.get("center.angular_velocity[3]") == pytest.approx(5 - 0.5 * 2 * G * 0.002 / 0.008, abs=2e-2)


# --- all shapes ---

HEIGHTS = "\n".join(",".join(f"{0.03 * math.sin(0.9 * i) * math.cos(0.7 * j):.17g}" for i in range(12)) for j in range(12))
MAP = 'shape_b = "heightmap"\nfile = "ground.csv"\nspacing = 0.2\npoint_b = [-1, -1, 0]'
SHAPES = {
    "points": 'shape_a = "points"\npoints_a = [[0.1, 0, 0], [-0.1, 0.05, 0], [0, -0.1, 0.02]]',
    "sphere": SPHERE,
    "capsule": 'shape_a = "capsule"\nradius_a = 0.05\npoint_a = [-0.1, 0, 0]\npoint_a2 = [0.1, 0.02, 0]',
    "box": 'shape_a = "box"\nsize_a = [0.2, 0.15, 0.1]\nrpy_a = [0.1, 0.2, 0.3]',
    "disk": 'shape_a = "disk"\nradius_a = 0.1\ntube_a = 0.02\naxis_a = [0, 1, 0.2]',
    "on sphere": SPHERE + '\nshape_b = "sphere"\npoint_b = [0, 0, -1]\nradius_b = 1',
    "on capsule": SPHERE + '\nshape_b = "capsule"\npoint_b = [-1, 0, -0.2]\npoint_b2 = [1, 0.1, -0.2]\nradius_b = 0.2',
    "on box": SPHERE + '\nshape_b = "box"\npoint_b = [0, 0, -0.1]\nsize_b = [2, 2, 0.2]',
    "box on box": 'shape_a = "box"\nsize_a = [0.2, 0.15, 0.1]\nshape_b = "box"\npoint_b = [0, 0, -0.1]\nsize_b = [2, 2, 0.2]',
    "sphere on map": SPHERE + "\n" + MAP,
    "disk on map": 'shape_a = "disk"\nradius_a = 0.1\ntube_a = 0.02\naxis_a = [0, 1, 0.2]\n' + MAP,
}
LAW = "stiffness = 2e4\nwidth = 1e-3\ndamping = 1\nfriction = 0.5\nstatic_friction = 0.7\nfriction_velocity = 0.05\nrolling = 1e-3\ntorsion = 1e-3"


@pytest.mark.parametrize("shape", SHAPES)
def test_energy_is_balanced(slave, shape):
    one = slave(body(shape=SHAPES[shape], law=LAW, q=[0, 0, 0.3, 0.9, 0.1, 0.3, 0.3], qd=[0.3, -0.2, 0, 1, 2, -1]), ground=HEIGHTS)
    touched = 0.0
    for k in range(100):
        assert one.step(k * 0.01, 0.01) == OK, one.errors
        touched = max(touched, one.get("floor.force[3]"))
    assert touched > 10
    assert abs(one.get("energy.balance")) < 100 * 1e-8 * (one.get("energy.kinetic") + 2 * G)


CREST = "\n".join(",".join(f"{0.1 * math.exp(-(((i - 10) / 1.5) ** 2)):.17g}" for i in range(21)) for _ in range(3))


@pytest.mark.parametrize("method", METHODS)
def test_a_wheel_falls_on_a_flank(slave, method):
    """Its lowest point does not jump, also where the hub is as far from the slope below it as from the highest point of the map."""
    shape = 'shape_a = "disk"\nradius_a = 0.3\naxis_a = [0, 1, 0]\nshape_b = "heightmap"\nfile = "crest.csv"\nspacing = 0.1\npoint_b = [-1, -0.1, 0]'
    state = {"q": [-0.08, 0, 0.45, 1, 0, 0, 0], "qd": [0, 0, -5, 0, 0, 0]}
    one = slave(body(shape=shape, law="stiffness = 2e4\nwidth = 1e-3", method=method, rtol=1e-9, **state), crest=CREST)
    deepest = 0.0
    for k in range(100):
        assert one.step(k * 0.001, 0.001) == OK, one.errors
        deepest = max(deepest, one.get("floor.depth"))
    assert deepest > 0.03
    assert abs(one.get("energy.balance")) < 1e-6 * one.get("energy.kinetic")


def test_the_resultant_acts_on_the_body(slave):
    """Force and torque about the origin of link_a are the rates of its momentum."""
    one = slave(
        body(shape=SHAPES["box"], law=LAW, q=[0.2, 0.1, 0.05, 0.9, 0.1, 0.3, 0.3], qd=[0.3, -0.2, 0, 1, 2, -1], inertia=[0.01, 0.02, 0.03])
    )
    force = np.array([one.get(f"floor.force[{k}]") for k in (1, 2, 3)])
    acceleration = np.array([one.get(f"body[{k}].qdd") for k in (1, 2, 3)])
    assert force == pytest.approx(2 * (acceleration + [0, 0, G]), rel=1e-12)
    assert np.linalg.norm(force) > 1


# --- steps ---


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("step", [0.5, 1.0])
def test_no_step_passes_a_thin_wall(slave, method, step):
    """A point at 20 m/s meets a sphere of 2 mm: free flight would take one step across it."""
    text = drop(gravity=0, q=5, qd=-20, method=method, rtol=1e-6, atol=1e-8)
    text = text.replace(POINT, 'shape_a = "sphere"\nradius_a = 1e-3\nshape_b = "sphere"\nradius_b = 1e-3').replace("1e5", "1e9")
    one = slave(text)
    assert one.step(0, step) == OK
    assert one.get("mass.qd") == pytest.approx(20, rel=1e-3)


RIDGE = "\n".join(",".join(f"{0.5 * math.exp(-((0.05 * (j - 20) / 0.05) ** 2)):.17g}" for j in range(41)) for _ in range(3))


@pytest.mark.parametrize("method", METHODS)
def test_no_step_passes_a_ridge_of_a_height_map(slave, method):
    """A sphere flies level from one valley to the next in one step; both ends are far above the ground and move along it."""
    shape = SPHERE.replace("0.1", "0.01") + '\nshape_b = "heightmap"\nfile = "ground.csv"\nspacing = 0.05\npoint_b = [-1, -0.05, 0]'
    one = slave(
        body(g_z=0, q=[-0.9, 0, 0.45, 1, 0, 0, 0], qd=[10, 0, 0, 0, 0, 0], shape=shape, law="stiffness = 1e7", method=method, rtol=1e-6),
        ground=RIDGE,
    )
    assert one.step(0, 0.18) == OK
    assert one.get("center.velocity[1]") < -9
    assert abs(one.get("energy.balance")) < 1e-2


PLATES = """
name = "plates"
gravity = [0, 0, 0]
[[link]]
name = "body"
joint = "free"
mass = 1
inertia = [0.05, 0.05, 0.05]
q = [{position}, 1, 0, 0, 0]
qd = [{velocity}, 0, 0, 0]
[[link]]
name = "plate"
parent = "ground"
joint = "free"
mass = 1
inertia = [0.05, 0.05, 0.05]
qd = [0, 0, 0, {spin}]
[[contact]]
name = "edge"
link_a = "body"
shape_a = "sphere"
radius_a = 0.001
link_b = "plate"
shape_b = "box"
size_b = [1, 0.01, 0.01]
stiffness = 1e6
[solver]
method = "{method}"
"""


@pytest.mark.parametrize("method", METHODS)
def test_no_step_passes_a_body_that_turns_slowly(slave, method):
    """Seen from the turning plate the path is curved, so that tangents of the distance at both ends do not bound it."""
    for x in (-0.3, 0.3):
        one = slave(PLATES.format(position=f"{x}, -1, 0.002", velocity="0, 1, 0", spin="0, 0, 0.4", method=method))
        assert one.step(0, 2.0) == OK
        assert abs(one.get("body[2].qd") - 1) > 0.1, x


@pytest.mark.parametrize("method", METHODS)
def test_no_step_passes_a_spinning_body(slave, method):
    """A sphere flies along the axis of spin and meets the rod after nearly five turns."""
    axis, across, spin, speed, meeting = np.array([0, 0.6, 0.8]), np.array([0, 0.8, -0.6]), 30, 5, 1
    start = 0.3 * (np.array([math.cos(spin * meeting), 0, 0]) + math.sin(spin * meeting) * across) - speed * meeting * axis
    show = lambda vector: ", ".join(map(str, vector.tolist()))
    one = slave(PLATES.format(position=show(start), velocity=show(speed * axis), spin=show(spin * axis), method=method))
    assert one.step(0, 2.0) == OK
    assert abs(one.get("body[3].qd") - speed * axis[2]) > 0.1


def test_free_flight_keeps_long_steps(slave):
    one = slave(drop(q=100, rtol=1e-6, atol=1e-8))
    assert one.step(0, 4.0) == OK
    assert one.get("solver.steps") < 20


SPINNER = """
name = "spinner"
gravity = [0, 0, 0]
[[link]]
name = "slide"
joint = "prismatic"
alpha = 1.5707963267948966
mass = 1000
qd = 0.1
q = 1.9
drive = "free"
[[link]]
name = "arm"
parent = "slide"
joint = "revolute"
alpha = -1.5707963267948966
mass = 1
inertia = [0.1, 0.1, 0.1]
qd = 50
drive = "free"
[[contact]]
name = "tip"
link_a = "arm"
shape_a = "sphere"
point_a = [1, 0, 0]
radius_a = 0.01
shape_b = "sphere"
point_b = [0, {place}, 0]
radius_b = 1e-3
stiffness = 1e8
[solver]
method = "{method}"
"""


@pytest.mark.parametrize("method", METHODS)
def test_a_spinning_arm_meets_what_comes_slowly_within_its_reach(slave, method):
    """The tip passes at 50 m/s, many turns per step before; the slide brings the sphere of 2 mm nearer for 2 s."""
    one = slave(SPINNER.format(place=-3, method=method))
    assert one.step(0, 2.5) == OK
    assert abs(one.get("arm.qd") - 50) > 1


GRAZE = """
name = "graze"
[[link]]
name = "upper"
joint = "revolute"
alpha = 0.964
mass = 0.832
com = [0.276, 0, 0.0706]
inertia = [0.02, 0.05, 0.05]
q = 1.49
qd = -1.23
[[link]]
name = "lower"
joint = "revolute"
alpha = -1.57
a = 0.4
mass = 1.76
com = [0.464, 0, 0.0172]
inertia = [0.02, 0.05, 0.05]
q = 0.416
qd = 1.58
[[contact]]
name = "wall"
link_a = "lower"
shape_a = "sphere"
point_a = [0.36, 0, 0]
radius_a = 0.02
point_b = [-0.42597, -0.43433, -0.35108]
normal_b = [0.60625, 0.61826, 0.50021]
stiffness = 1e5
damping = 0.3
[fmu]
outputs = ["energy"]
[solver]
method = "{method}"
rtol = {rtol}
"""


@pytest.mark.parametrize(("method", "rtol"), [("dirk", 1e-2), ("erk", 1e-8)])
def test_a_step_that_touches_by_a_change_of_the_acceleration_is_repeated(slave, method, rtol):
    """A step of 0.05 s of dirk passes a depth of 2 mm that constant accelerations of the joints do not reach."""
    one = slave(GRAZE.format(method=method, rtol=rtol))
    assert one.step(0, 0.76) == OK
    assert one.get("energy.contact") < 0


def test_a_contact_out_of_reach_takes_no_evaluations(slave):
    near, far = (
        slave(SPINNER.format(place=place, method="erk").replace("radius_b = 1e-3", radius))
        for place, radius in ((-30, "radius_b = 1e-3"), (-1e6, "radius_b = 1"))
    )
    for one in (near, far):
        assert one.step(0, 2.5) == OK
    assert near.get("solver.rhs_evaluations") == far.get("solver.rhs_evaluations")


@pytest.mark.parametrize("method", METHODS)
def test_a_restored_state_continues_bit_for_bit(slave, method):
    one = slave(
        body(shape=SHAPES["box"], law=LAW, q=[0, 0, 0.1, 0.9, 0.1, 0.3, 0.3], qd=[0.3, -0.2, 0, 1, 2, -1], method=method, rtol=1e-6)
    )
    names = [name for name in one.fmu.named("output") if one.fmu.variables[name][0] == "Real"]
    one.run(0.1, 0.01)
    state = one.save()
    one.run(0.2, 0.01, start=0.1)
    first = one.reals(names)
    assert one.call("SetFMUstate", state) == OK
    one.run(0.2, 0.01, start=0.1)
    assert one.reals(names) == first


@pytest.mark.parametrize("method", METHODS)
def test_the_work_of_contacts_is_a_part_of_the_work(slave, method):
    """Without drives it is all of it; its rate is the power of friction and damping."""
    one = slave(body(law=LAW, q=[0, 0, 0.0985, 1, 0, 0, 0], qd=[1, 0, 0, 0, 0, 0], method=method))
    one.run(0.04, 0.01)
    assert one.get("energy.contact") < -0.1
    assert one.get("energy.contact") == pytest.approx(one.get("energy.work"), rel=1e-6)
    asked = (c.c_uint * 2)(*(one.fmu.variables[f"energy.{name}"][1] for name in ("contact", "work")))
    rates = (c.c_double * 2)()
    assert one.call("GetRealOutputDerivatives", asked, c.c_size_t(2), (c.c_int * 2)(1, 1), rates) == OK
    assert rates[0] < 0 and rates[0] == pytest.approx(rates[1], rel=1e-12)


# --- the law of ReDySim ---


def test_the_law_of_redysim(slave):
    """One point on its way in and out: K p - C v, C a cubic on the way out, friction by axis. The velocity is that of the point itself."""
    K, Cv, v_max, mu, Ch = 2000, 2742.26, 4.5, 0.7, 1000
    text = body(shape=POINT, law=f'law = "redysim"\nK = {K}\nCv = {Cv}\nv_max = {v_max}\nmu = {mu}\nCh = {Ch}')
    for depth, rise in ((0.01, -0.3), (0.01, 0.02), (0.9e-5, -1)):
        one = slave(
            text.replace("q = [0, 0, 0.5,", f"q = [0, 0, {-depth},").replace(
                "qd = [0, 0, 0, 0, 0, 0]", f"qd = [0.2, -0.1, {rise}, 3, -4, 5]"
            )
        )
        u = depth / (1.2 * v_max * Cv / K)
        C = Cv * (u * u * (3 - 2 * u) if rise > 0 else 1)
        normal = (K * depth - C * rise) if depth >= 1e-5 else 0
        c = 2 / math.pi * mu * abs(normal)
        expected = [-c * math.atan(Ch * 0.2 / c) if c else 0, c * math.atan(Ch * 0.1 / c) if c else 0, normal]
        assert [one.get(f"floor.force[{k}]") for k in (1, 2, 3)] == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_a_touch_down_with_a_jump_of_the_force(slave, method):
    """Of ReDySim's law: free fall to a depth of 1e-5 m, then m x" = m g - Cv x' - K x, overdamped."""
    mass, K, Cv, edge, end = 2, 3000, 4000, 1e-5, 0.6
    law = f'law = "redysim"\nK = {K}\nCv = {Cv}\nv_max = 4.5\nmu = 0.7\nCh = 2000'
    one = slave(body(shape=POINT, law=law, q=[0, 0, 0.2, 1, 0, 0, 0], qd=[0.7, 0, 0, 0, 0, 0], method=method, rtol=1e-10, atol=1e-12))
    one.run(end, 0.1)
    touch = math.sqrt(2 * (0.2 + edge) / G)
    fast, slow = np.roots([mass, Cv, K])
    rest = mass * G / K
    # depth = rest + a exp(fast t) + b exp(slow t)
    a, b = np.linalg.solve([[1, 1], [fast, slow]], [edge - rest, G * touch])
    depth = rest + a * math.exp(fast * (end - touch)) + b * math.exp(slow * (end - touch))
    assert one.get("body[3].q") == pytest.approx(-depth, abs=1e-8)


# --- refusals and warnings ---


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("stiffness = 1e5", "", "stiffness is required"),
        ("stiffness = 1e5", "stiffness = -1", "stiffness must be > 0, got -1"),
        ("radius_a = 0.1", "radius_a = 0", "radius_a must be > 0, got 0"),
        ("radius_a = 0.1", "", "radius_a is required for shape 'sphere'"),
        ('"sphere"', '"spere"', "did you mean 'sphere'?"),
        ('link_a = "body"', 'link_a = "body"\nlink_b = "body"', "link_a and link_b are both 'body'"),
        (SPHERE, 'shape_a = "points"\npoints_a = []', "points_a must not be empty"),
        (SPHERE, 'shape_a = "capsule"\nradius_a = 1\npoint_a2 = [0, 0, 0]', "a capsule of length zero is a sphere"),
        (SPHERE, 'shape_a = "box"\nsize_a = [1, 0, 1]', "size_a must be three lengths > 0"),
        (SPHERE, 'shape_a = "disk"\nradius_a = 0.1\ntube_a = 0.2', "tube_a must be smaller than radius_a"),
        (SPHERE, SHAPES["capsule"] + '\nshape_b = "box"\nsize_b = [1, 1, 1]', "'box' is not supported; 'capsule' supports 'sphere', "),
        (SPHERE, 'shape_a = "spere"', "did you mean 'sphere'?"),
        (SPHERE, SPHERE + '\nlaw = "redysim"\nK = 1\nCv = 1\nv_max = 1\nmu = 1\nCh = 1', "for shape_a 'points' and shape_b 'plane' only"),
        ('"force", "depth"', '"force", "dept"', "did you mean 'depth'?"),
    ],
)
def test_bad_input_is_refused_in_one_sentence(tmp_path, old, new, sentence):
    text = body()
    assert old in text
    message = refused(tmp_path, text.replace(old, new))
    assert sentence in message and "model.toml:" in message and "contact 'floor'" in message


@pytest.mark.parametrize(
    ("heights", "sentence"),
    [
        ("1,2,3\n1,,3\n", "line 2, column 2: '' is not a finite number"),
        ("1,2,3\n1,2\n", "line 2 has 2 heights, the first row has 3"),
        ("1,2,3\n", "at least 2 rows and 2 columns"),
    ],
)
def test_height_maps_with_holes_are_refused(tmp_path, heights, sentence):
    (tmp_path / "ground.csv").write_text(heights)
    assert sentence in refused(tmp_path, body(shape=SPHERE + "\n" + MAP))


def test_a_height_map_without_spacing_is_refused_in_one_sentence(tmp_path):
    (tmp_path / "ground.csv").write_text("1,2\n3,4\n")
    message = refused(tmp_path, body(shape=SPHERE + "\n" + MAP.replace("spacing = 0.2\n", "")))
    assert "spacing is required for shape 'heightmap'" in message and "unknown field" not in message


def test_a_rigid_neighbour_is_refused(tmp_path):
    text = (
        body()
        .replace("[[contact]]", '[[link]]\nname = "cap"\njoint = "fixed"\nmass = 1\n[[contact]]')
        .replace('link_a = "body"\n', 'link_a = "body"\nlink_b = "cap"\n', 1)
    )
    assert "are rigidly connected; this contact has no effect" in refused(tmp_path, text)


def test_a_deep_start_is_warned(slave):
    heavy = '[[link]]\nname = "wagon"\nparent = "ground"\njoint = "prismatic"\nmass = 5000\n[[contact]]'
    for text in (body(q=[0, 0, -0.2, 1, 0, 0, 0]), body(q=[0, 0, -0.2, 1, 0, 0, 0]).replace("[[contact]]", heavy)):
        messages = slave(text).messages
        assert any("contact 'floor' starts 0.3 m deep, with a force of 29995 N" in text for _, _, text in messages)


@pytest.mark.parametrize(
    ("x", "z", "size", "warned"),
    [
        (0, 0.3, "[0.2, 0.2, 0.1]", True),  # dropped flush
        (0, 0.1, "[0.2, 0.2, 0.1]", True),  # stacked flush
        (0, 0.1, "[0.2, 0.1, 0.1]", True),  # flush on two sides
        (0, 0.1, "[0.1, 0.1, 0.1]", False),
        (0.00019, 0.1, "[0.2, 0.19, 0.1]", True),
        (0.0003, 0.1, "[0.2, 0.19, 0.1]", False),
        (0.01, 0.1, "[0.2, 0.19, 0.1]", False),
        (0.5, 0.1, "[0.2, 0.21, 0.1]", False),  # beside it
    ],
)
def test_corners_that_meet_an_edge_are_warned(slave, x, z, size, warned):
    shape = f'shape_a = "box"\nsize_a = {size}\nshape_b = "box"\nsize_b = [0.2, 0.2, 0.1]'
    one = slave(body(shape=shape, q=[x, 0, z, 1, 0, 0, 0]))
    assert any("a corner meets an edge of a box within 0.0001981 m" in text for _, _, text in one.messages) is warned


def test_an_unknown_link_is_one_error(tmp_path):
    said = refused(tmp_path, body().replace('link_a = "body"', 'link_a = "bdy"'))
    assert "did you mean 'body'" in said
    assert "no effect" not in said


def test_a_ball_larger_than_a_crest_meets_it_without_a_jump(built):
    """A step of 1 m within 0.5 m. Above the top its distance is that from the bound that the map's Bézier control points give.

    The spline through 0, 0, 1, 1 without slope at its ends has the B-spline coefficients 0.2, -0.4, 1.4, 0.8. The greatest control
    point of its Bézier segments is (2 * 1.4 + 0.8) / 3.
    """
    model = """name = "step"
link = [{name = "ball", joint = "free", drive = "free", mass = 1, inertia = [0.4, 0.4, 0.4], q = [0.75, 0.75, 2.3, 0, 0, 0]}]
[[contact]]
name = "c"
link_a = "ball"
shape_a = "sphere"
radius_a = 1
shape_b = "heightmap"
file = "step.csv"
spacing = 0.5
stiffness = 1e4
outputs = ["force", "depth"]
[solver]
rtol = 1e-9
"""
    names = ["c.depth", "c.force[1]", "c.force[3]", "ball[1].q", "ball[3].q", "energy.balance"]
    with Slave(built(model, step="0,0,1,1\n" * 4)) as slave:
        slave.initialize()
        top = 1.2
        for k in range(60):
            assert slave.step(0.01 * k, 0.01) == OK, slave.errors
            depth, sideways, upwards, x, z, balance = slave.reals(names)
            if z - 1 > top - 0.02:
                assert depth == pytest.approx(top - (z - 1), abs=1e-9) and sideways == 0 and (upwards > 0) == (depth > 0)
            assert abs(balance) < 1e-6
