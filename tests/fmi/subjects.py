"""What the abuse tests mistreat: FMUs of all kinds of scenes, each mistreatment in a process of its own."""

from __future__ import annotations

import ctypes as c
import os
import signal
import tempfile
import traceback

import pytest

from tests.fmi.raw import ERROR, OK, Slave, Unpacked

# a robot, a closed loop, a guided stiff one; with -m slow also a tree, a stiff one, a controlled one, an inverse one
SUBJECTS = (
    "kuka_kr5",
    "four_bar",
    "stick_slip",
    *(pytest.param(name, marks=pytest.mark.slow) for name in ("gripper", "stiff_strut", "kuka_kr5_computed_torque", "kuka_kr5_inverse")),
)
STATES = ("instantiated", "initialization", "step", "failed", "terminated")
SIZE, HANG = 1e-3, 90

One = c.c_size_t(1)
Double, Int, Text, References = c.c_double * 1, c.c_int * 1, c.c_char_p * 1, c.c_uint * 1


class Subject:
    """An unpacked FMU and one name of each kind that it has; a check that asks for a kind it lacks is passed over."""

    def __init__(self, fmu: Unpacked) -> None:
        self.fmu = fmu
        of = {}
        for scalar in fmu.xml.iter("ScalarVariable"):
            of.setdefault((scalar[0].tag, scalar.get("causality"), scalar.get("variability")), []).append(scalar.get("name"))
        self.outputs = of[("Real", "output", "continuous")]
        self.inputs = of.get(("Real", "input", "continuous"), [])
        self.tunables = of.get(("Real", "parameter", "tunable"), [])
        self.fixed = of[("Real", "parameter", "fixed")]
        self.integers = of.get(("Integer", "output", "discrete"), [])
        with Slave(fmu) as slave:
            self.alone = self.first_run(slave)

    def __getattr__(self, kind: str) -> str:
        names = {"input": "inputs", "tunable": "tunables", "integer": "integers"}
        if kind == "output":
            return next(name for name in self.outputs if name.endswith((".q", ".tau")))
        if kind not in names:
            raise AttributeError(kind)
        found = getattr(self, names[kind])
        return found[0] if found else pytest.skip(f"no {kind}")

    def reference(self, name: str) -> int:
        return self.fmu.variables[name][1]

    def references(self, name: str):
        return References(self.reference(name))

    def first_run(self, slave: Slave) -> list[float]:
        slave.initialize()
        slave.run(3 * SIZE, SIZE)
        return slave.reals(self.outputs)

    def bring_to(self, slave: Slave, state: str) -> Slave:
        """Leads a fresh instance to a state; `failed` by forces beyond measure."""
        if state == "instantiated":
            return slave
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        if state == "initialization":
            return slave
        assert slave.call("ExitInitializationMode") == OK, slave.errors
        if state == "failed":
            forces = [name for name in self.inputs if name.endswith(".tau")]
            if not forces:
                pytest.skip("its steps cannot be made to fail")
            for force in forces:
                assert slave.set(force, 1e308) == OK
            assert slave.step(0, SIZE) == ERROR
        if state == "terminated":
            assert slave.call("Terminate") == OK
        return slave


def isolated(work) -> None:
    """Runs `work` in a forked process: fails if it raises, crashes, hangs or prints, skips if it skips."""
    with tempfile.TemporaryFile() as told, tempfile.TemporaryFile() as printed:
        child = os.fork()
        if child == 0:
            code = 1
            try:
                signal.alarm(HANG)
                os.dup2(printed.fileno(), 1)
                os.dup2(printed.fileno(), 2)
                work()
                code = 0
            except pytest.skip.Exception as skipped:
                code = 2
                os.write(told.fileno(), str(skipped).encode())
            except BaseException:
                os.write(told.fileno(), traceback.format_exc().encode())
            finally:
                os._exit(code)
        _, status = os.waitpid(child, 0)
        told.seek(0), printed.seek(0)
        text, noise = told.read().decode(), printed.read().decode(errors="replace")
        if os.WIFSIGNALED(status):
            number = os.WTERMSIG(status)
            pytest.fail(f"still at work after {HANG} s" if number == signal.SIGALRM else f"killed by signal {number}: {noise}")
        if os.WEXITSTATUS(status) == 2:
            pytest.skip(text)
        assert os.WEXITSTATUS(status) == 0, text
        assert noise == "", "nothing may be printed"


class Checks:
    """A table of mistreatments by name. As a decorator it enters one, once or once a case, its last argument."""

    def __init__(self) -> None:
        self._of = {}

    @property
    def names(self) -> list[str]:
        return list(self._of)

    def __call__(self, *cases):
        def enter(function):
            name = function.__name__.replace("_", " ")
            for case in cases:
                self._of[f"{name}: {case}"] = lambda subject, slave, case=case: function(subject, slave, case)
            if not cases:
                self._of[name] = function
            return function

        return enter

    def run(self, name: str, subject: Subject) -> None:
        """Afterwards a reset brings back the first run bit for bit."""

        def work():
            with Slave(subject.fmu) as slave:
                self._of[name](subject, slave)
                assert slave.call("Reset") == OK
                assert subject.first_run(slave) == subject.alone

        isolated(work)


def refused(slave: Slave, status: int) -> None:
    assert status == ERROR and slave.errors and all(slave.errors), "an error says why"
