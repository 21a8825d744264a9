"""ReDySim's example runs, and their known results: printed by ReDySim (seven digits) or computed by an independent program.

A controller of the examples becomes part of the plant where that is exact: set-point PD control is a spring and a damper in
the joint, and PD control along a trajectory is that with kp q_r(t) + kd qd_r(t) as the torque.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi

REDYSIM, INDEPENDENT = "ReDySim", "independent"


@dataclass(frozen=True)
class Known:
    """Values at one time. `digits`: that many digits of the largest one agree at least; `whole`: all seven of each one that ReDySim prints."""

    what: str
    names: tuple[str, ...]
    values: tuple[float, ...]
    time: float
    digits: int
    source: str = INDEPENDENT
    whole: bool = False
    why: str = ""  # if fewer digits agree than are printed


@dataclass(frozen=True)
class Case:
    """One run of a model's FMU (or of its inverse)."""

    example: str
    run: str
    model: str
    step: float
    known: tuple[Known, ...]
    start: dict[str, float | str] = field(default_factory=dict)
    inputs: dict[str, str] = field(default_factory=dict)
    inverse: bool = False


def joints(count: int, key: str, name: str = "joint") -> tuple[str, ...]:
    return tuple(f"{name}{i}.{key}" for i in range(1, count + 1))


def motion(start: tuple[float, ...], end: tuple[float, ...], duration: float, names: tuple[str, ...]) -> dict[str, str]:
    """ReDySim's cycloid as expressions of t for q, qd and qdd."""
    texts = {}
    for name, first, last in zip(names, start, end, strict=True):
        rate, w = f"({last - first!r})/{duration!r}", f"(2*pi/{duration!r})"
        texts[f"{name}.q"] = f"{first!r} + {rate}*(t - sin({w}*t)/{w})"
        texts[f"{name}.qd"] = f"{rate}*(1 - cos({w}*t))"
        texts[f"{name}.qdd"] = f"{rate}*{w}*sin({w}*t)"
    return texts


def follow(start: tuple[float, ...], end: tuple[float, ...], duration: float, kp: float, kd: float) -> dict[str, str]:
    """The torques kp q_r + kd qd_r of the cycloid."""
    names = tuple(f"joint{i}" for i in range(1, len(start) + 1))
    parts = motion(start, end, duration, names)
    return {f"{name}.tau": f"{kp}*({parts[f'{name}.q']}) + {kd}*({parts[f'{name}.qd']})" for name in names}


def held(target: tuple[float, ...], kp: float, kd: float) -> dict[str, float | str]:
    """Set-point PD control of every joint as spring and damper."""
    values: dict[str, float | str] = {}
    for i, rest in enumerate(target, start=1):
        values |= {f"joint{i}.stiffness": kp, f"joint{i}.rest": rest, f"joint{i}.damping": kd}
    return values


def series(
    what: str, names: tuple[str, ...], rows: dict[float, tuple[float, ...]], digits: int, source: str, whole: bool = False
) -> tuple[Known, ...]:
    return tuple(Known(what, names, values, time, digits, source, whole) for time, values in rows.items())


