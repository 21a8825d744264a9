"""Builds each FMU once with the packager, as a user would."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from build_fmu import native
from build_fmu.errors import UserError
from tests.command_line import command
from tests.fmi.raw import Slave, Unpacked
from tests.fmi.raw3 import Unpacked3
from tests.fmi.subjects import Subject

ROOT = Path(__file__).resolve().parents[2]

# Everything a scene can show, and little else: two joints of two kinds, all parameters tunable.
CART = """
name = "cart"
gravity = [0, -9.81, 0]

[[link]]
name = "cart"
joint = "prismatic"
joint_name = "rail"
alpha = 1.5707963267948966
gamma = 1.5707963267948966
mass = 2
damping = 0.1

[[link]]
name = "pole"
joint_name = "hinge"
alpha = -1.5707963267948966
mass = 0.5
com = [0.4, 0, 0]
inertia = [0.02, 0.02, 0.02]
q = 0.3
qd = -1

[[link]]
name = "tip"
joint = "fixed"
a = 0.8
mass = 0.1

[[link]]
name = "idle"
parent = "ground"
drive = "free"
mass = 1
com = [0.1, 0, 0]

[solver]
rtol = 1e-8
atol = 1e-10

[fmu]
tunable = ["pole.mass", "pole.com[1]", "pole.inertia[2]", "pole.inertia[4]", "tip.mass", "rail.damping", "hinge.stiffness",
           "hinge.rest", "hinge.armature", "idle.mass", "gravity[2]"]
"""

# Every kind of variable.
EVERYTHING = """
name = "everything"
gravity = [0, 0, -9.81]

[[link]]
name = "base"
joint = "free"
mass = 5
inertia = [1, 1.1, 1.2]

[[link]]
name = "arm"
parent = "base"
mass = 1
com = [0.1, 0, 0]
inertia = [0.1, 0.1, 0.1]
friction = 0.1
static_friction = 0.2
lower = -1
upper = 1
stop_stiffness = 100

[[link]]
name = "rail"
parent = "base"
joint = "prismatic"
mass = 1
friction = 0.1
lower = -1
upper = 1
stop_stiffness = 100

[[link]]
name = "crank"
parent = "base"
drive = "motion"
mass = 1
inertia = [0.1, 0.1, 0.1]

[[link]]
name = "ram"
parent = "base"
joint = "prismatic"
drive = "motion"
mass = 1

[[link]]
name = "brake"
parent = "base"
drive = "locked"
mass = 1
com = [0.1, 0, 0]

[[link]]
name = "cross"
joint = "universal"
damping = [0.1, 0.2]
mass = 1
com = [0.1, 0.2, 0.3]
inertia = [0.1, 0.1, 0.1]

[[link]]
name = "disk"
joint = "planar"
mass = 1
inertia = [0.1, 0.1, 0.1]

[[link]]
name = "post"
joint = "fixed"
mass = 1
com = [0.1, 0, 0.5]

[[loop]]
name = "pin"
type = "revolute"
link_a = "disk"
link_b = "ground"

[[loop]]
name = "guide"
type = "point"
link_a = "cross"
link_b = "ground"
directions = [[1, 0, 0]]

[[frame]]
name = "tip"
link = "arm"
outputs = ["pose", "velocity", "rotation"]
port = "ground"

[[frame]]
name = "tool"
link = "rail"
port = "frame"

[controller]
law = "pd"
joints = ["rail", "arm"]
kp = 1
kd = 1
input = true

[solver]
method = "auto"

[fmu]
outputs = ["acceleration", "energy", "solver", "momentum", "reference", "power"]
tunable = ["post.mass", "post.com[3]", "gravity[1]", "arm.mass", "arm.com[1]", "arm.inertia[1]", "arm.inertia[4]", "cross[2].damping",
           TUNABLE]
