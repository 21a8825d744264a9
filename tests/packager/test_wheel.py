"""A wheel in an empty environment: a model file becomes a running FMU with no compiler and no source tree. Slow.

REDYSIM_FMU_WHEEL names a wheel that is built already; otherwise the test builds one.
"""

import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path
from platform import machine

import pytest

from build_fmu.native import LIBRARIES

ROOT = Path(__file__).parents[2]
# what `make win64` and `make darwin64` have left here goes into the wheel, too
BUILDS = {**LIBRARIES, "wasm": ("libredysim_fmu.wasm", "")}
OTHERS = {p: names for p, names in BUILDS.items() if (ROOT / "build" / p / "fmu_src" / "fmi" / names[0]).is_file()}
pytestmark = pytest.mark.slow


def command(*words, **more):
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False, **more)
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
    assert re.fullmatch(r"build_fmu-[0-9.]+-py3-none-(many)?linux_\w+\.whl", wheel.name)
    names = zipfile.ZipFile(wheel).namelist()
    for name in ("libredysim_fmu.so", "describe", "fmu_driver", "LICENSE", "licenses/sundials.txt"):
        assert f"build_fmu/native/{name}" in names
    assert not [name for name in names if name.startswith(("tests/", "fmu_src/"))]
    for platform, (name, _) in OTHERS.items():
        assert {f"build_fmu/native/{platform}/{name}", f"build_fmu/native/{platform}/licenses/sundials.txt"} <= set(names)


def test_the_tag_is_the_newest_symbol_version_of_the_system_libraries(wheel, tmp_path):
    if "-manylinux_" not in wheel.name:
        pytest.skip("scripts/wheel.sh gives a wheel its tag")
    needed, versions = set(), set()
    with zipfile.ZipFile(wheel) as archive:
        assert not [name for name in archive.namelist() if name.startswith("build_fmu.libs/")]  # foreign libraries
        for name in ("libredysim_fmu.so", "describe", "fmu_driver"):
            file = archive.extract(f"build_fmu/native/{name}", tmp_path)
            needed |= set(re.findall(r"\(NEEDED\).*\[(\w+)", command("readelf", "-d", file)))
            versions |= {int(n) for n in re.findall(r"GLIBC_2\.([0-9]+)", command("readelf", "-V", file))}
        facts = archive.read(next(n for n in archive.namelist() if n.endswith(".dist-info/WHEEL"))).decode()
    assert needed <= {"libc", "libm", "ld"}
    tag = f"py3-none-manylinux_2_{max(versions)}_{machine()}"
    assert wheel.name.endswith(f"-{tag}.whl") and f"Tag: {tag}\n" in facts


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
