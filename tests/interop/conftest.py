"""FMUs for foreign masters, the masters' own environment, and what our own loop says they should find."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from tests.fmi.conftest import fmu, fmu_file  # noqa: F401 the same FMUs as in tests/fmi
from tests.fmi.raw import Slave

ROOT = Path(__file__).resolve().parents[2]
CLIENTS = Path(__file__).parent / "clients"
PLACE = ROOT / "build" / "interop"  # made by scripts/interop.sh


def pytest_collection_modifyitems(items):
    for item in items:
        if Path(item.path).parent == Path(__file__).parent:
            item.add_marker(pytest.mark.interop)


@pytest.fixture
def place() -> Path:
    if not (PLACE / "bin" / "python").exists():
        pytest.skip("the clients are not installed: run `make interop`")
    return PLACE


@pytest.fixture
def ask(place, tmp_path):
    """Runs a client of tests/interop/clients; returns its version and rows."""

    def run(client: str, fmus: dict[str, Path], outputs: list, step: float, steps: int, connections=(), **more) -> tuple[str, list]:
        answer, job = tmp_path / "answer.json", tmp_path / "job.json"
        job.write_text(
            json.dumps(
                {
                    "fmus": {name: str(file) for name, file in fmus.items()},
                    "connections": list(connections),
                    "outputs": outputs,
                    "step": step,
                    "steps": steps,
                    "answer": str(answer),
                    **more,
                }
            )
        )
        # Ecos needs oneTBB, which its package does not bring
        environment = {**os.environ, "LD_LIBRARY_PATH": str(place / "lib")}
        done = subprocess.run(
            [place / "bin" / "python", CLIENTS / f"{client}.py", job],
            capture_output=True,
            text=True,
            env=environment,
            timeout=120,
            cwd=tmp_path,
        )
        assert done.returncode == 0 and answer.exists(), done.stdout[-2000:] + done.stderr[-2000:]
        content = json.loads(answer.read_text())
        return content["version"], content["rows"]

    return run


@pytest.fixture
def java(place):
    """Runs a Java program with the jars of one folder; skips where that was not to be had."""

    def run(folder: str, *arguments, options=(), cwd=None, good=0) -> str:
        if not (place / folder).is_dir():
            pytest.skip(f"no jars in build/interop/{folder}: Java, Maven or the network is missing")
        done = subprocess.run(["java", *options, *map(str, arguments)], capture_output=True, text=True, timeout=300, cwd=cwd)
        assert good is None or done.returncode == good, done.stdout[-2000:] + done.stderr[-2000:]
        return done.stdout

    return run


@pytest.fixture
def expected(fmu):  # noqa: F811
    """Our own loop over an FMU: rows of outputs, with inputs by `law` from the outputs of the step before, as parallel masters do."""

    def run(model: str, outputs: list[str], step: float, steps: int, law=None, **start) -> list[list[float]]:
        with Slave(fmu(model)) as slave:
            slave.initialize(start=start)
            rows, inputs = [slave.reals(outputs)], {}
            for k in range(steps):
                following = law(slave.get) if law else {}
                for name, value in inputs.items():
                    slave.set(name, value)
                assert slave.step(k * step, step) == 0, slave.errors
                rows.append(slave.reals(outputs))
                inputs = following
            return rows

    return run
