"""Random scenes in motion, with actuators, controllers and floors to fall on: laws that need no other program, and the dense formulation at the end.

    python -m tests.crosscheck.scene_runs --count 100 --seed 1

Each scene of `random_scenes` runs at 1 m, and with all lengths, masses and times of 1 um and 1 km: results must agree but for the tolerance. Energy is balanced,
a saved state continues to the same bits, finer tolerances and the CVode of FMPy in model exchange find the same motion.
"""

from __future__ import annotations

import argparse
import copy
import math
import sys
import tempfile
import tomllib
from collections import Counter
from pathlib import Path

import numpy as np
from fmpy import simulate_fmu

from build_fmu.fmu.build import build
from build_fmu.model.describe import describe
from tests.crosscheck.dense_motion import Dense
from tests.crosscheck.random_scenes import Check, draw, state_of, toml
from tests.crosscheck.scene_fmu import Library, Refused
from tests.crosscheck.scene_maker import G
from tests.fmi.raw import OK, Slave

STEPS, SIZE = 16, 0.0625  # of the run at 1 m, s
E, T = np.array([5, -2]), np.array([0, 1])  # exponents of length and time: energy, time; mass is the cube of length


# --- what the generator leaves out ---


def weights(file: dict) -> dict[str, float]:
    weight = {link["name"]: link.get("mass", 0.0) * G for link in file["link"]}
    for link in sorted(file["link"], key=lambda link: -depth(file, link)):
        if link["parent"] != "ground":
            weight[link["parent"]] += weight[link["name"]]
    return weight


def depth(file: dict, link: dict) -> int:
    table = {other["name"]: other for other in file["link"]}
    return 0 if link["parent"] == "ground" else 1 + depth(file, table[link["parent"]])


def give_motors(file: dict, rng, scene, inputs: dict) -> None:
    """Actuators of all kinds, and a controller of the others."""
    weight, left = weights(file), []
    between = lambda low, high: float(rng.uniform(low, high))
    for dof in scene.dofs:
        if dof.part is not None or dof.drive != "torque" or dof.variable("tau") not in inputs:
            continue
        F = weight[scene.links[dof.link].name]
        size = (F / G) ** (1 / 3)
        Q, v = (F * size, math.sqrt(G / size)) if dof.turns else (F, math.sqrt(G * size))
        if F == 0 or rng.random() < 0.4:
            left.append((dof, Q, v))
            continue
        ratio = between(1, 20) / (1 if dof.turns else size)
        motor = {"joint": dof.name, "gear_ratio": ratio}
        if rng.random() < 0.3:
            motor["time_constant"] = between(0.01, 0.1)
        if rng.random() < 0.5:
            motor |= {"torque_limit": between(0.2, 2) * Q}
        if rng.random() < 0.5:
            motor |= {"speed_limit": between(0.5, 3) * v}
        if rng.random() < 0.5 and "armature" not in scene.links[dof.link].table:
            k = between(1, 50) * Q / (1 if dof.turns else size)
            motor |= {"rotor_inertia": between(0.02, 0.2) * Q / v / math.sqrt(G / size) / ratio**2, "stiffness": k, "damping": 0.02 * k}
            if rng.random() < 0.5:
                motor["backlash"] = between(0.01, 0.1) * (1 if dof.turns else size)
        if rng.random() < 0.3:
            constant = Q / ratio
            motor |= {"torque_constant": constant, "resistance": between(1, 5) * constant * v * ratio, "inductance": 0.0}
            motor["inductance"] = motor["resistance"] * between(0.01, 0.05)
            inputs[f"{dof.name}.voltage"] = inputs.pop(dof.variable("tau")) / Q * constant * v * ratio
        file.setdefault("actuator", []).append(motor)
    if left and rng.random() < 0.5 and not file.get("inverse"):
        unit = [Q / (1 if dof.turns else v * v / G) for dof, Q, v in left]
        law = {"law": "pd", "joints": [dof.name for dof, _, _ in left], "kp": [2 * u for u in unit], "kd": [0.3 * u for u in unit]}
        if rng.random() < 0.3:
            law["sample_time"] = 2.0**-7
        file["controller"] = law
        for dof, _, _ in left:
            del inputs[dof.variable("tau")]


