"""The version is written in build_fmu/__init__.py; every other place agrees with it."""

import json
import re
import subprocess
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

from build_fmu import __version__, native
from build_fmu.errors import UserError

ROOT = Path(__file__).parents[2]


def test_pages_name_the_version():
    assert re.findall(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.M) == [__version__]
    newest = re.search(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.M)[1]
    assert __version__ in newest


def test_build_files_read_the_version():
    assert "version" not in tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert metadata.version("build-fmu") == __version__
    assert not re.search(r"project\(.* VERSION \d", (ROOT / "CMakeLists.txt").read_text())


def test_describe_has_the_version():
    try:
        program = native.describe_program()
    except UserError as error:
        pytest.skip(str(error))
    text = subprocess.run([program, ROOT / "models" / "pendulum.toml"], capture_output=True, text=True, check=True).stdout
    assert json.loads(text)["generation_tool"] == f"ReDySim-FMU {__version__}"