TURN = pi / 180
KUKA = {
    0: (0, 128.7117, 14.53612, 0, 0, 0),
    0.25: (106.0031, 209.5310, 35.72768, -8.613520e-4, -0.1753215, 1.012746e-5),
    0.5: (-39.53028, 150.3598, 21.46336, 0.1967606, -0.3236363, 6.465742e-6),
    0.75: (-74.10312, 2.827468, -8.699738, -0.2915365, -0.06236583, -3.761628e-5),
    1.0: (0, 66.78584, 9.698057, 0.1305619, 0.05428358, 0),
}
GRIPPER = {
    0: (0.8829, 0.1962, 0.04905, 0),
    0.25: (0.97437109, 0.22672515, 0.05743535, -0.00513509),
    0.5: (0.54092872, 0.03430231, -0.0107784, -0.03362433),
    0.75: (0.14881974, -0.1528396, -0.04680174, -0.0491989),
    1.0: (0.14400208, -0.15029792, -0.03757448, -0.04905),
}
COGNATE = {
    0.1: (0.6455356, 2.852351, 0.1303739, 0.8883296, 0.8044036, 5.348408, 1.935527, 6.152811, 0.9347775),
    2: (0.6526682, 2.921310, 0.02455314, 0.8514676, 0.8483982, 5.410234, 1.898665, 6.258632, 0.8729514),
}
CHAIN = (
    -0.951915321,
    0.0272881654,
    0.0335482912,
    0.0363416993,
    0.0423662217,
    0.056686452,
    0.059042592,
    0.098258145,
    0.108050947,
    0.19301046,
    0.199751007,
    0.189162276,
    -0.083880038,
    -0.0345895005,
    0.041630783,
    -0.0198704785,
    0.00645411735,
    -0.00161449217,
    3.27411193e-4,
    -5.81237964e-5,
)
BIPED = {  # positions, velocities, energies
    0.28: (
        (-0.4195917, 0.02073863, 0.8040260, -0.3844070, -1.591511, 3.141519)
        + (-1.452489e-05, -1.549543, -0.6498017, 1.202481, -0.02116204, -0.5526483),
        (-0.5639084, -0.01135105, -0.04721866, 0.6109472, 0.01125741, 3.147483e-04)
        + (-8.052610e-04, -4.557634e-03, -1.053903, -1.040622, 3.953262e-03, 2.094293),
        66.85529,
        2.520810,
    ),
    0.5: (
        (-0.5321184, 0.004882104, 0.7409941, -0.2088797, -1.575671, 3.141564)
        + (-4.476445e-5, -1.564497, -0.5321234, 0.7409934, -0.006373922, -0.2088744),
        (-0.4471314, -0.1370130, -0.6467219, 1.093729, 0.1369308, 1.134906e-04)
        + (3.269874e-04, -0.1428500, 0.4469897, 0.6469064, 0.1429610, -1.094006),
        65.62530,
        1.777973,
    ),
}
LEG = (-3.158557789, 4.063256685, -1.854666683, -0.591670424, -1.953723392, -1.953718943, -1.187881593)
LEG_JOINTS = ("crank_joint.q", "rocker_joint.q", "coupler_joint.q", "hip.q", "upper_bar_joint.q", "knee.q", "lower_bar_joint.q")
BASE = ("base[1].q", "base[2].q", "base.angle[1]")
PLANAR = ("crank_joint", "joint2", "joint3")
LOOPS = "the reference program does not project loops"
TORN = "ReDySim does not project loops; its tolerance is 1e-4"
ROUNDED = "the start pose is given with few digits; here it satisfies the loops"

PRINTED_STATE = "seven printed digits of the state"
TOLERANCE = "ReDySim's tolerance 1e-4"
FLIGHT = tuple(f"base[{i}].q" for i in (1, 2, 3))
TURNS = tuple(f"base.angle[{i}]" for i in (1, 2, 3))
ENERGIES = ("energy.potential", "energy.kinetic")


def walk(what: str, names: tuple[str, ...], rows: dict[float, tuple[float, ...]], digits: int) -> tuple[Known, ...]:
    return tuple(Known(what, names, values, time, digits, REDYSIM, why=TOLERANCE) for time, values in rows.items())


