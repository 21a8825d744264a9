"""Random scenes of everything a model file can say, through the built library, against the dense formulation.

    python -m tests.crosscheck.random_scenes --count 500 --seed 1 --only redundant --scale 1e-6

Prints one line for each scene that does not agree, with the seed that makes it again, and a table at the end. `--keep FOLDER`
writes the model files of those scenes; `--file MODEL` checks one of them again.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
import time
import tomllib
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tests.crosscheck.dense_motion import Dense, Motion
from tests.crosscheck.dense_scene import cross, mpmath
from tests.crosscheck.scene_contacts import give_contacts
from tests.crosscheck.scene_fmu import Library, Refused
from tests.crosscheck.scene_maker import Maker
from tests.crosscheck.scene_parts import CLASSES, PARTS
from tests.crosscheck.scene_states import (
    agree,
    draw_inputs,
    give_bushings,
    give_couplings,
    give_drives,
    give_frames,
    give_passive,
    give_springs,
    give_velocities,
    guide,
)

TOLERANCE = 1e-10
NEAR_SINGULAR = 1e-4  # singular values of scaled levers: scenes between rounding and this are drawn again
LIGHTEST = 1e-9  # pivot of the scaled mass matrix: the same
MOST_FREEDOMS = 45
SMALLEST = 1e-6  # m


# --- model files ---


def toml(file: dict) -> str:
    """The model file of a scene."""
    show = lambda v: "true" if v is True else json.dumps(v).replace("Infinity", "inf")
    kinds = ("link", "loop", "coupling", "spring", "bushing", "contact", "frame", "trajectory", "actuator")
    lines = [f"{key} = {show(value)}" for key, value in file.items() if key not in kinds and not isinstance(value, dict)]
    for kind in kinds:
        for table in file.get(kind, []):
            lines += ["", f"[[{kind}]]", *(f"{key} = {show(value)}" for key, value in table.items())]
    for section, table in file.items():
        if isinstance(table, dict):
            lines += ["", f"[{section}]", *(f"{key} = {show(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


@dataclass
class Case:
    text: str
    inputs: dict[str, float]
    tags: set[str] = field(default_factory=set)

    def dense(self, exact: bool = False) -> Dense:
        return Dense(tomllib.loads(self.text), exact)


def draw(seed: int, index: int, only: str = "all", scale: float | None = None) -> Case:
    """Scene `index` of a seed; scenes next to a singular pose are drawn again."""
    for attempt in range(200):
        rng = np.random.default_rng([seed, index, attempt])
        try:
            case = attempt_to_draw(rng, only, scale)
        except ArithmeticError:
            continue
        if case:
            return case
    raise RuntimeError(f"no scene for seed {seed}, index {index}, class {only}")


def attempt_to_draw(rng, only: str, scale: float | None) -> Case | None:
    m = Maker(rng, scale or 10 ** float(rng.uniform(-6, 3)) if rng.random() < 0.6 or scale else 1.0)
    names = CLASSES.get(only) or [only]
    for _ in range(m.pick([1, 2, 2, 3])):
        part = m.pick(names)
        parent = "ground" if m.chance(0.5) or not m.links else m.pick(m.links)["name"]
        size = m.sizes[parent] if m.links and parent != "ground" else m.scale
        if m.chance(0.15):
            size = max(size * 10 ** -m.between(1, 5), 1e-5 * m.scale, SMALLEST)
            m.tags.add("sizes")
        PARTS[part](m, parent, size)
        m.tags.add(part)
    if not m.links or all(link["joint"] == "fixed" for link in m.links) or len(m.scene().dofs) > MOST_FREEDOMS:
        return None
    give_passive(m)
    give_springs(m)
    give_bushings(m)
    give_couplings(m)
    give_contacts(m)
    give_frames(m)
    dense = Dense(m.file)
    before = dense.solve(dense.scene.start(), {})
    give_drives(m, dense)
    give_velocities(m, dense)
    if m.chance(0.2) and "projected" not in m.tags:
        for link in m.links:
            if m.chance(0.3) and link["joint"] not in ("fixed",):
                link["hold"] = True
    dense = Dense(m.file)
    inputs = draw_inputs(m, dense.scene)
    if "surplus" in m.tags:
        agree(dense, inputs)
    guide(m, inputs, dense.scene)
    shuffle(m)
    dense = Dense(m.file)
    motion = dense.solve(dense.scene.start(), inputs)
    for at in (before, motion):
        if at.gap[0] < NEAR_SINGULAR or at.gap[1] > 1e-11 or at.pivot < LIGHTEST:
            return None
    if not np.isfinite(motion.qdd.astype(float)).all():
        return None
    return Case(toml({key: value for key, value in m.file.items() if value != []}), inputs, m.tags)


def shuffle(m: Maker) -> None:
    if m.chance(0.2):
        m.rng.shuffle(m.file["link"])
        return
    # leave the parent out where the order of the file says it
    before = "ground"
    for link in m.file["link"]:
        if link["parent"] == before and m.chance(0.5):
            del link["parent"]
        before = link["name"]


# --- comparison ---


@dataclass
class Finding:
    what: str
    name: str
    got: float
    wanted: float
    error: float

    def __str__(self) -> str:
        return f"{self.what} {self.name}: {self.got!r} instead of {self.wanted!r}, error {self.error:.1e}"


def state_of(values: dict, inputs: dict, dense: Dense) -> dict:
    """The state as the FMU shows it."""
    state = {}
    start = dense.scene.start()
    for key in start:
        if key.endswith((".quaternion", ".omega")):
            state[key] = [values[f"{key}[{k + 1}]"] for k in range(len(start[key]))]
        else:
            state[key] = values[key] if key in values else inputs.get(key, start[key])
    return state


def keeps_closed(motion: Motion, scene, others=()) -> np.ndarray:
    """Rows whose rate is rounding, beside the rates that single joints give them at these speeds or at others."""
    rows = motion.rows
    speed = np.array([dof.qd for dof in scene.dofs])
    fast = np.max([abs(speed), 1e-3 * np.sqrt(motion.scale.astype(float) + 1e-290), *others], axis=0)
    return abs(rows.J @ speed) <= 1e-11 * (rows.lever @ fast)


def moved(state: dict, dense: Dense, motion: Motion) -> list[Finding]:
    """Where the FMU starts elsewhere than the file says, though that is closed."""
    found, scene = [], dense.scene
    start = scene.start()
    slow = 1e-6 * math.sqrt(float(max(motion.scale)) + 1e-290)
    reach = max([float(dense.n.norm(link.frame[:3, 3])) for link in scene.links] + [1e-290])
    # a slide turns other joints at its speed over the lengths of the mechanism
    speed = max([abs(float(dof.qd)) / (1 if dof.turns else min(reach, 1)) for dof in scene.dofs] + [slow])
    before = Dense(scene.file)
    closed = keeps_closed(before.solve(before.scene.start(), {}), before.scene).all()
    kept = keeps_closed(motion, scene, [[abs(float(dof.qd)) for dof in before.scene.dofs]])
    if not kept.all():
        found += [Finding("rate", name, math.nan, 0.0, math.inf) for name, good in zip(motion.rows.names, kept, strict=True) if not good]
    for key, wanted in start.items():
        wanted, got = np.atleast_1d(np.array(wanted, float)), np.atleast_1d(np.array(state[key], float))
        if key.endswith(".quaternion"):
            got = got * (1 if got @ wanted >= 0 else -1)
        if not closed and not key.endswith((".q", ".quaternion")):
            continue  # the file's velocities open the loops: the FMU starts with others
        scale = max(1e-300, float(np.abs(wanted).max()))
        turns = not any(dof.variable(kind) == key and not dof.turns for dof in scene.dofs if dof.part is None for kind in ("q", "qd"))
        if key.endswith((".q", ".quaternion")):
            scale = max(scale, 1.0 if turns else 0.0)
        else:
            scale = max(scale, 1e-3 * speed * (1 if turns else min(reach, 1)))
        error = float(np.abs(got - wanted).max()) / scale
        if error > 1e-8:
            found.append(Finding("start moved", key, float(got[0]), float(wanted[0]), error))
    return found


def cut_open(file: dict, name: str) -> dict:
    """The model with a free joint that does not move in place of a fixed one."""
    link = next(table for table in file["link"] if table["name"] == name)
    link |= {"joint": "free", "drive": "locked"}
    return file


class Check:
    """Collects what differs by more than the tolerance."""

    def __init__(self, values: dict, found: list[Finding]) -> None:
        self.values, self.found = values, found

    def __call__(self, what: str, name: str, got, wanted, scale) -> None:
        scale = scale + 1e-290
        if not abs(got - wanted) <= TOLERANCE * scale:
            self.found.append(Finding(what, name, float(got), float(wanted), float(abs(got - wanted) / scale)))

    def multipliers(self, motion: Motion, dense: Dense) -> tuple:
        """Multipliers of the FMU, one solution of many where rows are dependent, and the size of their forces."""
        multipliers = np.array([dense.n.one(self.values[name]) for name in motion.rows.names])
        return multipliers, abs(motion.rows.J.T) @ abs(multipliers) if len(multipliers) else dense.n.zeros(len(motion.qdd))

    def accelerations(self, motion: Motion, dense: Dense) -> np.ndarray:
        """Returns all accelerations as the FMU has them."""
        qdd = motion.qdd.copy()
        scale = motion.scale + motion.response @ self.multipliers(motion, dense)[1]
        for k, dof in enumerate(dense.scene.dofs):
            if not dof.prescribed:
                qdd[k] = dense.n.one(self.values[dof.variable("qdd")])
                self("qdd", dof.variable("qdd"), qdd[k], motion.qdd[k], scale[k])
        return qdd

    def forces(self, motion: Motion, dense: Dense, qdd: np.ndarray) -> None:
        """Multipliers where they are unique, and whether all of them and the drives carry the motion, whatever they are."""
        n, rows, values = dense.n, motion.rows, self.values
        for r, name in enumerate(rows.names):
            if motion.unique[r]:
                self("lambda", name, values[name], motion.multipliers[r], motion.multiplier_scale[r])
        multipliers, size = self.multipliers(motion, dense)
        carried = dense.M @ qdd - dense.forces.value - (rows.J.T @ multipliers if len(multipliers) else 0)
        scale = motion.force_scale + size
        for k, dof in enumerate(dense.scene.dofs):
            given = n.one(values[dof.variable("tau")]) if dof.prescribed else n.one(0)
            self("tau" if dof.prescribed else "balance", dof.variable("tau"), given, carried[k], scale[k])
        size = motion.row_size
        largest = np.abs(motion.multiplier_scale.astype(float) / np.where(size > 0, size, 1)).max(initial=0)
        for r, name in enumerate(rows.names):
            if size[r] > 0 and abs(values[name]) > 1e6 * size[r] * largest + 1e-290:
                self.found.append(Finding("lambda without bound", name, values[name], float(motion.multipliers[r]), math.inf))

    def gaps(self, rows) -> None:
        for loop in {name.rsplit(".", 1)[0] for name in rows.names}:
            inside = [r for r, name in enumerate(rows.names) if name.startswith(loop + ".")]
            gap = math.sqrt(sum(float(rows.phi[r]) ** 2 for r in inside))
            size = 1 + max(float(rows.length[r]) for r in inside)
            self("gap", loop + ".gap", self.values[loop + ".gap"], gap, 1e-3 * size)

    def elastic_couplings(self, dense: Dense) -> None:
        for name, (force, size) in dense.coupling_forces.items():
            self("coupling", f"{name}.lambda", self.values[f"{name}.lambda"], -force, size)

    def contacts(self, dense: Dense) -> None:
        for name, (force, about) in dense.contacts.items():
            for what, wanted in (("force", force), ("torque", about)):
                scale = dense.contact_scale[name][what]
                for k in range(3):
                    self("contact", f"{name}.{what}[{k + 1}]", self.values[f"{name}.{what}[{k + 1}]"], wanted[k], scale)

    def sensors(self, dense: Dense, motion: Motion, qdd: np.ndarray) -> None:
        """Accelerations of frames: those of their velocity products, and the Jacobian times qdd."""
        scene, n = dense.scene, dense.n
        for frame in scene.file.get("frame", []):
            if "acceleration" not in frame["outputs"]:
                continue
            link = scene.index[frame["link"]]
            x, _, a = scene.point(link, frame["position"])
            T, T1, T2 = [T[:3, :3] for T in scene.pose(link)]
            spin, turned = T1 @ T.T, T2 @ T.T + T1 @ T1.T
            path, linear, angular, sizes, turns = dense._jacobian(link, x)
            a = a + linear @ qdd[path]
            alpha = (
                np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]) / 2 + angular @ qdd[path]
            )
            fast = sum(abs(dof.qd) for dof in scene.dofs if dof.turns)
            own = (T @ scene.axes(frame)).T
            length = sum(sizes) + n.norm(x)
            rates = motion.scale[path] + abs(qdd[path])
            size = n.norm(scene.gravity) + (rates * sizes).sum() + fast * (fast * length + sum(abs(d.qd) for d in scene.dofs))
            turning = (rates * turns).sum() + fast * fast
            groups = {
                "acceleration": (a, size),
                "angular_acceleration": (alpha, turning),
                "proper_acceleration": (own @ (a - scene.gravity), size),
                "angular_rate": (own @ np.array([spin[2, 1], spin[0, 2], spin[1, 0]]), fast),
            }
            for what, (wanted, scale) in groups.items():
                for k in range(3):
                    name = f"{frame['name']}.{what}[{k + 1}]"
                    self("sensor", name, self.values[name], wanted[k], scale)

    def wrists(self, case: Case, inputs: dict, dense: Dense) -> None:
        """Sensed wrenches: what a free joint that is held in place of the fixed one has to carry."""
        for frame in dense.scene.file.get("frame", []):
            if "wrench" in frame["outputs"]:
                cut = cut_open(tomllib.loads(case.text), frame["link"])
                self.wrist(frame, Dense(cut), dense, inputs)

    def wrist(self, frame: dict, dense: Dense, whole: Dense, inputs: dict) -> None:
        scene, n, values = dense.scene, dense.n, self.values
        motion = dense.solve(dense.scene.start() | state_of(values, inputs, whole), inputs)
        known = {dof.variable("qdd") for dof in whole.scene.dofs}
        qdd = np.array([n.one(values.get(dof.variable("qdd"), 0)) for dof in scene.dofs])
        for k, dof in enumerate(scene.dofs):
            if dof.prescribed and dof.variable("qdd") in known:
                qdd[k] = scene.acceleration(dof, inputs)
        rows = motion.rows
        multipliers, held = self.multipliers(motion, dense)
        carried = dense.M @ qdd - dense.forces.value - (rows.J.T @ multipliers if len(multipliers) else 0)
        size = dense.forces.size + abs(dense.M) @ (motion.scale + abs(qdd)) + held
        size = size + (abs(rows.J.T) @ motion.multiplier_scale if len(multipliers) else 0)
        dofs = scene.links[scene.index[frame["link"]]].dofs
        force, moment = -carried[dofs[:3]], -carried[dofs[3:]]
        # the slides are along the axes of the joint frame, at rest those of the link
        own, arm = scene.axes(frame).T, n.array(frame["position"])
        moment = moment - cross(arm, force)
        big = size[dofs[:3]].sum()
        for what, wanted, scale in (("force", force, big), ("torque", moment, size[dofs[3:]].sum() + n.norm(arm) * big)):
            for k in range(3):
                name = f"{frame['name']}.sensed_{what}[{k + 1}]"
                self("sensor", name, values[name], (own @ wanted)[k], scale)

    def frames(self, scene) -> None:
        for frame in scene.file.get("frame", []):
            if "pose" not in frame["outputs"]:
                continue
            link = scene.index[frame["link"]]
            x, v, _ = scene.point(link, frame["position"])
            T, T1, _ = [T[:3, :3] for T in scene.pose(link)]
            spin = T1 @ T.T
            length = sum(float(np.linalg.norm(other.pose[0][:3, 3].astype(float))) for other in scene.links)
            length += float(np.linalg.norm(frame["position"]))
            fast = sum(abs(dof.qd) for dof in scene.dofs)
            groups = {
                "position": (x, length),
                "velocity": (v, fast * (length + 1)),
                "angular_velocity": ((spin[2, 1], spin[0, 2], spin[1, 0]), fast),
            }
            for what, (wanted, scale) in groups.items():
                for k in range(3):
                    name = f"{frame['name']}.{what}[{k + 1}]"
                    self("frame", name, self.values[name], wanted[k], scale)


def compare(case: Case, values: dict, exact: bool = False) -> tuple[list[Finding], Motion, Dense]:
    dense = case.dense(exact)
    motion = dense.solve(state_of(values, case.inputs, dense), case.inputs)
    found = moved(state_of(values, case.inputs, dense), dense, motion)
    check = Check(values, found)
    qdd = check.accelerations(motion, dense)
    check.forces(motion, dense, qdd)
    check("energy", "energy.kinetic", values["energy.kinetic"], motion.kinetic, motion.energy_scale)
    check("energy", "energy.potential", values["energy.potential"], motion.potential, motion.energy_scale)
    check.gaps(motion.rows)
    check.frames(dense.scene)
    check.sensors(dense, motion, qdd)
    check.wrists(case, case.inputs, dense)
    check.contacts(dense)
    check.elastic_couplings(dense)
    return found, motion, dense


def sensitivity(case: Case, values: dict, motion: Motion) -> np.ndarray:
    """How far the accelerations move, relative to their scale, when each number of the state is rounded elsewhere."""
    worst = np.zeros(len(motion.qdd))
    rng = np.random.default_rng(0)
    for _ in range(4):
        other = {name: value * (1 + 2.3e-16 * rng.choice([-1, 1])) for name, value in values.items()}
        dense = case.dense()
        at = dense.solve(state_of(other, case.inputs, dense), case.inputs)
        worst = np.maximum(worst, np.abs((at.qdd - motion.qdd).astype(float)) / (motion.scale.astype(float) + 1e-290))
    return worst


def why_ill_posed(case: Case) -> str:
    """Why a scene has no motion by the dense formulation; empty: it has one."""
    dense = case.dense()
    try:
        motion = dense.solve(dense.scene.start(), case.inputs)
    except ArithmeticError as singular:
        return str(singular)
    rows = motion.rows
    left, qdd = abs(rows.J @ motion.qdd - rows.rhs), motion.scale + abs(motion.qdd)
    turning = max([qdd[k] for k, dof in enumerate(dense.scene.dofs) if dof.turns], default=0)
    if (left > 1e-6 * (rows.lever @ qdd + rows.terms + rows.length * turning)).any():
        return "contradictory motions"
    return "the mass matrix is singular" if motion.pivot < 1e-13 else ""


def run(case: Case, library: Library, exact: bool = False) -> tuple[str, list]:
    """What came of a scene: its class and what was found."""
    try:
        warnings = library.load(case.text)
        values, log = library.start(case.inputs)
    except Refused as refused:
        why = why_ill_posed(case)
        return ("ill-posed", [f"{why}: {refused}"]) if why else ("refused", [str(refused)])
    assembled = [line for line in warnings if "initial configuration violates" in line]
    found, motion, _ = compare(case, values, exact)
    if not found:
        return ("describe assembles", assembled) if assembled else ("agree", [])
    found.sort(key=lambda f: -f.error)
    kinds = {f.what for f in found}
    first = next(
        k
        for k in (
            "start moved",
            "rate",
            "qdd",
            "tau",
            "balance",
            "lambda",
            "lambda without bound",
            "energy",
            "frame",
            "sensor",
            "contact",
            "gap",
        )
        if k in kinds
    )
    if kinds <= {"qdd", "balance", "tau", "lambda"}:
        shaken = sensitivity(case, values, motion)
        worst = max((f.error for f in found), default=0)
        if worst < 100 * shaken.max():
            return "ill-conditioned", [f"rounding of the state gives {shaken.max():.1e}", *found]
    return first, found + [f"log: {line}" for line in log if "Warning" in line]


# --- command line ---


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="index of the first scene")
    parser.add_argument("--only", default="all", help=f"{', '.join([*CLASSES, *PARTS])}")
    parser.add_argument("--scale", type=float, help="size of the scenes, m; default: 1 um to 1 km")
    parser.add_argument("--keep", type=Path, help="folder for the model files of scenes that do not agree")
    parser.add_argument("--file", type=Path, help="check this model file (inputs beside it, .json) instead")
    parser.add_argument("--exact", action="store_true", help="the dense formulation in 40 digits (needs mpmath, takes a second a scene)")
    options = parser.parse_args(arguments)
    if options.exact:
        mpmath.mp.dps = 40
    results, parts = Counter(), Counter()
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        library = Library(Path(folder))
        if options.file:
            inputs = options.file.with_suffix(".json")
            case = Case(options.file.read_text(), json.loads(inputs.read_text()) if inputs.exists() else {})
            verdict, found = run(case, library, options.exact)
            print(verdict, *found, sep="\n    ")
            return int(verdict != "agree")
        for index in range(options.first, options.first + options.count):
            case = draw(options.seed, index, options.only, options.scale)
            verdict, found = run(case, library, options.exact)
            results[verdict] += 1
            if verdict == "agree":
                continue
            parts.update((verdict, tag) for tag in case.tags)
            print(f"seed {options.seed} index {index} ({', '.join(sorted(case.tags))}): {verdict}: {found[0]}", flush=True)
            if options.keep:
                options.keep.mkdir(parents=True, exist_ok=True)
                path = options.keep / f"{verdict.replace(' ', '_')}_{options.only}_{options.seed}_{index}.toml"
                path.write_text(f"# {found[0]}\n" + case.text)
                path.with_suffix(".json").write_text(json.dumps(case.inputs, indent=1))
    print(
        f"{options.count} scenes in {time.perf_counter() - begin:.1f} s: "
        + ", ".join(f"{n} {verdict}" for verdict, n in results.most_common())
    )
    for (verdict, tag), count in sorted(parts.items()):
        print(f"  {verdict}: {count} with {tag}")
    return int(set(results) > {"agree"})


if __name__ == "__main__":
    sys.exit(main())
