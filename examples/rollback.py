"""A master with rollback: it compares each step of a control loop with two half steps and controls the step size by the difference.

The FMU itself is accurate for any step size. The error is caused by the controller's torque, which is constant during a step.
Draws out/rollback.png.
"""

import shutil

import fmpy
import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot
from ready import ready

FMU, END = ready("double_pendulum"), 2.0  # s
TOLERANCE = 1e-5  # rad per step
STIFFNESS, DAMPING, GOAL = (60, 20), (6, 2), (0.5, -0.8)  # N m/rad, N m s/rad, rad

description = fmpy.read_model_description(FMU)
number = {v.name: v.valueReference for v in description.modelVariables}
JOINTS = [v.name.removesuffix(".tau") for v in description.modelVariables if v.name.endswith(".tau")]
q, qd, tau = ([number[f"{joint}.{kind}"] for joint in JOINTS] for kind in ("q", "qd", "tau"))


def start(folder):
    plant = fmpy.instantiate_fmu(folder, description, "CoSimulation")
    plant.setupExperiment(startTime=0)
    plant.enterInitializationMode()
    plant.exitInitializationMode()
    return plant


def step(plant, time, size):
    """Sets the controller's torque and steps the plant."""
    angles, speeds = plant.getReal(q), plant.getReal(qd)
    plant.setReal(tau, [k * (g - a) - d * s for k, d, g, a, s in zip(STIFFNESS, DAMPING, GOAL, angles, speeds, strict=True)])
    plant.doStep(time, size)


folder = fmpy.extract(FMU)

plant, time, size, rejected = start(folder), 0.0, 1e-3, 0
record = [(time, *plant.getReal(q), size)]
while time < END:
    size = min(size, END - time)
    before = plant.getFMUstate()
    step(plant, time, size)
    whole = plant.getReal(q)
    plant.setFMUstate(before)
    step(plant, time, size / 2)
    step(plant, time + size / 2, size / 2)
    error = max(abs(a - b) for a, b in zip(whole, plant.getReal(q), strict=True))
    if error > TOLERANCE:
        plant.setFMUstate(before)
        rejected += 1
    else:
        time = time + size
        record.append((time, *plant.getReal(q), size))
    plant.freeFMUstate(before)
    # a constant torque causes a local error of third order in the angles
    size *= min(2.0, max(0.2, 0.9 * (TOLERANCE / max(error, 1e-12)) ** (1 / 3)))
plant.terminate()
plant.freeInstance()

reference, steps = start(folder), 20000
for k in range(steps):
    step(reference, k * END / steps, END / steps)
off = max(abs(a - b) for a, b in zip(reference.getReal(q), record[-1][1:3], strict=True))
reference.terminate()
reference.freeInstance()
shutil.rmtree(folder)

sizes = [row[3] for row in record[1:]]
print(f"{len(sizes)} steps of {min(sizes):.2e} to {max(sizes):.2e} s, {rejected} rejected and repeated")
print(f"difference of {off:.1e} rad at {END} s from {steps} equal steps")

figure, (above, below) = pyplot.subplots(2, 1, sharex=True, figsize=(8, 6), layout="constrained")
times, *angles, _ = zip(*record, strict=True)
for joint, curve in zip(JOINTS, angles, strict=True):
    above.plot(times, curve, label=joint)
above.set(ylabel="angle, rad", title="a step-size control by rollback")
above.legend()
below.semilogy(times[1:], sizes, ".")
below.set(ylabel="communication step, s", xlabel="time, s")
figure.savefig("out/rollback.png", dpi=120)
