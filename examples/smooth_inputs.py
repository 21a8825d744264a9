"""Accuracy gained by input derivatives: a control loop with torques that are constant, linear or quadratic during a step.

The drives have a first-order lag, so their torques are smooth with known derivatives. Draws out/smooth_inputs.png.
"""

import shutil

import fmpy
import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot
from ready import ready

FMU, END = ready("double_pendulum"), 1.0  # s
STIFFNESS, DAMPING, GOAL, LAG = np.array([60, 20]), np.array([6, 2]), np.array([0.5, -0.8]), 0.1  # N m/rad, N m s/rad, rad, s
METHODS = ("constant", "linear", "quadratic")

description = fmpy.read_model_description(FMU)
number = {v.name: v.valueReference for v in description.modelVariables}
JOINTS = [v.name.removesuffix(".tau") for v in description.modelVariables if v.name.endswith(".tau")]
q, qd, qdd, tau = ([number[f"{joint}.{kind}"] for joint in JOINTS] for kind in ("q", "qd", "qdd", "tau"))
folder = fmpy.extract(FMU)


def rate(torque, angles, speeds):
    """The lag of the drives: LAG tau' + tau = demand of the controller."""
    return (STIFFNESS * (GOAL - angles) - DAMPING * speeds - torque) / LAG


def drive(torque, begin, end, size, parts=4):
    """Step of the drives by Runge-Kutta steps; the state of the plant is interpolated by a cubic polynomial."""
    (x0, v0), (x1, v1) = begin, end

    def plant_at(s):
        a, b = s * s * (3 - 2 * s), s * (s - 1)
        x = x0 * (1 - a) + x1 * a + size * b * ((s - 1) * v0 + s * v1)
        v = 6 * s * (1 - s) * (x1 - x0) / size + (1 - s) * (1 - 3 * s) * v0 + s * (3 * s - 2) * v1
        return x, v

    h = size / parts
    for k in range(parts):
        at = [plant_at((k + c) / parts) for c in (0, 0.5, 1)]
        a = rate(torque, *at[0])
        b = rate(torque + h / 2 * a, *at[1])
        c = rate(torque + h / 2 * b, *at[1])
        torque = torque + h / 6 * (a + 2 * b + 2 * c + rate(torque + h * c, *at[2]))
    return torque


def run(method, steps):
    """The angles at END; in each step the plant is stepped first, with the input of the given method."""
    plant = fmpy.instantiate_fmu(folder, description, "CoSimulation")
    plant.setupExperiment(startTime=0, tolerance=1e-11)
    plant.enterInitializationMode()
    plant.exitInitializationMode()
    torque, size = np.zeros(len(JOINTS)), END / steps
    for k in range(steps):
        plant.setReal(tau, list(torque))
        angles, speeds, accelerations = (np.array(plant.getReal(of)) for of in (q, qd, qdd))
        first = rate(torque, angles, speeds)
        second = (-STIFFNESS * speeds - DAMPING * accelerations - first) / LAG
        for order, values in enumerate((first, second)[: METHODS.index(method)], start=1):
            plant.setRealInputDerivatives(tau, [order] * len(tau), list(values))
        plant.doStep(k * size, size)
        after = tuple(np.array(plant.getReal(of)) for of in (q, qd))
        torque = drive(torque, (angles, speeds), after, size)
    plant.terminate()
    plant.freeInstance()
    return after[0]


exact = run("quadratic", 4000)
counts = (25, 50, 100, 200, 400)
print("step, s   " + "".join(f"{method:>12}" for method in METHODS))
errors = []
for steps in counts:
    errors.append([max(abs(run(method, steps) - exact)) for method in METHODS])
    print(f"{END / steps:<10}" + "".join(f"{error:12.1e}" for error in errors[-1]) + "  rad")
shutil.rmtree(folder)

figure, ax = pyplot.subplots(figsize=(7, 5), layout="constrained")
for method, curve in zip(METHODS, zip(*errors, strict=True), strict=True):
    ax.loglog([END / steps for steps in counts], curve, "o-", label=method)
ax.set(xlabel="communication step size, s", ylabel=f"error of the angles at {END} s, rad", title="torque during a step")
ax.set_xticks([END / steps for steps in counts], [f"{END / steps:g}" for steps in counts])
ax.minorticks_off()
ax.grid(alpha=0.3)
ax.legend()
figure.savefig("out/smooth_inputs.png", dpi=120)
