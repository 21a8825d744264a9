"""ReDySim's examples without a published result: figures of the dense formulation, `python -m tests.crosscheck.dense_run`."""

from __future__ import annotations

from math import acos, atan2, cos, hypot, pi, sin, sqrt

from tests.fmi.redysim_cases import CASES, LEG_JOINTS, TURN, Case, Known, follow, joints, motion

DENSE = "dense formulation"
START_GRIPPER, END_GRIPPER = (0, 0, 0, 90 * TURN), (60 * TURN, 80 * TURN, 80 * TURN, 120 * TURN)


def known(what: str, names: tuple[str, ...], rows: dict[float, tuple[float, ...]], digits: int = 9) -> tuple[Known, ...]:
    return tuple(Known(what, names, values, time, digits, DENSE) for time, values in rows.items())


def torques(example: str, model: str, first: tuple, last: tuple, duration: float, rows: dict[float, tuple[float, ...]]) -> Case:
    """Inverse dynamics of an open tree along ReDySim's cycloid."""
    count = len(first)
    inputs = motion(first, last, duration, tuple(f"joint{i}" for i in range(1, count + 1)))
    run = f"inverse, cycloid in {duration:g} s"
    return Case(example, run, model, duration / 4, known("torques", joints(count, "tau"), rows), inputs=inputs, inverse=True)


def cranked(example: str, model: str, rows: dict[float, tuple[float, ...]]) -> Case:
    """Inverse dynamics of a mechanism whose crank turns at 45 rpm."""
    inputs = {"crank_joint.q": "1.5*pi*t", "crank_joint.qd": "1.5*pi"}
    return Case(example, "inverse, 45 rpm", model, 0.01, known("drive torque", ("crank_joint.tau",), rows), inputs=inputs, inverse=True)


def platform_legs(t: float) -> list[tuple[float, float, float, float]]:
    """The legs of the 3-RRR while its platform, at angle 0, circles at 4 rad/s: crank angle, its derivatives, and the elbow angle.

    The corner c of the platform is at the distance 0.6 from the elbow 0.4 e(q) of the leg; (1) is the derivative of that.
    """
    height = sqrt(3) / 2
    c0, radius, turn = (0.5 - 0.2, height / 3 - 0.2 / sqrt(3)), height / 8, 4 * t
    legs = []
    for pivot, corner in (((0, 0), (0, 0)), ((1, 0), (0.4, 0)), ((0.5, 0.866), (0.2, 0.4 * height))):
        x, y = (c0[k] + corner[k] - pivot[k] + radius * (cos(turn), sin(turn))[k] for k in (0, 1))
        v, a = (-4 * radius * sin(turn), 4 * radius * cos(turn)), (-16 * radius * cos(turn), -16 * radius * sin(turn))
        d = hypot(x, y)
        q = atan2(y, x) + acos((d * d + 0.4**2 - 0.6**2) / (2 * 0.4 * d))
        e, n = (cos(q), sin(q)), (-sin(q), cos(q))
        arm = (x - 0.4 * e[0], y - 0.4 * e[1])
        lever = 0.4 * (arm[0] * n[0] + arm[1] * n[1])
        qd = (arm[0] * v[0] + arm[1] * v[1]) / lever  # (1)
        rate = [v[k] - 0.4 * n[k] * qd for k in (0, 1)]
        qdd = sum(arm[k] * (a[k] + 0.4 * e[k] * qd * qd) + rate[k] ** 2 for k in (0, 1)) / lever
        legs.append((q, qd, qdd, atan2(arm[1], arm[0]) - q))
    return legs


def platform(t: float, values: tuple[float, ...]) -> Case:
    """Drive torques of the 3-RRR at one instant of the circle."""
    inputs, start = {}, {}
    for i, (q, qd, qdd, elbow) in enumerate(platform_legs(t), start=1):
        inputs |= {f"drive{i}.q": repr(q), f"drive{i}.qd": repr(qd), f"drive{i}.qdd": repr(qdd)}
        start[f"elbow{i}.q0"] = elbow
        if i == 1:
            start["platform_joint.q0"] = -q - elbow
    row = (Known("drive torques", joints(3, "tau", "drive"), values, 0.0, 9, DENSE),)
    return Case(
        "E5 3-RRR", f"inverse, platform on a circle, instant {t:g} s", "three_rrr", 0.01, row, start=start, inputs=inputs, inverse=True
    )


