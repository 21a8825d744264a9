"""The process an FMU runs in: its floating-point modes, flags, signals and locale stay as they are and change nothing."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from random import Random

import pytest

from tests.fmi.conftest import build_fmu
from tests.fmi.raw import Slave, Unpacked

ROOT = Path(__file__).resolve().parents[2]

START = """
import ctypes as c, math, signal, sys
from pathlib import Path
from tests.fmi.raw import ERROR, OK, Slave, Unpacked
libm = c.CDLL("libm.so.6")
fmu = Unpacked(Path(sys.argv[1]), Path(sys.argv[2]))
"""


@pytest.fixture
def run(fmu_file, tmp_path):
    """Returns a function: program -> what it prints, run in a process of its own with an unpacked cart FMU."""

    def output(program: str, **environment) -> str:
        done = subprocess.run(
            [sys.executable, "-c", START + program, str(fmu_file("cart")), str(tmp_path / "fmu")],
            cwd=ROOT,
            capture_output=True,
            text=True,
            env={**os.environ, **environment},
        )
        assert (done.returncode, done.stderr) == (0, ""), done.stderr
        return done.stdout

    return output


@pytest.fixture
def decimal_commas(tmp_path) -> Path:
    """The folder of the locale de_DE.UTF-8."""
    if not shutil.which("localedef"):
        pytest.skip("localedef is not installed")
    folder = tmp_path / "locales"
    folder.mkdir()
    made = subprocess.run(["localedef", "-c", "-f", "UTF-8", "-i", "de_DE", str(folder / "de_DE.UTF-8")], capture_output=True)
    if not (folder / "de_DE.UTF-8").exists():
        pytest.skip(f"no locale with decimal commas can be made: {made.stderr.decode()}")
    return folder


@pytest.mark.parametrize("method", ["erk", "adams", "bdf"])
def test_floating_point_traps_flags_and_rounding(run, method):
    """A failing step meets infinities: no trap of the master goes off, no flag of its stays up."""
    out = run(f"""
INVALID, ZERO_DIVISION, OVERFLOW, ALL, UPWARD, NEAREST = 1, 4, 8, 0x3d, 0x800, 0
times = [k * 0.01 for k in range(20)]  # rounded once, to nearest
def calls(slave):
    yield lambda: slave.initialize(start={{"solver.method": "{method}"}})
    for time in times:
        yield lambda time=time: slave.step(time, 0.01)
    yield lambda: slave.get("hinge.qdd")
    yield lambda: slave.call("SetFMUstate", slave.save())
    yield lambda: (slave.set("hinge.tau", 1e308), slave.set("rail.tau", 1e308))
    yield lambda: slave.step(0.2, 0.01) == ERROR or print("no failure")
    yield lambda: slave.call("Reset")

ends = []
for rounding in (NEAREST, UPWARD):
    for traps in (0, INVALID | ZERO_DIVISION | OVERFLOW):
        slave = Slave(fmu)
        for k, call in enumerate(calls(slave)):
            libm.feclearexcept(ALL)
            libm.fesetround(rounding)
            libm.feenableexcept(traps)
            call()
            found = libm.fetestexcept(ALL & ~0x20), libm.fegetround(), libm.fegetexcept()
            libm.fedisableexcept(ALL)
            libm.fesetround(NEAREST)
            if found != (0, rounding, traps):
                print(k, found)
            if k == 20:
                ends.append(slave.get("hinge.q"))
        slave.free()
print(len(set(ends)))
""")
    assert out == "1\n", "the same result whatever the master's modes are"


def test_a_model_is_read_alike_in_every_rounding_mode(run):
    out = run("""
values = []
for rounding in (0, 0x400, 0x800, 0xc00):
    libm.fesetround(rounding)
    slave = Slave(fmu)
    kept = libm.fegetround() == rounding
    libm.fesetround(0)
    slave.initialize()
    slave.run(0.2, 0.01)
    values.append((kept, *slave.reals([name for name, (kind, _) in fmu.variables.items() if kind == "Real"])))
    slave.free()
