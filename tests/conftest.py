"""Pictures of FMUs are drawn in tests of the packager and of random scenes only: drawing one takes as long as the rest of a build."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from build_fmu.fmu import build

DRAWN = ("tests/packager/", "tests/crosscheck/")


@pytest.fixture(scope="session", autouse=True)
def _pictures_where_they_matter() -> Iterator[None]:
    """All other tests get an empty picture."""
    draw, empty = build.draw, build.draw({"links": []}, "empty")

    def drawn(*arguments) -> bytes:
        return draw(*arguments) if os.environ.get("PYTEST_CURRENT_TEST", "").startswith(DRAWN) else empty

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(build, "draw", drawn)
        yield
