"""The inverse of a model: the same file with `inverse = true` in the first line."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from build_fmu.errors import UserError
from build_fmu.model.describe import Description, describe
from build_fmu.model.resources import attach

BYTE_ORDER_MARK = b"\xef\xbb\xbf"


@contextmanager
def inverse_of(model: Path) -> Iterator[tuple[Description, Path]]:
    """Yields the description of a model's inverse and its model file; raises UserError as `describe` does."""
    resources, failure = [], None
    try:
        resources = describe(model).resources
    except UserError as error:
        failure = error  # the inverse may be valid nevertheless, such as that of a model without masses
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / model.name
        copy.write_bytes(b"inverse = true\n" + model.read_bytes().removeprefix(BYTE_ORDER_MARK))
        attach(resources, model, Path(folder))

        def of_the_user(text: str) -> str:
            """Replaces file and line numbers by those of the user's file."""
            return re.sub(re.escape(str(copy)) + r":(\d+)", lambda place: f"{model}:{max(int(place[1]) - 1, 1)}", text)

        try:
            description = describe(copy)
        except UserError as error:
            raise failure or UserError(of_the_user(str(error))) from None
        yield replace(description, folder=model.parent, warnings=[of_the_user(line) for line in description.warnings]), copy
