"""A stand-in for the compiled side: a `describe` that prints a recorded table, and a file that poses as the library."""

import json
import shlex
import sys
from pathlib import Path

import pytest

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.model.describe import from_table

DATA = Path(__file__).parent / "data"

# prints the table beside the model file; a line `# error: ...` or `# warning: ...` in the model speaks instead
FAKE_DESCRIBE = """
import pathlib, sys
model = pathlib.Path(sys.argv[1])
lines = model.read_text(encoding="utf-8").splitlines()
errors = [line[9:] for line in lines if line.startswith("# error: ")]
warnings = [line[11:] for line in lines if line.startswith("# warning: ")]
for line in errors + warnings:
    print(f"{model}:1:1: {line}", file=sys.stderr)
if errors:
    sys.exit(1)
sys.stdout.write(pathlib.Path(r"@TABLE@").read_text(encoding="utf-8"))
"""


@pytest.fixture(scope="session")
def built_library():
    """Skips a test if the compiled programs are not built."""
    try:
        native.describe_program()
        native.library()
    except UserError as error:
        pytest.skip(str(error))


@pytest.fixture
def table():
    """The recorded table of the crane."""
    return json.loads((DATA / "crane.json").read_text(encoding="utf-8"))


@pytest.fixture
def crane(table):
    """The crane's description without any process in between."""
    return from_table(table, [])


@pytest.fixture
def compiled(tmp_path, monkeypatch):
    """Points build_fmu at the stand-ins; returns the folder that holds them."""
    folder = tmp_path / "stand in"
    folder.mkdir()
    script = folder / "describe.py"
    script.write_text(FAKE_DESCRIBE.replace("@TABLE@", str(DATA / "crane.json")), encoding="utf-8")
    program = folder / "describe"
    program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {shlex.quote(str(script))} "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    (folder / "libredysim_fmu.so").write_bytes(b"not a library")
    monkeypatch.setenv("REDYSIM_FMU_DESCRIBE", str(program))
    monkeypatch.setenv("REDYSIM_FMU_LIBRARY", str(folder / "libredysim_fmu.so"))
    return folder


@pytest.fixture
def model(tmp_path):
    """A model file in a folder whose name is awkward."""
    folder = tmp_path / "models ü %20"
    folder.mkdir()
    target = folder / "crane.toml"
    target.write_bytes((DATA / "crane.toml").read_bytes())
    return target
