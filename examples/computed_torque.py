"""Computed-torque control: the inverse FMU of the KUKA KR5 computes the torques for its plant FMU.

Draws out/computed_torque.png.
"""

import shutil
from math import cos, pi, sin

import fmpy
import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot
from ready import ready

STEP, STEPS, MOVE = 0.001, 2000, 1.0  # s, 1, s
START, GOAL = 0.05, pi / 3  # rad: start error of the arm; the trajectory starts at 0
POSITION_GAIN, VELOCITY_GAIN = 49, 14  # 1/s2, 1/s
JOINTS = [f"joint{i}" for i in range(1, 7)]


def reference(time):
    """The cycloid from 0 to GOAL in MOVE seconds: position, velocity, acceleration."""
    if time >= MOVE:
        return GOAL, 0.0, 0.0
    w = 2 * pi / MOVE
    return (GOAL / MOVE * x for x in (time - sin(w * time) / w, 1 - cos(w * time), w * sin(w * time)))


class Model:
    """One FMU with the value references of its joints."""

    def __init__(self, path, start):
        description = fmpy.read_model_description(path)
        number = {v.name: v.valueReference for v in description.modelVariables}
        self.of = {kind: [number[f"{joint}.{kind}"] for joint in JOINTS] for kind in ("q", "qd", "qdd", "tau")}
        self.folder = fmpy.extract(path)
        self.fmu = fmpy.instantiate_fmu(self.folder, description, "CoSimulation")
        self.fmu.setupExperiment(startTime=0)
        self.fmu.setReal([number[f"{joint}.{start}"] for joint in JOINTS], [START] * 6)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def get(self, kind):
        return self.fmu.getReal(self.of[kind])

    def set(self, kind, values):
        self.fmu.setReal(self.of[kind], values)

    def close(self):
        self.fmu.terminate()
        self.fmu.freeInstance()
        shutil.rmtree(self.folder)


def track(with_model):
    """Returns times and the six tracking errors (rad): computed torque, or the same gains on constant inertias."""
    plant, inverse = Model(ready("kuka_kr5"), "q0"), Model(ready("kuka_kr5", inverse=True), "q")
    inertia = [14.8, 9.16, 1.09, 0.0141, 0.00277, 1.65e-6]  # kg m2, the diagonal of the mass matrix at 0
    times, errors = [], []
    for step in range(STEPS + 1):
        q, qd = plant.get("q"), plant.get("qd")
        wanted, speed, acceleration = reference(step * STEP)
        times.append(step * STEP)
        errors.append([wanted - a for a in q])
        ask = [acceleration + VELOCITY_GAIN * (speed - b) + POSITION_GAIN * (wanted - a) for a, b in zip(q, qd, strict=True)]
        if with_model:
            for kind, values in (("q", q), ("qd", qd), ("qdd", ask)):
                inverse.set(kind, values)
            torques = inverse.get("tau")
        else:
            torques = [m * a for m, a in zip(inertia, ask, strict=True)]
        plant.set("tau", torques)
        for model in (plant, inverse):
            model.fmu.doStep(step * STEP, STEP)
    plant.close()
    inverse.close()
    return times, errors


figure, axes = pyplot.subplots(2, 1, sharex=True, figsize=(8, 6), layout="constrained")
for ax, with_model, title in zip(axes, (False, True), ("PD control", "computed torque"), strict=True):
    times, errors = track(with_model)
    late = max(max(map(abs, row)) for time, row in zip(times, errors, strict=True) if time >= 1.5)
    print(f"{title}: maximum error {max(max(map(abs, row)) for row in errors):.4f} rad, after 1.5 s {late:.1e} rad")
    for joint, curve in zip(JOINTS, zip(*errors, strict=True), strict=True):
        ax.plot(times, curve, label=joint)
    ax.set(title=f"{title}, same gains", ylabel="tracking error, rad")
    ax.grid(alpha=0.3)
figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=6, fontsize="small")
axes[1].set_xlabel("time, s")
figure.savefig("out/computed_torque.png", dpi=120)
