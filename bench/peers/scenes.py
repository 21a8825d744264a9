"""The scenes of the comparison: files of tests/scenes and model files of bench/scenes, and their text form for the C++ programs here."""

from __future__ import annotations

import csv
import json
import sys
import tomllib
from dataclasses import dataclass, field, replace
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT))
from build_fmu.importers.draft import DhFrame
from build_fmu.importers.rigid import pose_of


@dataclass
class Scene:
    """One scene with its reference; `model` is our model file of the same system."""

    name: str
    model: Path
    title: str
    methods: tuple[str, ...]  # ours
    file: Path  # the neutral scene
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
            start = [self.data["initial"]["q"][i], self.data["initial"]["qd"][i], self.torques[i]]
            turn = [x for row in placement["R"] for x in row]
            lines.append(["body", body["parent"], *turn, *placement["p"], body["mass"], *body["com"], *body["inertia"], *passive, *start])
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


def of_model(file: Path) -> dict:
    """Returns the scene of a model file, a tree of hinges that move freely."""
    model = tomllib.loads(file.read_text())
    names, bodies = ["ground"], []
    for link in model["link"]:
        inertia = [*map(float, link.get("inertia", [0.0] * 3)), 0.0, 0.0, 0.0][:6]
        pose = pose_of(DhFrame(**{key: link[key] for key in vars(DhFrame()) if key in link}))
        joint = {"type": "revolute", "placement": {"R": pose[:3, :3].tolist(), "p": pose[:3, 3].tolist()}}
        place = names.index(link.get("parent", names[-1])) - 1
        names.append(link["name"])
        mass, com = link.get("mass", 0.0), link.get("com", [0.0] * 3)
        bodies.append({"parent": place, "joint": joint, "mass": mass, "com": com, "inertia": inertia})
    initial = {key: [float(link.get(key, 0.0)) for link in model["link"]] for key in ("q", "qd")}
    time = {"t_end": model["fmu"]["stop_time"], "dt_out": model["fmu"]["step_size"]}
    return {"gravity": model["gravity"], "bodies": bodies, "loops": [], "forces": [], "inputs": [], "initial": initial, "time": time}


def read(file: Path) -> Scene:
    """Returns the scene of a file for a simulator's process, without reference."""
    data = of_model(file) if file.suffix == ".toml" else json.loads(file.read_text())
    return Scene(file.stem, Path(), "", (), file, data)


def public(name: str, model: str, title: str, methods: tuple[str, ...], stiff: bool = False) -> Scene:
    """Returns a scene of tests/scenes with its reference."""
    file = ROOT / "tests" / "scenes" / f"{name}.json"
    return referred(replace(read(file), model=ROOT / "models" / f"{model}.toml", title=title, methods=methods, stiff=stiff))


def own(name: str, title: str, methods: tuple[str, ...]) -> Scene:
    """Returns a scene of bench/scenes with the reference of tree_references.py."""
    file = ROOT / "bench" / "scenes" / f"{name}.toml"
    return referred(replace(read(file), model=file, title=title, methods=methods))


def referred(scene: Scene) -> Scene:
    rows = list(csv.DictReader(scene.file.with_suffix(".csv").open()))
    scene.reference = [[float(row[f"q{i + 1}"]) for i in range(scene.joints)] for row in rows]
    return scene


def all_scenes() -> list[Scene]:
    explicit = ("erk", "adams", "auto")
    return [
        public("double_pendulum", "double_pendulum", "double pendulum, 5 s", explicit),
        public("kr5_freefall", "kuka_kr5", "KUKA KR5 in free fall, 6 joints, 1 s", explicit),
        own("puma560", "PUMA 560 in free fall, 6 joints, 1 s", explicit),
        own("panda", "Panda in free fall, 7 joints, 1 s", explicit),
        own("humanoid", "humanoid with a fixed trunk, 24 joints, 0.5 s", explicit),
        public("gripper_freefall", "gripper", "gripper in free fall, 4 joints, 1 s", explicit),
        public("fourbar_forced", "four_bar", "four-bar, a closed loop, 2 N m at the crank, 1 s", explicit),
        public("stiff_strut", "stiff_strut", "two rods on a stiff strut, 2 s", ("bdf", "dirk", "erk", "auto"), stiff=True),
    ]
