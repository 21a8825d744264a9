"""Two arms hold one box, in two FMUs: forces against motions. Error of the coupling against the communication step of four masters.

The left FMU carries the box and takes the force of the right arm; the right FMU takes the motion of the box and returns the force. The
reference is one FMU of both arms. Each FMU is accurate for any step size: all errors shown are those of the coupling.
"""

import shutil
import tempfile
from pathlib import Path

import fmpy
import numpy as np

import build_fmu as rds

END, REACH, TOLERANCE = 0.4, 0.9, 1e-7  # s, m between the bases, m per step
LINK = '[[link]]\nname = "{}"\nparent = "{}"\n{}\n'
ARM = "mass = {1}\ncom = [{0}, 0, 0]\ninertia = [1e-4, {2}, {2}]\nstiffness = 20\nrest = {3}\nq = {3}\na = {4}"
HEAD = 'name = "{}"\ngravity = [0, -9.81, 0]\n[solver]\nrtol = 1e-10\natol = 1e-12\n'
HANDLE = LINK.format("slide", "ground", 'joint = "prismatic"\ndrive = "motion"\ngamma = 1.5707963267948966\nalpha = 1.5707963267948966')
HANDLE += LINK.format("handle", "slide", 'joint = "prismatic"\ndrive = "motion"\ngamma = 1.5707963267948966\nalpha = 1.5707963267948966')
PAD = '[[bushing]]\nname = "pad"\nlink_a = "right2"\npoint_a = [0.3, 0, 0]\nlink_b = "{}"\nstiffness = [5000, 5000, 0, 0, 0, 0]\n'
PAD += "damping = [20, 20, 0, 0, 0, 0]\npoint_b = [{}, 0, 0]\n"
GRIP = '[[frame]]\nname = "grip"\nlink = "left2"\nposition = [0.45, 0, 0]\nport = "ground"\n'
GRIP += 'outputs = ["pose", "velocity", "acceleration"]\n'


def arm(name, x, q):
    """Two links of 0.3 m with springs in the joints, from a base at x; the left one carries the box."""
    masses = ((0.15, 1.0, 0.01), (0.33, 2.0, 0.03)) if name == "left" else ((0.15, 1.0, 0.01), (0.15, 0.8, 0.007))
    return "".join(
        LINK.format(f"{name}{i + 1}", f"{name}{i}" if i else "ground", ARM.format(*masses[i], q[i], 0.3 if i else x)) for i in range(2)
    )


def built(folder, name, text):
    """The unpacked FMU of a model file."""
    (folder / f"{name}.toml").write_text(HEAD.format(name) + text)
    with rds.load(folder / f"{name}.toml") as model:
        return fmpy.extract(model.build(folder / f"{name}.fmu"), folder / name)


class Part:
    """An FMU with lists of variables by name."""

    def __init__(self, folder):
        description = fmpy.read_model_description(folder)
        self.number = {v.name: v.valueReference for v in description.modelVariables}
        self.fmu = fmpy.instantiate_fmu(folder, description, "CoSimulation")
        self.fmu.setupExperiment(startTime=0)
        self.fmu.enterInitializationMode()

    def refs(self, names):
        return [self.number[name] for name in names]

    def get(self, names):
        return np.array(self.fmu.getReal(self.refs(names)))

    def get_rate(self, names):
        return np.array(self.fmu.getRealOutputDerivatives(self.refs(names), [1] * len(names)))

    def set(self, names, *series):
        """Sets values and, for the next step, their derivatives."""
        self.fmu.setReal(self.refs(names), list(series[0]))
        for order, values in enumerate(series[1:], 1):
            self.fmu.setRealInputDerivatives(self.refs(names), [order] * len(names), list(values))


GRIP_MOTION = PLACE, SPEED, _ = [[f"grip.{kind}[{i}]" for i in (1, 2)] for kind in ("position", "velocity", "acceleration")]
PUSH, PULL = ["grip.force[1]", "grip.force[2]"], ["slide.tau", "handle.tau"]
MOTION = [[f"{joint}.{kind}" for joint in ("slide", "handle")] for kind in ("q", "qd", "qdd")]


