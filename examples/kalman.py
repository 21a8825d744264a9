"""An unscented Kalman filter with an FMU: 2n+1 predictions per step, each from a state that is set in one running instance.

Input: noisy angles of a falling double pendulum; output: angles and angular velocities. Draws out/kalman.png.
"""

import shutil

import fmpy
import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot
from ready import ready

FMU, STEP, STEPS = ready("double_pendulum"), 0.01, 300
NOISE = 0.02  # rad, standard deviation of a measured angle
random = np.random.default_rng(1)

description = fmpy.read_model_description(FMU)
number = {v.name: v.valueReference for v in description.modelVariables}
JOINTS = [v.name.removesuffix(".tau") for v in description.modelVariables if v.name.endswith(".tau")]
STATE = [number[f"{joint}.{kind}"] for kind in ("q", "qd") for joint in JOINTS]
n, joints = len(STATE), len(JOINTS)
GIVEN = [number[f"state.{kind}[{i + 1}]"] for kind in ("q", "qd") for i in range(joints)]

folder = fmpy.extract(FMU)
plant, model = (fmpy.instantiate_fmu(folder, description, "CoSimulation") for _ in range(2))
for fmu in (plant, model):
    fmu.setupExperiment(startTime=0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
predictions = 0


def predict(state):
    """The state after one step; the pendulum does not depend on time."""
    global predictions
    model.setReal(GIVEN, list(state))
    model.setInteger([number["state.apply"]], [predictions + 1])  # its change applies the state
    model.doStep(predictions * STEP, STEP)
    predictions += 1
    return np.array(model.getReal(STATE))


# symmetric sigma points with equal weights; the mean has weight zero
weight = 1 / (2 * n)
measure = np.eye(joints, n)
process_noise = np.diag([1e-8] * joints + [1e-5] * joints)
measurement_noise = NOISE**2 * np.eye(joints)

estimate = np.array(plant.getReal(STATE)) + np.concatenate([random.normal(0, 0.1, joints), random.normal(0, 1, joints)])
covariance = np.diag([0.1**2] * joints + [1.0] * joints)
times, truth, measured, estimates, deviations = [], [], [], [], []
for k in range(STEPS):
    spread = np.linalg.cholesky(n * covariance)
    points = [estimate, *(estimate + spread.T), *(estimate - spread.T)]
    moved = np.array([predict(point) for point in points])
    estimate = weight * moved[1:].sum(axis=0)
    centred = moved[1:] - estimate
    covariance = weight * centred.T @ centred + process_noise

    plant.doStep(k * STEP, STEP)
    actual = np.array(plant.getReal(STATE))
    seen = actual[:joints] + random.normal(0, NOISE, joints)
    gain = covariance @ measure.T @ np.linalg.inv(measure @ covariance @ measure.T + measurement_noise)
    estimate = estimate + gain @ (seen - measure @ estimate)
    covariance = (np.eye(n) - gain @ measure) @ covariance
    covariance = (covariance + covariance.T) / 2
    times.append((k + 1) * STEP)
    truth.append(actual)
    measured.append(seen)
    estimates.append(estimate)
    deviations.append(np.sqrt(np.diag(covariance)))
for fmu in (plant, model):
    fmu.terminate()
    fmu.freeInstance()
shutil.rmtree(folder)

truth, measured, estimates, deviations = map(np.array, (truth, measured, estimates, deviations))
late = slice(STEPS // 2, None)
rms = lambda x: float(np.sqrt(np.mean(x**2)))
differenced = np.diff(measured, axis=0) / STEP - (truth[1:, joints:] + truth[:-1, joints:]) / 2
print(f"{predictions} predictions, {len(points)} per step")
print(
    f"rms error of angles: measured {rms((measured - truth[:, :joints])[late]):.4f} rad, "
    f"filtered {rms((estimates - truth)[late, :joints]):.4f} rad"
)
print(
    f"rms error of velocities: from differences {rms(differenced[late]):.3f} rad/s, "
    f"filtered {rms((estimates - truth)[late, joints:]):.3f} rad/s"
)

figure, axes = pyplot.subplots(n, 1, sharex=True, figsize=(8, 9), layout="constrained")
for i, ax in enumerate(axes):
    if i < joints:
        ax.plot(times, measured[:, i], ".", markersize=2, color="0.6", label="measured")
    ax.plot(times, truth[:, i], label="true")
    ax.plot(times, estimates[:, i], "--", label="filtered")
    ax.fill_between(times, *(estimates[:, i] + s * 3 * deviations[:, i] for s in (-1, 1)), alpha=0.2)
    ax.set_ylabel(f"{JOINTS[i % joints]}, rad{'/s' if i >= joints else ''}")
axes[0].legend(ncols=3)
axes[-1].set_xlabel("time, s")
figure.savefig("out/kalman.png", dpi=120)
