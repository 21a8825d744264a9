"""Writes the gait tables of ReDySim's legged robots: `python models/generate_gaits.py` writes `models/redysim_*_*.csv`.

The hip moves like a linear inverted pendulum of height `height`, from `start` to `-start` behind and before the supporting foot in each
step. The other foot swings from `-stride` to `stride` and is lifted by `lift`. Thigh and shank follow by inverse kinematics; the sole of a
foot stays level. Legs "1" stand in odd steps, legs "2" in even ones. At the end of a step the accelerations jump: two rows at one time.
Parameters: ReDySim's examples, except those of redysim_biped, whose gait is not published.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Gait:
    step: float  # duration of a step, s
    steps: int
    height: float  # of the hip, m
    start: float  # of the hip relative to the supporting foot, m
    stride: float
    lift: float
    thigh: float
    shank: float
    rows: int  # intervals of the table in a step
    hip: float = 0.0  # hip angle of a stretched vertical leg, rad
    foot: bool = False


GAITS = {
    "redysim_hexapod": Gait(0.5, 4, 0.55, -0.2, 0.4, 0.08, 0.3, 0.3, 50, hip=-math.pi / 2),
    "redysim_quadruped": Gait(1.0, 2, 0.5, -0.15, 0.3, 0.09, 0.3, 0.3, 50),
    "redysim_biped": Gait(0.5, 4, 0.96, -0.15, 0.3, 0.1, 0.5, 0.5, 50, foot=True),
    "redysim_small_biped": Gait(1.1, 6, 0.13, -0.03, 0.06, 0.03, 0.108, 0.1, 50, foot=True),
}


@dataclass(frozen=True)
class Course:
    """A function of time at one time: its value and first two derivatives."""

    q: float
    qd: float = 0.0
    qdd: float = 0.0

    def __add__(self, other: Course | float) -> Course:
        other = other if isinstance(other, Course) else Course(other)
        return Course(self.q + other.q, self.qd + other.qd, self.qdd + other.qdd)

    def __mul__(self, other: Course | float) -> Course:
        other = other if isinstance(other, Course) else Course(other)
        return Course(
            self.q * other.q,
            self.qd * other.q + self.q * other.qd,
            self.qdd * other.q + 2 * self.qd * other.qd + self.q * other.qdd,
        )

    def __sub__(self, other: Course | float) -> Course:
        return self + other * -1.0

    def of(self, value: float, slope: float, bend: float) -> Course:
        """Returns the function with this value, slope and second derivative at q, of this course."""
        return Course(value, slope * self.qd, bend * self.qd**2 + slope * self.qdd)


def arccos(x: Course) -> Course:
    root = math.sqrt(1 - x.q**2)
    return x.of(math.acos(x.q), -1 / root, -x.q / root**3)


def angle(y: Course, x: Course) -> Course:
    """Returns atan2(y, x): its rate is (x y' - y x') / (x^2 + y^2)."""
    square = x * x + y * y
    turn = x.q * y.qd - y.q * x.qd
    return Course(
        math.atan2(y.q, x.q), turn / square.q, (x.q * y.qdd - y.q * x.qdd) / square.q - turn * square.qd / square.q**2
    )  # fmt: skip


def leg(gait: Gait, time: float, stands: bool) -> dict[str, Course]:
    """Returns the joint angles of a leg at a time since the start of a step."""
    rate = math.sqrt(9.81 / gait.height)
    grown, swing = math.exp(rate * gait.step), math.pi / gait.step
    speed = gait.start * rate * (1 + grown) / (1 - grown)
    rising, falling = ((gait.start + sign * speed / rate) / 2 * math.exp(sign * rate * time) for sign in (1, -1))
    hip = Course(rising + falling, rate * (rising - falling), rate**2 * (rising + falling))
    c, s = math.cos(swing * time), math.sin(swing * time)
    foot, up = (Course(0), Course(0)) if stands else (
        Course(-gait.stride * c, gait.stride * swing * s, gait.stride * swing**2 * c),
        Course(gait.lift * s * s, 2 * gait.lift * swing * s * c, 2 * gait.lift * swing**2 * (c * c - s * s)),
    )  # fmt: skip
    x, z = hip - foot, Course(gait.height) - up
    thigh, shank = gait.thigh, gait.shank
    bend = arccos((x * x + z * z - (thigh**2 + shank**2)) * (1 / (2 * thigh * shank)))
    c, s = math.cos(bend.q), math.sin(bend.q)
    # angle at the foot between the shank and the line to the hip, and of that line to the vertical
    inner, lean = angle(bend.of(s, c, -s) * thigh, bend.of(c, -s, -c) * thigh + shank), angle(x, z)
    angles = {"hip": bend - inner - lean + gait.hip, "knee": bend * -1.0}
    return angles | {"ankle": lean + inner + math.pi / 2} if gait.foot else angles


def write(folder: Path, name: str, gait: Gait) -> None:
    for legs in (1, 2):
        rows: dict[str, list[str]] = {}
        for step in range(gait.steps):
            for k in range(gait.rows + 1):
                time = gait.step * k / gait.rows
                for joint, motion in leg(gait, time, stands=step % 2 == legs - 1).items():
                    numbers = (round(step * gait.step + time, 9), motion.q, motion.qd, motion.qdd)
                    rows.setdefault(joint, []).append(",".join(f"{number:.13g}" for number in numbers))
        for joint, lines in rows.items():
            text = "\n".join(["time,q,qd,qdd", *lines]) + "\n"
            (folder / f"{name}_{joint}_{legs}.csv").write_text(text, encoding="utf-8", newline="\n")


if __name__ == "__main__":
    for name, gait in GAITS.items():
        write(Path(__file__).parent, name, gait)