class Coupling:
    """Both parts at a communication point: motion of the grip, force on it, and their rates."""

    def __init__(self):
        self.left, self.right, self.time, self.h = Part(LEFT), Part(RIGHT), 0.0, 1e-3
        for part in (self.left, self.right):
            part.fmu.exitInitializationMode()
        self.read()

    def read(self):
        """Exchanges the values of a communication point."""
        self.place, self.speed, acceleration = (self.left.get(names) for names in GRIP_MOTION)
        for names, values in zip(MOTION, (self.place, self.speed, acceleration), strict=True):
            self.right.set(names, values)
        self.force, self.rate = -self.right.get(PULL), -self.right.get_rate(PULL)

    def move_left(self, h, *force):
        self.left.set(PUSH, *force)
        self.left.fmu.doStep(self.time, h)

    def follow(self, h):
        """The right part follows the cubic between both ends of the left one's step; ends the step."""
        way, gain = self.left.get(PLACE) - self.place - h * self.speed, self.left.get(SPEED) - self.speed
        self.right.set(MOTION[2], 6 * way / h**2 - 2 * gain / h, 6 * gain / h**2 - 12 * way / h**3)
        self.right.fmu.doStep(self.time, h)
        self.time += h
        self.read()

    def held(self, h):
        """Both parts step with the values of the start."""
        self.right.set(MOTION[2], np.zeros(2))
        self.move_left(h, self.force)
        self.right.fmu.doStep(self.time, h)
        self.time += h
        self.read()

    def with_rates(self, h):
        """The force is extrapolated by its derivative."""
        self.move_left(h, self.force, self.rate)
        self.follow(h)

    def repeated(self, h):
        """The same, then again from the start with the force interpolated between both ends. Returns the change of the grip."""
        before = self.save()
        self.with_rates(h)
        place, force, rate = self.place, self.force, self.rate
        self.restore(before)
        rise, bend = force - self.force - h * self.rate, rate - self.rate
        self.move_left(h, self.force, self.rate, 6 * rise / h**2 - 2 * bend / h, 6 * bend / h**2 - 12 * rise / h**3)
        self.follow(h)
        self.free(before)
        return np.abs(self.place - place).max()

    def controlled(self, _):
        """Repeated steps whose size follows from the change; a step with too large a change is taken back."""
        while True:
            before, h = self.save(), min(self.h, END - self.time)
            change = self.repeated(h)
            self.h = h * min(2.0, max(0.2, 0.9 * (TOLERANCE / max(change, 1e-15)) ** 0.25))
            if change > TOLERANCE:
                self.restore(before)
            self.free(before)
            if change <= TOLERANCE:
                return

    def save(self):
        return [part.fmu.getFMUstate() for part in (self.left, self.right)], (self.time, self.place, self.speed, self.force, self.rate)

    def restore(self, saved):
        for part, state in zip((self.left, self.right), saved[0], strict=True):
            part.fmu.setFMUstate(state)
        self.time, self.place, self.speed, self.force, self.rate = saved[1]

    def free(self, saved):
        for part, state in zip((self.left, self.right), saved[0], strict=True):
            part.fmu.freeFMUstate(state)


def touching(x, y):
    """Joint angles of the right arm whose pad touches a point."""
    bend = np.arccos((x * x + y * y) / 0.18 - 1)
    return np.arctan2(y, x) - bend / 2, bend


def error(master, h):
    """Maximum error of the grip, and the number of steps."""
    coupling, whole = Coupling(), Part(WHOLE)
    whole.fmu.exitInitializationMode()
    worst, steps = 0.0, 0
    while coupling.time < END - 1e-9:
        time, steps = coupling.time, steps + 1
        master(coupling, h)
        whole.fmu.doStep(time, coupling.time - time)
        worst = max(worst, np.abs(coupling.place - whole.get(PLACE)).max())
    for part in (coupling.left, coupling.right, whole):
        part.fmu.terminate()
        part.fmu.freeInstance()
    return worst, steps


q_left = (0.9, -1.2)
x, y = (0.3 * f(q_left[0]) + 0.45 * f(sum(q_left)) for f in (np.cos, np.sin))
arms = {"left": arm("left", 0, q_left), "right": arm("right", REACH, touching(x - REACH, y))}
folder = Path(tempfile.mkdtemp())
WHOLE = built(folder, "whole", arms["left"] + arms["right"] + PAD.format("left2", 0.45) + GRIP)
LEFT = built(folder, "left", arms["left"] + GRIP)
RIGHT = built(folder, "right", HANDLE + arms["right"] + PAD.format("handle", 0))
for size in (1e-3, 2e-3, 4e-3, 8e-3):
    errors = [error(master, size)[0] for master in (Coupling.held, Coupling.with_rates, Coupling.repeated)]
    print(f"{1000 * size:g} ms:  held {errors[0]:.1e} m  with rates {errors[1]:.1e} m  repeated {errors[2]:.1e} m")
found, count = error(Coupling.controlled, 0)
print(f"controlled: {count} steps, mean {1000 * END / count:.1f} ms, {found:.1e} m")
shutil.rmtree(folder)
