"""Models opened by the Python library, closed after the tests of a file."""

from __future__ import annotations

from pathlib import Path

import pytest

import build_fmu as rds
from build_fmu import native
from build_fmu.errors import UserError

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """Returns a function: text of a model file, or a name in models/ -> the model."""
    try:
        native.library()
    except UserError as error:
        pytest.skip(str(error))
    opened = []

    def load(text: str, **options) -> rds.Model:
        file = ROOT / "models" / f"{text}.toml"
        if "\n" in text:
            file = tmp_path_factory.mktemp("model") / "model.toml"
            file.write_text(text)
        opened.append(rds.load(file, **options))
        return opened[-1]

    yield load
    for one in opened:
        one.close()
