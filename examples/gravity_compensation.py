"""PD control with gravity compensation: the inverse FMU computes the gravity torques, a PD law controls the motion.

Usage: python examples/gravity_compensation.py            (builds its two FMUs in out/)
"""

import shutil

import fmpy
from ready import ready

STEP, STEPS = 0.001, 2000
JOINTS = [f"joint{i}" for i in range(1, 7)]
WANTED = [0.5, 0.5, -1.0, 0.3, 0.5, 0.2]  # rad
STIFFNESS = [400, 800, 300, 10, 2, 0.002]  # N m/rad: a tenth of those in hold_pose.py
DAMPING = [160, 200, 50, 1, 0.15, 1e-4]  # N m s/rad


class Loaded:
    """A running FMU with the value references of its variables."""

    def __init__(self, file: str) -> None:
        description = fmpy.read_model_description(file)
        self.number = {v.name: v.valueReference for v in description.modelVariables}
        self.folder = fmpy.extract(file)
        self.fmu = fmpy.instantiate_fmu(self.folder, description, "CoSimulation")
        self.fmu.setupExperiment(startTime=0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def all(self, kind: str) -> list[int]:
        return [self.number[f"{joint}.{kind}"] for joint in JOINTS]

    def close(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()
        shutil.rmtree(self.folder)


def run(compensated: bool) -> list[float]:
    """Returns the final position error of each joint (rad)."""
    arm, inverse = Loaded(ready("kuka_kr5")), Loaded(ready("kuka_kr5", inverse=True))
    for step in range(STEPS):
        angles, speeds = arm.fmu.getReal(arm.all("q")), arm.fmu.getReal(arm.all("qd"))
        torques = [k * (w - a) - c * s for k, c, w, a, s in zip(STIFFNESS, DAMPING, WANTED, angles, speeds, strict=True)]
        if compensated:
            # velocity and acceleration stay 0, so the result is the gravity torque
            inverse.fmu.setReal(inverse.all("q"), angles)
            weight = inverse.fmu.getReal(inverse.all("tau"))
            torques = [t + w for t, w in zip(torques, weight, strict=True)]
        arm.fmu.setReal(arm.all("tau"), torques)
        arm.fmu.doStep(step * STEP, STEP)
    missed = [w - a for w, a in zip(WANTED, arm.fmu.getReal(arm.all("q")), strict=True)]
    arm.close()
    inverse.close()
    return missed


if __name__ == "__main__":
    missed = {name: run(compensated) for name, compensated in (("PD alone", False), ("with compensation", True))}
    print("error after 2 s [rad]   " + " ".join(f"{joint:>9}" for joint in JOINTS))
    for name, errors in missed.items():
        print(f"{name:22}  " + " ".join(f"{error:9.1e}" for error in errors))