def floating(example: str, model: str, run: str, names: tuple[str, ...], rows: dict[float, tuple[float, ...]], **drives) -> Case:
    return Case(example, run, model, 0.01, known("positions", tuple(f"{name}.q" for name in names), rows), **drives)


def mechanism(example: str, model: str, count: int, driven: dict[int, tuple[float, float]], rows: dict[float, tuple[float, ...]]) -> Case:
    """A closed loop on a floating planar base; its driven joints are under PD control along cycloids of 20 s."""
    start: dict[str, float | str] = {}
    inputs = {}
    for i, (first, last) in driven.items():
        start |= {f"joint{i}.stiffness": 49, f"joint{i}.damping": 14}
        inputs[f"joint{i}.tau"] = follow((first,), (last,), 20.0, 49, 14)["joint1.tau"]
    names = ("base[1]", "base[2]", "base[3]", *(f"joint{i}" for i in range(1, count + 1)))
    return floating(example, model, "PD along a cycloid", names, rows, start=start, inputs=inputs)


DENSE_CASES = (
    torques(
        "E8 2-link",
        "planar_2r",
        (0, 0),
        (pi / 3, pi / 2),
        10.0,
        {0: (2.40345, 0.4905), 2.5: (2.38901603552, 0.479064054079), 5: (1.78117143532, 0.127415999236)},
    ),
    torques(
        "E9 3-link",
        "planar_3r",
        (0, 0, 0),
        (pi, pi, pi),
        10.0,
        {2.5: (3.98291442625, 1.27454163156, 0.221226314113), 5: (-1.28694806707, -1.22773044066, 0.0130278778094)},
    ),
    torques(
        "E10 RP",
        "rp_robot",
        (0, 0.15),
        (pi / 2, 0.3),
        10.0,
        {0: (2.20725, 4.905), 2.5: (2.18305626016, 4.87449304341), 5: (1.30134139399, 3.46465766007)},
    ),
    torques(
        "E11 PPPR",
        "pppr",
        (0.05, 0.05, 0.05, 0),
        (0.1, 0.1, 0.1, pi / 2),
        1.0,
        {
            0.25: (0.846329537426, 0.235779269072, 0.532170272068, 0.00644127650837),
            0.75: (-0.70701816711, -0.375090639388, -0.392858901751, 0.00021591913124),
        },
    ),
    cranked("E3 four-bar", "four_bar", {0.25: (0.160557515419,), 0.5: (-2.32432163698,)}),
    cranked("E4 Hoeken", "hoeken", {0: (2.00999925971,), 0.25: (0.730967897382,), 0.5: (-0.853714998385,)}),
    cranked("E7 leg", "leg", {0: (-0.0986745694649,), 0.25: (0.0213886828432,), 0.5: (0.033093944886,)}),
    Case(
        "E5 3-RRR",
        "free, assembled start pose",
        "three_rrr",
        0.01,
        known(
            "positions",
            tuple(f"{name}.q" for name in ("drive1", "elbow1", "platform_joint", "drive2", "elbow2", "drive3", "elbow3")),
            {
                0.2: (1.1110143227, 5.1670637624, -2.25220766, 4.5408546941, -2.22282227, 4.9016511378, 0.42009328086),
                0.5: (2.1691366691, 3.667000903, -0.46054008911, 5.0922146834, -2.1645991323, 4.1101104473, 1.4216848184),
            },
        ),
    ),
    Case(
        "E3 four-bar",
        "free, assembled start pose",
        "four_bar",
        0.01,
        known("positions", ("crank_joint.q", "joint2.q", "joint3.q"), {1.33: (-3.04935917749, 2.71687065684, 1.045587211)}, 8),
    ),
    Case(
        "E4 Hoeken",
        "free, assembled start pose",
        "hoeken",
        0.01,
        known(
            "positions",
            ("crank_joint.q", "rocker_joint.q", "coupler_joint.q"),
            {1.33: (0.00205832325819, 0.984986816212, 4.31443859661)},
        ),
    ),
    Case(
        "E7 leg",
        "PD on the crank (stiff)",
        "leg",
        0.01,
        known(
            "positions",
            LEG_JOINTS,
            {0.2: (-3.15855808832, 4.06325677206, -1.85463840618, -0.591767889937, -1.953687895, -1.953687895, -1.18790475859)},
            8,
        ),
        start={"crank_joint.stiffness": 49, "crank_joint.rest": -2 * pi, "crank_joint.damping": 14, "solver.method": "bdf"},
    ),
    platform(0, (4.53574904807, -9.60544254884, 27.520850895)),
    platform(0.4, (-3.59911753936, -19.4189743589, 8.45717224186)),
    platform(1, (-18.1926385699, -32.4177417745, 40.4109759357)),
    floating(
        "E19 satellite, 2 arms",
        "space_dual_arm",
        "PD along a cycloid",
        (
            "base[1]",
            "base[2]",
            "base[3]",
            "left_joint1",
            "left_joint2",
            "left_joint3",
            "right_joint1",
            "right_joint2",
            "right_joint3",
        ),
        {
            15: (
                -0.00402757060799,
                0.0732989381831,
                0.087875778823,
                0.0628452718427,
                -1.20875949244,
                0.62492492398,
                2.91825469558,
                1.75169650084,
                -0.485142036942,
            ),
            30: (
                0.00248649646072,
                0.10841219151,
                0.142095551075,
                -0.253557003308,
                -1.80551760051,
                -0.0365742893957,
                3.39505695051,
                1.80530299255,
                0.0365046384502,
            ),
        },
    ),
    floating(
        "E20 satellite, 7 joints",
        "space_arm",
        "PD along a cycloid",
        ("base[1]", "base[2]", "base[3]", *(f"joint{i}" for i in range(1, 8))),
        {
            10: (
                -0.323980788044,
                -0.129074336713,
                0.0223845073498,
                -0.68394555959,
                -0.0684047008052,
                -0.890767948493,
                -0.0228217558471,
                -0.741836459191,
                -0.710752606129,
                0.772316327362,
            ),
            20: (
                -0.370773327301,
                -0.0980636452145,
                0.0208725899407,
                -1.48323536016,
                -1.54933521907,
                -1.61526871345,
                -0.0139619258322,
                0.00500366770953,
                0.0174329251338,
                1.56421368647,
            ),
        },
    ),
    mechanism(
        "E21 satellite, four-bar",
        "space_four_bar",
        3,
        {3: (3.1416, 0)},
        {
            10: (-0.015739059378, -0.010590434506, 0.094595306791, 1.6047481673, 2.2704642919, 1.5701632814),
            20: (-0.019296626688, -0.0031997535019, 0.10364407943, 1.7966636316, 2.6907350067, -0.00059425780826),
        },
    ),
    mechanism(
        "E21 satellite, five-bar",
        "space_five_bar",
        4,
        {1: (1.0555, 1.4216), 3: (2.0860, 1.7200)},
        {
            20: (
                2.00521412307e-06,
                0.00527380995753,
                -9.15350693247e-06,
                1.42169139764,
                2.58501169609,
                1.71990863103,
                3.69816792533,
            )
        },
    ),
    mechanism(
        "E21 satellite, six-bar",
        "space_six_bar",
        5,
        {1: (0.5236, 1.5708), 4: (2.6180, 1.5708), 5: (4.1888, 0)},
        {
            10: (
                0.0217037366079,
                0.0119267179602,
                -0.0722893995853,
                1.34270096061,
                2.2546923652,
                0.266179229996,
                2.08514168646,
                2.69698383753,
            ),
            20: (
                0.0274418240617,
                -0.0502139099801,
                0.386998812042,
                1.58006851102,
                -0.35128510991,
                1.88261298942,
                1.43696227511,
                -0.0605202679605,
            ),
        },
    ),
)


def number(case: Case) -> int:
    """The number of an example; those without one are last."""
    digits = case.example[1:].split(" ")[0]
    return int(digits) if case.example.startswith("E") and digits.isdigit() else 99


ALL = tuple(sorted((*CASES, *DENSE_CASES), key=number))