print(len(set(values)), values[0][0])
""")
    assert out == "1 True\n"


def test_tables_are_read_in_a_locale_with_decimal_commas(decimal_commas, tmp_path):
    (tmp_path / "motion.csv").write_text("time,crank.q\n0,0\n0.5,0.25\n1,+7.5e-1\n")
    (tmp_path / "model.toml").write_text(
        'name = "tabled"\n[[link]]\nname = "crank"\ndrive = "motion"\nmass = 1.5\ninertia = [0.1, 0.1, 0.1]\n'
        '[[trajectory]]\njoint = "crank"\ntype = "table"\nfile = "motion.csv"\n'
    )
    fmu = build_fmu(tmp_path / "model.toml", tmp_path / "model.fmu")
    program = (
        START
        + """
import locale
locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
print(locale.format_string("%.1f", 0.5))
with Slave(fmu) as slave:
    slave.initialize().run(1.0, 0.5)
    print(slave.get("crank.q"))
"""
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(fmu), str(tmp_path / "fmu")],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env={**os.environ, "LOCPATH": str(decimal_commas)},
    )
    assert (done.stdout, done.stderr) == ("0,5\n0.75\n", "")


def test_numbers_of_the_model_file_are_the_nearest_doubles(tmp_path):
    """The library reads them by functions of its own."""
    random = Random(3)
    texts = ["5e-324", "2.2250738585072014e-308", "2.2250738585072011e-308", "1.7976931348623157e+300", "9007199254740993.0", "1e23", "0.1"]
    texts += [f"{random.uniform(1, 10):.{random.randrange(1, 30)}f}e{random.randrange(-290, 290)}" for _ in range(60)]
    masses = [text if "." in text or "e" in text else f"{text}.0" for text in texts]
    links = "".join(f'[[link]]\nname = "l{k}"\nparent = "ground"\narmature = 1\nstiffness = {text}\n' for k, text in enumerate(masses))
    tunable = ", ".join(f'"l{k}.stiffness"' for k in range(len(masses)))
    (tmp_path / "model.toml").write_text(f'name = "numbers"\n{links}[fmu]\ntunable = [{tunable}]\n')
    fmu = Unpacked(build_fmu(tmp_path / "model.toml", tmp_path / "model.fmu"), tmp_path / "fmu")
    with Slave(fmu) as slave:
        assert [slave.get(f"l{k}.stiffness") for k in range(len(masses))] == [float(text) for text in masses]


def test_signal_handlers_and_locale_stay(run):
    out = run("""
import locale
before = {s: signal.getsignal(s) for s in signal.valid_signals()}, locale.setlocale(locale.LC_ALL)
with Slave(fmu) as slave:
    slave.initialize().run(0.1, 0.01)
print({s: signal.getsignal(s) for s in signal.valid_signals()} == before[0], locale.setlocale(locale.LC_ALL) == before[1])
""")
    assert out == "True True\n"


def test_messages_and_numbers_ignore_decimal_commas(run, decimal_commas):
    program = """
import locale
if len(sys.argv) > 3 or {comma}:
    locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
    assert locale.localeconv()["decimal_point"] == ","
with Slave(fmu, logging=True) as slave:
    slave.initialize().run(0.25, 0.125)
    print(slave.reals(slave.fmu.named("output", ".q")))
    assert slave.set("hinge.tau", 1e308) == OK and slave.set("rail.tau", 1e308) == OK
    assert slave.step(0.25, 0.01) == ERROR and slave.step(0.125, 0.25) == ERROR
    print(slave.messages)
"""
    plain, comma = (run(program.replace("{comma}", str(comma)), LOCPATH=str(decimal_commas)) for comma in (False, True))
    assert plain == comma and "0.25 s" in plain