CASES = (
    Case(
        "E1 gripper",
        "inverse, cycloid in 1 s",
        "gripper_redysim",
        0.01,
        series("torques", joints(4, "tau"), GRIPPER, 7, INDEPENDENT),
        inputs=motion((0, 0, 0, 90 * TURN), (60 * TURN, 80 * TURN, 80 * TURN, 120 * TURN), 1.0, ("joint1", "joint2", "joint3", "joint4")),
        inverse=True,
    ),
    Case(
        "E1 gripper",
        "free",
        "gripper_redysim",
        0.05,
        (Known("positions", joints(4, "q"), (-2.237646666, 9.039969936, 12.052753184, 0.617542757), 1.0, 8),),
    ),
    Case(
        "E1 gripper",
        "PD along a cycloid (stiff)",
        "gripper_redysim",
        0.001,
        (Known("positions", joints(4, "q"), (1.027635516, 1.400728587, 1.397885601, 2.096846379), 1.5, 8),),
        start=held((0, 0, 0, 0), 16, 8) | {"solver.method": "bdf"},
        inputs=follow((0, 0, 0, 90 * TURN), (60 * TURN, 80 * TURN, 80 * TURN, 120 * TURN), 1.5, 16, 8),
    ),
    Case(
        "E2 KUKA KR5",
        "inverse, cycloid in 1 s",
        "kuka_kr5",
        0.01,
        series("torques", joints(6, "tau"), KUKA, 6, REDYSIM, True),
        inputs=motion((0,) * 6, (pi / 3,) * 6, 1.0, tuple(f"joint{i}" for i in range(1, 7))),
        inverse=True,
    ),
    Case(
        "E2 KUKA KR5",
        "free fall",
        "kuka_kr5",
        0.1,
        (
            Known(
                "accelerations",
                joints(6, "qdd"),
                (-4.144612897e-4, -18.38664091, 20.14824078, 0.5702649957, 8.385306827, -0.5706794570),
                0.0,
                9,
            ),
            Known("positions", joints(6, "q"), (0.04065864, -2.614181958, -1.511351762, 0.258479043, -2.429134661, 15.380385116), 1.0, 9),
        ),
    ),
    Case(
        "E3 four-bar",
        "free, assembled start pose",
        "four_bar",
        0.01,
        (
            Known("positions", tuple(f"{n}.q" for n in PLANAR), (-3.049359136, 2.716870683, 1.045587196), 1.33, 7, why=LOOPS),
            Known("velocities", tuple(f"{n}.qd" for n in PLANAR), (22.699830448, 5.089289659, 1.394078405), 1.33, 7, why=LOOPS),
            Known("start energy", ("energy.total",), (3.87657639,), 0.0, 8),
        ),
    ),
    Case(
        "E3 four-bar",
        "inverse, 45 rpm",
        "four_bar",
        0.01,
        (
            Known("drive torque", ("crank_joint.tau",), (2.65597881,), 0.0, 9),
            Known("multipliers", ("closure.lambda[1]", "closure.lambda[2]"), (3.92666554, 45.76207624), 0.0, 9),
        ),
        inputs={"crank_joint.q": "1.5*pi*t", "crank_joint.qd": "1.5*pi"},
        inverse=True,
    ),
    Case(
        "E4 Hoeken",
        "free",
        "hoeken",
        0.01,
        (
            Known(
                "positions",
                ("crank_joint.q", "rocker_joint.q", "coupler_joint.q"),
                (0.001967898, 0.984967432, 4.314381214),
                1.33,
                4,
                why=ROUNDED,
            ),
            Known("crank rate", ("crank_joint.qd",), (4.597354942,), 1.33, 3, why=ROUNDED),
        ),
    ),
    Case(
        "E6 slider-crank",
        "free, up to the singular configuration",
        "slider_crank",
        0.05,
        (
            Known("positions", ("crank_joint.q", "rod_joint.q", "slider_joint.q"), (-2.545205006, 8.232002666, 1.123314785), 0.5, 10),
            Known("velocities", ("crank_joint.qd", "rod_joint.qd", "slider_joint.qd"), (-2.183492031, 4.366984064, -3.613111226), 0.5, 9),
        ),
        start={"rod_joint.q0": 2 * pi},
    ),
    Case(
        "E7 leg",
        "PD on the crank",
        "leg",
        0.01,
        (Known("positions", LEG_JOINTS, LEG, 0.2, 4, why=ROUNDED),),
        start={"crank_joint.stiffness": 49, "crank_joint.rest": -2 * pi, "crank_joint.damping": 14},
    ),
    Case(
        "E8 2-link",
        "free",
        "planar_2r",
        0.1,
        (
            Known("positions", joints(2, "q"), (-1.980612851, -12.642230017), 3.0, 9),
            Known("velocities", joints(2, "qd"), (-12.796421288, 28.65351423), 3.0, 9),
        ),
    ),
    Case(
        "E9 3-link",
        "free",
        "planar_3r",
        0.1,
        (
            Known("positions", joints(3, "q"), (-0.853981342, 0.237917852, 0.82450831), 3.0, 9),
            Known("velocities", joints(3, "qd"), (10.255214551, -14.837898094, 7.126855389), 3.0, 9),
        ),
    ),
    Case(
        "E10 RP",
        "set-point PD",
        "rp_robot",
        0.1,
        (Known("positions", joints(2, "q"), (1.586609775, 0.301562316), 3.0, 9),),
        start=held((pi / 2, 0.3), 49, 14),
    ),
    Case(
        "E11 PPPR",
        "set-point PD (stiff)",
        "pppr",
        0.1,
        (Known("positions", joints(4, "q"), (0.103684976, 0.100005537, 0.101609512, 1.523308958), 1.0, 9),),
        start=held((0.1, 0.1, 0.1, pi / 2), 49, 14) | {"solver.method": "bdf"},
    ),
    Case(
        "E12 point masses",
        "free",
        "point_mass_pendulum",
        0.1,
        (
            Known("positions", joints(2, "q"), (0.025098876, 0.239226628), 10.0, 8),
            Known("velocities", joints(2, "qd"), (-0.197110919, 3.414232082), 10.0, 9),
            Known("start energy", ("energy.total",), (2.44566637,), 0.0, 9),
        ),
    ),
    Case(
        "E13 biped",
        "start pose of the gait",
        "biped",
        0.01,
        (Known("potential energy", ("energy.potential",), (65.62890,), 0.0, 7, REDYSIM, True),),
    ),
    *(
        Case(
            "E13 biped",
            f"state at {time:g} s of its walk",
            "biped",
            0.01,
            (
                Known("potential energy", ("energy.potential",), (potential,), 0.0, 7, REDYSIM, True),
                Known("kinetic energy", ("energy.kinetic",), (kinetic,), 0.0, 6, REDYSIM, why=PRINTED_STATE),
            ),
            start=dict(zip((*joints(12, "q0"), *joints(12, "qd0")), (*q, *qd), strict=True)),
        )
        for time, (q, qd, potential, kinetic) in BIPED.items()
    ),
    Case(
        "E14 long chain",
        "free",
        "long_chain",
        0.01,
        (
            Known("accelerations", joints(6, "qdd"), (-414.6194, 525.7163, -140.8653, 37.74473, -10.11367, 2.709950), 0.0, 7),
            Known("positions", joints(20, "q"), CHAIN, 0.2, 9),
        ),
    ),
    Case(
        "E16 quadruped",
        "walks under computed torque",
        "redysim_quadruped",
        0.01,
        walk("base", FLIGHT, {1.0: (-3.428332e-6, 0.4984817, 0.1396685), 2.0: (-3.496007e-4, 0.4983759, 0.4272040)}, 4)
        + walk("angles of the base", TURNS, {2.0: (3.371627e-4, 4.247223e-4, -6.052335e-5)}, 1)
        + walk("energies", ENERGIES, {1.0: (39.05701, 1.495753), 2.0: (39.04637, 1.494089)}, 5),
    ),
    Case(
        "E17 hexapod",
        "walks along its gait",
        "redysim_hexapod",
        0.01,
        walk(
            "base",
            FLIGHT[:2],
            {0.5: (0.1897532, 0.5495632), 1.0: (0.5678278, 0.5495941), 1.5: (0.9468271, 0.5495924), 2.0: (1.325768, 0.5495919)},
            5,
        )
        + walk("energies", ENERGIES, {2.0: (43.10939, 3.422104)}, 6)
        + (
            Known("base", FLIGHT, (1.32577061, 0.549591922, -1.31207169e-3), 2.0, 7, why="its tolerance 1e-7"),
            Known("angles of the base", TURNS, (1.06814765e-4, -2.72993370e-4, -1.32366122e-4), 2.0, 4, why="its tolerance 1e-7"),
            Known("energies", ENERGIES, (43.10939506, 3.42208913), 2.0, 7, why="its tolerance 1e-7"),
            Known("work of the ground", ("energy.contact",), (-17.78917896,), 2.0, 6, why="its tolerance 1e-7"),
        ),
    ),
    Case(
        "biped of 9 links",
        "walks along its gait",
        "redysim_small_biped",
        0.05,
        walk(
            "base up to 3.3 s",
            ("base[1].q", "base[2].q", "base[3].q"),
            {0.5: (-0.01762951, 0.1790248, -1.456872), 1.1: (0.03517939, 0.1851109, -1.557776), 3.3: (0.1796801, 0.1850449, -1.594528)},
            3,
        )
        + walk(
            "base up to 5.6 s",
            ("base[1].q", "base[2].q", "base[3].q"),
            {4.4: (0.2418908, 0.1844623, -1.572863), 5.6: (0.3412471, 0.1849976, -1.648810)},
            1,
        ),
    ),
    Case(
        "E18 satellite, 3 links",
        "PD along a cycloid",
        "space_robot",
        0.01,
        (
            Known("base at 15 s", BASE, (0.01676489, 0.03345196, 0.6370263), 15.0, 7, REDYSIM, True),
            Known("base at 30 s", BASE, (0.07182897, 0.03810805, 1.038754), 30.0, 7, REDYSIM, True),
            Known("joints at 30 s", joints(3, "q"), (-1.571413, -1.571296, -1.570901), 30.0, 6, REDYSIM, True),
        ),
        start={f"joint{i}.{key}": value for i in (1, 2, 3) for key, value in (("stiffness", 49), ("damping", 14))},
        inputs=follow((0.3803, -0.6198, 1.2867), (-pi / 2,) * 3, 30.0, 49, 14),
    ),
    Case(
        "E18 satellite, 3 links",
        "inverse, cycloid in 20 s",
        "space_robot",
        0.005,
        (
            Known(
                "base at the end",
                BASE,
                (0.07184241, 0.03819272, 1.036176),
                20.0,
                6,
                REDYSIM,
                why="the error of ReDySim's own result in the seventh digit",
            ),
            Known("base at the end", BASE, (0.07184232258, 0.0381927257, 1.036175915247), 20.0, 9),
        ),
        inputs=motion((0.3803, -0.6198, 1.2867), (-pi / 2,) * 3, 20.0, ("joint1", "joint2", "joint3")),
        inverse=True,
    ),
    Case(
        "E22 cognate mechanism",
        "spring in the crank, damped",
        "cognate",
        0.01,
        (
            Known("positions at 0.1 s", joints(9, "q"), COGNATE[0.1], 0.1, 6, REDYSIM, why=TORN),
            Known("positions at 2 s", joints(9, "q"), COGNATE[2], 2.0, 4, REDYSIM, why=TORN),
            Known(
                "positions at 0.1 s",
                joints(9, "q"),
                (0.6455373468, 2.852350578, 0.130373695, 0.8883291705, 0.8044057274, 5.348405885, 1.935526722, 6.152811612, 0.9347794224),
                0.1,
                9,
            ),
            Known("kinetic energy at 0.1 s", ("energy.kinetic",), (26.8375090638,), 0.1, 9),
        ),
    ),
)