def give_floors(file: dict, rng, scene) -> None:
    """Stiff ground just below some links."""
    weight = weights(file)
    down = np.array(file["gravity"]) / np.linalg.norm(file["gravity"])
    movable = [
        link for k, link in enumerate(scene.links) if link.path and not scene.dofs[link.path[0]].prescribed and weight[link.name] > 0
    ]
    for k in range(int(rng.integers(0, 3)) if movable else 0):
        link = movable[int(rng.integers(len(movable)))]
        F = weight[link.name]
        size = (F / G) ** (1 / 3)
        center = np.array(scene.point(scene.index[link.name], [0, 0, 0])[0], float)
        radius, gap = float(rng.uniform(0.1, 0.4)) * size, float(rng.uniform(0.0, 0.3)) * size
        v = math.sqrt(G * size)
        floor = {"name": f"floor{k}", "link_a": link.name, "shape_a": "sphere", "radius_a": radius}
        floor |= {"point_b": [float(x) for x in center + (radius + gap) * down], "normal_b": [float(-x) for x in down]}
        floor |= {"stiffness": 10 ** float(rng.uniform(1, 3)) * F / size, "damping": float(rng.uniform(0, 2)) / v, "width": 1e-3 * size}
        floor |= {"friction": float(rng.uniform(0, 1)), "friction_velocity": 10 ** float(rng.uniform(-3, -1)) * v}
        floor |= {"rolling": 0.01 * size, "spin_velocity": float(rng.uniform(0.1, 1)) * v / size, "outputs": ["force", "torque"]}
        file.setdefault("contact", []).append(floor)


# --- dimensions ---


def dimension(kind: str, key: str, x: np.ndarray) -> np.ndarray | None:
    """Exponents of length and time of a field; `x`: of the position of its joint."""
    L = np.array([1, 0])
    force = {"stiffness": E - 2 * x, "damping": E - 2 * x + T, "friction": E - x, "static_friction": E - x}
    if kind in ("link", "actuator"):
        table = force | dict.fromkeys(("rest", "lower", "upper", "stop_width", "q", "backlash", "backlash_width"), x)
        table |= dict.fromkeys(("a", "d", "b", "com", "pitch"), L) | dict.fromkeys(("friction_velocity", "qd", "speed_limit"), x - T)
        table |= {"mass": 3 * L, "inertia": 5 * L, "armature": E - 2 * x + 2 * T, "stop_stiffness": E - 2 * x, "stop_damping": T - x}
        table |= {"gear_ratio": -x, "rotor_inertia": 5 * L, "torque_limit": E - x, "time_constant": T}
        table |= {"torque_constant": E, "resistance": E - T, "inductance": E}
        return table.get(key)
    if kind == "controller":
        return {"kp": E - 2 * x, "kd": E - 2 * x + T, "sample_time": T}.get(key)
    if kind == "coupling":
        return {"ratios": -x, "stiffness": E, "damping": E + T}.get(key)
    if kind == "trajectory":
        return None
    if kind == "bushing" and key in force:
        return force[key]
    table = {"rest_length": L, "position": L, "spacing": L, "width": L, "rolling": L, "torsion": L, "friction_velocity": L - T}
    table |= {"stiffness": E - 2 * L, "damping": E - 2 * L + T, "spin_velocity": -T}
    if kind == "contact":
        table["damping"] = T - L
    if key.startswith(("point", "size_", "radius", "tube")):
        return L
    return table.get(key)


def times(value, factors):
    """A number, or a nested list with one factor or one for each entry."""
    if isinstance(value, list):
        return [times(v, factors[k] if isinstance(factors, list) else factors) for k, v in enumerate(value)]
    return value * factors


