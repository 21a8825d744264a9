"""The scenes of the comparison: files of tests/scenes and model files of bench/scenes, and their text form for the C++ programs here."""

from __future__ import annotations

import csv
import json
import sys
import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT))
from tests.crosscheck import dense_scene


@dataclass
class Scene:
    """One scene with its reference; `model` is our model file of the same system."""

    name: str
    model: Path
    title: str
    methods: tuple[str, ...]  # ours
    data: dict
    stiff: bool = False
    reference: list[list[float]] = field(default_factory=list)

    @property
    def joints(self) -> int:
        return len(self.data["bodies"])

    @property
    def end(self) -> float:
        return self.data["time"]["t_end"]

    @property
    def step(self) -> float:
        return self.data["time"]["dt_out"]

    @property
    def rows(self) -> int:
        return round(self.end / self.step)

    @property
    def torques(self) -> list[float]:
        torques = [0.0] * self.joints
        for item in self.data["inputs"]:
            torques[item["joint"]] = item["value"] if item["type"] == "constant" else item["amplitude"]
        return torques

    @property
    def frequency(self) -> float:
        """Frequency of a torque with alternating sign; 0: none."""
        return next((item["frequency"] for item in self.data["inputs"] if item["type"] == "bangbang"), 0.0)

    @property
    def has_loops(self) -> bool:
        return bool(self.data["loops"])

    def text(self) -> str:
        """Returns the scene in the form of scene_text.hpp."""
        lines = [["gravity", *self.data["gravity"]], ["rows", self.rows, self.step]]
        for i, body in enumerate(self.data["bodies"]):
            joint = body["joint"]
            placement = joint["placement"]
            passive = [joint.get(key, 0.0) for key in ("stiffness", "damping", "rest")]
            start = [*(self.data["initial"][key][i] for key in ("q", "qd")), self.torques[i]]
            place = [body["parent"], joint["type"], *(x for row in placement["R"] for x in row), *placement["p"]]
            lines.append(["body", *place, body["mass"], *body["com"], *body["inertia"], *passive, *start])
        for loop in self.data["loops"]:
            lines.append(["loop", loop["body_a"], *loop["point_a"], loop["body_b"], *loop["point_b"]])
        for spring in self.data["forces"]:
            lines.append(
                [
                    "spring",
                    spring["body_a"],
                    *spring["point_a"],
                    spring["body_b"],
                    *spring["point_b"],
                    spring["k"],
                    spring["c"],
                    spring["rest_length"],
                ]
            )
        return "".join(" ".join(x if isinstance(x, str) else repr(x) for x in line) + "\n" for line in lines)


