"""A sampled PD controller holds the KUKA KR5 in a pose: the FMU as the plant of a control loop."""

import shutil

import fmpy
from ready import ready

FMU, STEP, STEPS = ready("kuka_kr5"), 0.001, 2000
JOINTS = [f"joint{i}" for i in range(1, 7)]
WANTED = [0.0, 0.5, -1.0, 0.0, 0.5, 0.0]  # rad
STIFFNESS = [4000, 8000, 4000, 100, 20, 0.02]  # N m/rad
DAMPING = [400, 800, 300, 4, 0.8, 0.0005]  # N m s/rad; limited, because the torque is constant during a step

description = fmpy.read_model_description(FMU)
number = {v.name: v.valueReference for v in description.modelVariables}
q, qd, tau = ([number[f"{joint}.{kind}"] for joint in JOINTS] for kind in ("q", "qd", "tau"))

folder = fmpy.extract(FMU)
arm = fmpy.instantiate_fmu(folder, description, "CoSimulation")
arm.setupExperiment(startTime=0)
arm.enterInitializationMode()
arm.exitInitializationMode()
print("time, joint angles in rad")
for step in range(STEPS + 1):
    angles, speeds = arm.getReal(q), arm.getReal(qd)
    if step % 400 == 0:
        print(f"{step * STEP:.1f} s   " + " ".join(f"{angle:8.4f}" for angle in angles))
    arm.setReal(tau, [k * (w - a) - c * s for k, c, w, a, s in zip(STIFFNESS, DAMPING, WANTED, angles, speeds, strict=True)])
    arm.doStep(step * STEP, STEP)
arm.terminate()
arm.freeInstance()
shutil.rmtree(folder)