class Resized:
    """A scene with all lengths, masses and times multiplied."""

    def __init__(self, file: dict, scene, length: float, time: float) -> None:
        self.factor = lambda power: float(length ** power[0] * time ** power[1])
        self.position = {dof.name: np.array([0, 0] if dof.turns else [1, 0]) for dof in scene.dofs}
        self.time = time
        joints = {link.name: [self.position[scene.dofs[k].name] for k in link.dofs] for link in scene.links}
        self.file = copy.deepcopy(file)
        self.file["gravity"] = times(file["gravity"], length / time**2)
        for kind, tables in self.file.items():
            for table in tables if isinstance(tables, list) and tables and isinstance(tables[0], dict) else [tables]:
                if isinstance(table, dict):
                    self.resize(kind, table, joints)

    def resize(self, kind: str, table: dict, joints: dict) -> None:
        still, L = np.array([0, 0]), np.array([1, 0])
        places = [still]
        if kind == "link":
            places = joints[table["name"]] or [still]
            if table["joint"] in ("spherical", "free"):
                for key, turn in (("q", still), ("qd", -T)):
                    if key in table:
                        slide = L if key == "q" else L - T
                        table[key] = [
                            v * self.factor(slide if k < 3 and table["joint"] == "free" else turn) for k, v in enumerate(table[key])
                        ]
                places = [still]
        elif kind == "bushing":
            places = [L] * 3 + [still] * 3
        elif kind in ("coupling", "controller"):
            places = [self.position[name] for name in table["joints"]]
        elif "joint" in table:
            places = [self.position[table["joint"]]]
        if kind == "trajectory":
            table["coefficients"] = [v * self.factor(places[0] - k * T) for k, v in enumerate(table["coefficients"])]
        ball = kind == "link" and table["joint"] in ("spherical", "free")
        for key, value in table.items():
            if isinstance(value, str | bool) or (ball and key in ("q", "qd")) or dimension(kind, key, still) is None:
                continue
            varies = (dimension(kind, key, L) != dimension(kind, key, still)).any()
            factors = [self.factor(dimension(kind, key, place)) for place in places]
            table[key] = times(value, factors if varies and isinstance(value, list) else factors[0])

    def scale_of(self, name: str) -> float:
        """Of an input or an output."""
        owner, _, what = name.rpartition(".")
        x, what = self.position.get(owner, np.array([0, 0])), what.split("[")[0]
        powers = {"q": x, "qd": x - T, "qdd": x - 2 * T, "tau": E - x, "voltage": E - T, "omega": -T, "force": E - [1, 0], "torque": E}
        return self.factor(powers.get(what, np.array([0, 0])))


# --- runs ---


SHOWN = (".q", ".quaternion[1]", ".quaternion[2]", ".quaternion[3]", ".quaternion[4]")


class Runner:
    def __init__(self, library: Library, file: dict, inputs: dict, scene) -> None:
        self.library, self.scene, self.inputs = library, scene, inputs
        self.file = file | {"fmu": {"outputs": ["acceleration", "energy", "solver", "actuator"]}}

    def text(self, file: dict, rtol: float) -> str:
        return toml(file | {"solver": {"rtol": rtol}})

    def load(self, rtol: float, length: float = 1.0, time: float = 1.0) -> Resized:
        resized = Resized(self.file, self.scene, length, time)
        self.library.load(self.text(resized.file, rtol))
        return resized

    def begin(self, resized: Resized) -> Slave:
        slave = Slave(self.library, logging=True)
        inputs = {name: value * resized.scale_of(name) for name, value in self.inputs.items()}
        good = slave.component.value and slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        good = good and slave.set_reals(list(inputs), list(inputs.values())) == OK and slave.call("ExitInitializationMode") == OK
        if not good:
            raise Refused("; ".join(slave.errors))
        return slave

    def go(self, rtol: float, length: float = 1.0, time: float = 1.0, until: int = STEPS) -> tuple[np.ndarray, dict, Slave]:
        """Positions at all communication points in units of the scene of 1 m; energies; the instance."""
        resized = self.load(rtol, length, time)
        slave = self.begin(resized)
        rows, energies = [], []
        self.shown = [name for name in self.library.outputs if name.endswith(SHOWN)]
        back = np.array([1 / resized.scale_of(name) for name in self.shown])
        for k in range(until + 1):
            if k and slave.step((k - 1) * SIZE * time, SIZE * time) != OK:
                raise ArithmeticError(f"step {k}: {'; '.join(slave.errors)}")
            rows.append(slave.reals(self.shown) * back)
            energies.append(slave.reals(["energy.kinetic", "energy.potential", "energy.work", "energy.balance"]))
        return np.array(rows), np.array(energies), slave


def imbalance(energies: np.ndarray, slave: Slave) -> float:
    """Relative to the exchanged energy. Where motions leave nothing to integrate, the work has no error control, and the balance no bound."""
    kinetic, potential, work, balance = energies.T
    scale = max(kinetic.max(), np.ptp(potential), np.abs(work).max(), 1e-3 * np.abs(potential).max())
    driven = any("fully driven" in text for _, _, text in slave.messages)
    return np.abs(balance).max() / scale if scale and not driven else 0.0


def has_jumps(runner: Runner) -> bool:
    """Forces jump where a bushing passes half a turn or a corner changes its face."""
    return "bushing" in runner.file or any({"box"} == {pair.get("shape_a"), pair.get("shape_b")} for pair in runner.file.get("contact", []))