"""
OF_JOINTS = (
    "damping",
    "stiffness",
    "rest",
    "armature",
    "friction",
    "static_friction",
    "friction_velocity",
    "lower",
    "upper",
    "stop_stiffness",
    "stop_damping",
    "stop_width",
    "kp",
    "kd",
    "target",
)
OWN = {
    "cart": CART,
    "everything": EVERYTHING.replace("TUNABLE", ", ".join(f'"{joint}.{name}"' for joint in ("arm", "rail") for name in OF_JOINTS)),
}


def build_fmu(model: Path, target: Path, *options: str) -> Path:
    done = command("build", model, "-o", target, "--no-show", *options)
    assert done.returncode == 0, done.stderr
    return target


@pytest.fixture(scope="session")
def fmu_file(tmp_path_factory):
    """Returns a function: name of a model in models/, "<model>_inverse" or a scene of ours -> path of its FMU."""
    try:
        native.library()
    except UserError as error:
        pytest.skip(str(error))
    folder, built = tmp_path_factory.mktemp("fmus"), {}

    def file(name: str) -> Path:
        if name not in built:
            model = ROOT / "models" / f"{name}.toml"
            if name in OWN:
                model = folder / f"{name}.toml"
                model.write_text(OWN[name])
            inverse = name.endswith("_inverse")
            if inverse:
                model = ROOT / "models" / f"{name.removesuffix('_inverse')}.toml"
            built[name] = build_fmu(model, folder / f"{name}.fmu", *["--inverse"] * inverse)
        return built[name]

    return file


@pytest.fixture(scope="session")
def fmu(fmu_file, tmp_path_factory):
    """Returns a function: name of a model -> the unpacked FMU, loaded."""
    loaded = {}

    def unpacked(name: str) -> Unpacked:
        if name not in loaded:
            loaded[name] = Unpacked(fmu_file(name), tmp_path_factory.mktemp(name))
        return loaded[name]

    return unpacked


@pytest.fixture(scope="session")
def fmu3_file(fmu_file, tmp_path_factory):
    """Returns a function: name of a model -> path of its FMU of FMI 3.0."""
    built = {}

    def file(name: str):
        if name not in built:
            folder = tmp_path_factory.mktemp("fmi3")
            model = ROOT / "models" / f"{name}.toml"
            if not model.is_file():
                model = fmu_file(name).with_suffix(".toml")
            built[name] = build_fmu(model, folder / f"{name}.fmu", "--fmi", "3")
        return built[name]

    return file


@pytest.fixture(scope="session")
def fmu3(fmu3_file, tmp_path_factory):
    """Returns a function: name of a model -> its FMU of FMI 3.0, unpacked and loaded."""
    loaded = {}

    def unpacked(name: str) -> Unpacked3:
        if name not in loaded:
            loaded[name] = Unpacked3(fmu3_file(name), tmp_path_factory.mktemp(name))
        return loaded[name]

    return unpacked


@pytest.fixture(scope="session")
def built(fmu_file, tmp_path_factory) -> Callable[..., Unpacked]:
    """Returns a function: text of a model file, options of the command, tables beside the file -> the unpacked FMU, loaded."""
    loaded = {}

    def unpacked(text: str, *options: str, **tables: str) -> Unpacked:
        key = (text, options, tuple(tables.items()))
        if key not in loaded:
            folder = tmp_path_factory.mktemp("built")
            (folder / "model.toml").write_text(text, encoding="utf-8")
            for name, content in tables.items():
                (folder / f"{name}.csv").write_text(content)
            loaded[key] = Unpacked(build_fmu(folder / "model.toml", folder / "model.fmu", *options), folder / "unpacked")
        return loaded[key]

    return unpacked


@pytest.fixture(scope="session")
def built3(tmp_path_factory) -> Callable[[str], Unpacked3]:
    """Returns a function: text of a model file -> its FMU of FMI 3.0, unpacked and loaded."""
    loaded = {}

    def unpacked(text: str) -> Unpacked3:
        if text not in loaded:
            folder = tmp_path_factory.mktemp("built3")
            (folder / "model.toml").write_text(text, encoding="utf-8")
            loaded[text] = Unpacked3(build_fmu(folder / "model.toml", folder / "model.fmu", "--fmi", "3"), folder / "unpacked")
        return loaded[text]

    return unpacked


@pytest.fixture
def instance() -> Iterator[Callable[[Unpacked], Slave]]:
    """Returns a function: unpacked FMU -> an instance with logging, which is freed after the test."""
    made = []

    def slave(fmu: Unpacked) -> Slave:
        made.append(Slave(fmu, logging=True))
        return made[-1]

    yield slave
    for one in made:
        one.free()


@pytest.fixture(scope="session")
def plot_settings(tmp_path_factory) -> Path:
    """The folder of matplotlib's font cache, built: a program that takes long to build it says so on stderr."""
    folder = tmp_path_factory.mktemp("matplotlib")
    command = [sys.executable, "-c", "import matplotlib.font_manager"]
    subprocess.run(command, env={**os.environ, "MPLCONFIGDIR": str(folder)}, stderr=subprocess.DEVNULL, check=True)
    return folder


@pytest.fixture
def example(fmu_file, tmp_path, plot_settings) -> Callable[..., list[str]]:
    """Returns a function: program of examples/, models -> its lines, run beside a folder out/ with the FMUs as `make demo` leaves it."""

    def lines(program: str, *models: str) -> list[str]:
        (tmp_path / "out").mkdir()
        for model in models:
            shutil.copy(fmu_file(model), tmp_path / "out")
        done = subprocess.run(
            [sys.executable, str(ROOT / "examples" / program)],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            env={**os.environ, "MPLCONFIGDIR": str(plot_settings)},
        )
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout.splitlines()

    return lines


@pytest.fixture(scope="session")
def subject(fmu):
    """Returns a function: name of a model -> what the abuse tests know of its FMU."""
    known = {}
    return lambda name: known[name] if name in known else known.setdefault(name, Subject(fmu(name)))