def of_model(file: Path, torques: dict[str, float] | None = None) -> dict:
    """Returns the scene of a model file: hinges and sliders, springs, and loops of hinges about z in the plane xy.

    `torques`: constant torques of joints, N m."""
    model = tomllib.loads(file.read_text(encoding="utf-8"))
    dense = dense_scene.Scene(model)
    bodies = []
    for link, dof in zip(dense.links, dense.dofs, strict=True):
        frame, inertia = link.frame.astype(float), link.inertia.astype(float)
        joint = {"type": link.joint, "placement": {"R": frame[:3, :3].tolist(), "p": frame[:3, 3].tolist()}}
        joint |= {key: float(dof.fields[key]) for key in ("stiffness", "damping", "rest")}
        moments = [float(inertia[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        body = {"parent": link.parent, "joint": joint, "mass": float(link.mass), "com": link.com.astype(float).tolist(), "inertia": moments}
        bodies.append(body)

    def ends(item: dict) -> dict:
        return {f"body_{k}": dense.index[item[f"link_{k}"]] for k in "ab"} | {f"point_{k}": item.get(f"point_{k}", [0, 0, 0]) for k in "ab"}

    springs = [
        ends(item) | {"k": item["stiffness"], "c": item.get("damping", 0), "rest_length": item["rest_length"]}
        for item in model.get("spring", [])
    ]
    return {
        "gravity": [float(x) for x in dense.gravity],
        "bodies": bodies,
        "loops": [ends(item) | {"directions": [[1, 0, 0], [0, 1, 0]]} for item in model.get("loop", [])],
        "forces": springs,
        "inputs": [
            {"joint": next(i for i, dof in enumerate(dense.dofs) if dof.name == joint), "type": "constant", "value": value}
            for joint, value in (torques or {}).items()
        ],
        "initial": {key: [float(dof.fields[key]) for dof in dense.dofs] for key in ("q", "qd")},
        "time": {"t_end": model["fmu"]["stop_time"], "dt_out": model["fmu"]["step_size"]},
    }


def read(file: Path) -> Scene:
    """Returns the scene of a file for a simulator's process, without reference."""
    return Scene(file.stem, Path(), "", (), json.loads(file.read_text(encoding="utf-8")))


def public(name: str, model: str, title: str, methods: tuple[str, ...], stiff: bool = False) -> Scene:
    """Returns a scene of tests/scenes."""
    scene = read(ROOT / "tests" / "scenes" / f"{name}.json")
    return replace(scene, model=ROOT / "models" / f"{model}.toml", title=title, methods=methods, stiff=stiff)


def own(
    name: str, title: str, methods: tuple[str, ...], end: float = 0, torques: dict[str, float] | None = None, stiff: bool = False
) -> Scene:
    """Returns a scene of a model file of bench/scenes or models; `end`: other than the model's stop time, in 100 output steps."""
    model = next(file for folder in ("bench/scenes", "models") if (file := ROOT / folder / f"{name}.toml").exists())
    data = of_model(model, torques)
    if end:
        data["time"] = {"t_end": end, "dt_out": end / 100}
    return Scene(name, model, title, methods, data, stiff)


def referred(scene: Scene) -> Scene:
    """Returns the scene with its reference."""
    file = next(file for folder in ("bench/scenes", "tests/scenes") if (file := ROOT / folder / f"{scene.name}.csv").exists())
    rows = list(csv.DictReader(file.open(encoding="utf-8")))
    return replace(scene, reference=[[float(row[f"q{i + 1}"]) for i in range(scene.joints)] for row in rows])


def write(scene: Scene, rows: np.ndarray) -> None:
    """Writes the reference of a scene of bench/scenes, positions at the output times."""
    with (ROOT / "bench" / "scenes" / f"{scene.name}.csv").open("w", newline="", encoding="utf-8") as table:
        writer = csv.writer(table)
        writer.writerow(["t", *(f"q{k + 1}" for k in range(scene.joints))])
        writer.writerows([repr(float(k * scene.step)), *(repr(float(x)) for x in row)] for k, row in enumerate(rows))


def all_scenes() -> list[Scene]:
    explicit = ("erk", "adams", "auto")
    stiff = ("bdf", "dirk", "erk", "auto")
    return [
        public("double_pendulum", "double_pendulum", "double pendulum, 5 s", explicit),
        public("kr5_freefall", "kuka_kr5", "KUKA KR5 in free fall, 6 joints, 1 s", explicit),
        own("puma560", "PUMA 560 in free fall, 6 joints, 1 s", explicit),
        own("panda", "Panda in free fall, 7 joints, 1 s", explicit),
        own("humanoid", "humanoid with a fixed trunk, 24 joints, 0.5 s", explicit),
        public("gripper_freefall", "gripper", "gripper in free fall, 4 joints, 1 s", explicit),
        public("fourbar_forced", "four_bar", "four-bar, a closed loop, 2 N m at the crank, 1 s", explicit),
        own("three_four_bars", "three coupled four-bars, 3 closed loops, 2 s", explicit, end=2),
        own("iftomm_squeezer", "Andrews' squeezer, 3 closed loops, 0.03 s", explicit, end=0.03, torques={"beta": 0.033}),
        own("three_rrr", "3-RRR, 2 closed loops, in free fall, 0.5 s", explicit, end=0.5),
        public("stiff_strut", "stiff_strut", "two rods on a stiff strut, 2 s", stiff, stiff=True),
        own("iftomm_governor", "stiff flyball governor, 4 joints, 2 s", stiff, end=2, stiff=True),
    ]