def balance_bound(runner: Runner) -> float:
    """The work of prescribed motions, of short impacts too, is in no error test."""
    return (100e-9, 1e-5, math.inf)[has_jumps(runner) + any(dof.prescribed for dof in runner.scene.dofs)]


def restored(runner: Runner) -> str:
    """Whether a saved state of the middle of a run continues to the same bits, in this instance and in another."""
    resized = runner.load(1e-6)
    slave, names = runner.begin(resized), runner.library.outputs
    go = lambda slave, first, last: [slave.step(k * SIZE, SIZE) for k in range(first, last)]
    go(slave, 0, STEPS // 2)
    state = slave.save()
    content = slave.serialize(state)
    go(slave, STEPS // 2, STEPS)
    wanted = np.array(slave.reals(names))
    assert slave.call("SetFMUstate", state) == OK
    go(slave, STEPS // 2, STEPS)
    again = np.array(slave.reals(names))
    other = runner.begin(resized)
    status, moved = other.deserialize(content)
    assert status == OK and other.call("SetFMUstate", moved) == OK
    go(other, STEPS // 2, STEPS)
    elsewhere = np.array(other.reals(names))
    found = [n for n, a, b, d in zip(names, wanted, again, elsewhere, strict=True) if not (a == b == d or (a != a and b != b and d != d))]
    for used in (slave, other):
        used.free()
    return f"restored differs: {', '.join(found[:4])}" if found else ""


def exchanged(runner: Runner, folder: Path, rtol: float) -> np.ndarray:
    """The motion by CVode of FMPy in model exchange."""
    model, fmu = folder / "scene.toml", folder / "scene.fmu"
    model.write_text(runner.text(runner.file, rtol))  # FMPy does not tell the FMU its tolerance
    build(describe(model), model, fmu)
    result = simulate_fmu(
        str(fmu),
        fmi_type="ModelExchange",
        stop_time=STEPS * SIZE,
        output_interval=SIZE,
        start_values=runner.inputs,
        relative_tolerance=rtol,
        output=runner.shown,
    )
    rows = [np.flatnonzero(np.abs(result["time"] - k * SIZE) < 1e-9)[-1] for k in range(STEPS + 1)]  # an event has two rows
    return np.array([[result[row][name] for name in runner.shown] for row in rows])


def dense_end(runner: Runner, slave: Slave, end: float) -> list:
    """Accelerations and forces at the end by the dense formulation, with the torques that the actuators and the controller give."""
    library, file = runner.library, copy.deepcopy(runner.file)
    values = dict(zip(library.outputs, slave.reals(library.outputs), strict=True))
    for kind in ("actuator", "controller", "fmu"):
        file.pop(kind, None)
    inputs = dict(runner.inputs)
    for dof in runner.scene.dofs:
        name = dof.name
        if f"{name}.tau_joint" in values:
            inputs[f"{name}.tau"] = values[f"{name}.tau_joint"]
        elif dof.drive == "torque" and dof.part is None and dof.variable("tau") in values:
            inputs[dof.variable("tau")] = values[dof.variable("tau")]
        if dof.drive == "motion" and f"{name}.qdd" in inputs:
            q, qd, qdd = (inputs[f"{name}.{what}"] for what in ("q", "qd", "qdd"))
            inputs |= {f"{name}.q": q + qd * end + qdd * end**2 / 2, f"{name}.qd": qd + qdd * end}
    dense = Dense(file)
    state = state_of(values, inputs, dense)
    motion = dense.solve(state, inputs)
    found: list = []
    check = Check(values, found)
    qdd = check.accelerations(motion, dense)
    check.forces(motion, dense, qdd)
    if not any("rotor_inertia" in motor for motor in runner.file.get("actuator", [])):
        check("energy", "energy.kinetic", values["energy.kinetic"], motion.kinetic, motion.energy_scale)
    check.gaps(motion.rows)
    check.contacts(dense)
    check.elastic_couplings(dense)
    return found


def distance(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of positions: angles as they are, lengths in units of the scene."""
    return float(np.abs(one - other).max(initial=0.0)) if one.shape == other.shape else math.inf


def scene_of(seed: int, index: int, library: Library) -> Runner:
    case = next(case for k in range(100) if "sizes" not in (case := draw(seed + 1000 * k, index, "all", 1.0)).tags)
    rng = np.random.default_rng([seed, index, 77])
    file = tomllib.loads(case.text)
    before = "ground"
    for link in file["link"]:
        before, link["parent"] = link["name"], link.get("parent", before)
    scene = Dense(tomllib.loads(case.text)).scene
    scene.move(scene.start())
    inputs = dict(case.inputs)
    give_motors(file, rng, scene, inputs)
    give_floors(file, rng, scene)
    return Runner(library, file, inputs, scene)


def judge(runner: Runner, folder: Path, exchange: bool) -> list[str]:
    found = []
    runner.load(1e-6)
    if "energy.work" not in runner.library.variables:
        return []  # every motion is prescribed
    coarse, _, first = runner.go(1e-6)
    first.free()
    fine, energies, slave = runner.go(1e-9)
    slack = 1e-7 + 30 * distance(coarse, fine)  # of a run at 1e-9, a thousandth of this but for chaos
    if imbalance(energies, slave) > balance_bound(runner):
        found.append(f"energy: {imbalance(energies, slave):.1e} at 1e-9")
    try:
        found += [f"dense: {f}" for f in sorted(dense_end(runner, slave, STEPS * SIZE), key=lambda f: -f.error)[:2]]
    except ArithmeticError as singular:
        found.append(f"dense: {singular}")
    slave.free()
    finer, _, last = runner.go(1e-11)
    last.free()
    if distance(fine, finer) > 0.3 * slack:
        found.append(f"tolerance: 1e-6 {distance(coarse, finer):.1e}, 1e-9 {distance(fine, finer):.1e}")
    for length, time in ((2.0**-20, 2.0**-10), (2.0**10, 2.0**5), (2.0**-20, 1.0)):
        # the error estimate of a single step can miss a jump, which other steps see
        for rtol in (1e-9, 5e-10) if has_jumps(runner) else (1e-9,):
            other, theirs, last = runner.go(rtol, length, time)
            off, unbalanced = distance(other, fine), imbalance(theirs, last)
            last.free()
            if off <= max(0.1 * slack, 10 * distance(fine, finer)):
                break
        else:
            found.append(
                f"size {length:.0e}, time {time:.0e}: {off:.1e} (1e-6: {distance(coarse, fine):.1e}, 1e-11: {distance(fine, finer):.1e})"
            )
        if unbalanced > balance_bound(runner):
            found.append(f"energy at size {length:.0e}, time {time:.0e}: {unbalanced:.1e}")
    found += [text for text in [restored(runner)] if text]
    if exchange and not any(name.endswith(".qdd") for name in runner.inputs):  # which continue between steps in co-simulation only
        try:
            loose, tight = (distance(exchanged(runner, folder, rtol), finer) for rtol in (1e-6, 1e-9))
            if tight > max(1e-6, 0.3 * slack, 0.1 * loose):
                # of a chaotic motion both may differ completely
                tighter = distance(exchanged(runner, folder, 1e-11), finer)
                if tighter > 0.1 * tight:
                    found.append(f"model exchange: {loose:.1e} at 1e-6, {tight:.1e} at 1e-9, {tighter:.1e} at 1e-11")
        except RuntimeError:  # more than CVode's 500 steps
            return found
    return found


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="index of the first scene")
    parser.add_argument("--exchange", action="store_true", help="also model exchange, by FMPy")
    parser.add_argument("--keep", type=Path, help="folder for the model files of scenes that do not agree")
    options = parser.parse_args(arguments)
    verdicts = Counter()
    with tempfile.TemporaryDirectory() as folder:
        library = Library(Path(folder))
        for index in range(options.first, options.first + options.count):
            runner = scene_of(options.seed, index, library)
            try:
                found = judge(runner, Path(folder), options.exchange)
            except Refused as refused:
                found = [f"refused: {refused}"]
            except ArithmeticError as error:
                held = any(dof.prescribed for dof in runner.scene.dofs) and runner.file.get("loop")
                found = [f"{'dead point' if held else 'stopped'}: {error}"]
            verdicts.update([found[0].split(":")[0] if found else "agree"])
            if found:
                print(f"seed {options.seed} index {index}: " + "\n    ".join(found), flush=True)
                if options.keep:
                    options.keep.mkdir(parents=True, exist_ok=True)
                    (options.keep / f"{options.seed}_{index}.toml").write_text(runner.text(runner.file, 1e-9))
    print(", ".join(f"{count} {what}" for what, count in verdicts.most_common()))
    return int(not set(verdicts) <= {"agree", "dead point"})


if __name__ == "__main__":
    sys.exit(main())
