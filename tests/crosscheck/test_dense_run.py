"""Figures of tests/fmi/redysim_dense_cases.py, computed again by the dense formulation."""

from __future__ import annotations

import pytest

from tests.crosscheck.dense_run import values
from tests.fmi.redysim_dense_cases import DENSE_CASES

FAST = [case for case in DENSE_CASES if case.inverse]
SLOW = [case for case in DENSE_CASES if not case.inverse]


def holds(case) -> None:
    found = values(case)
    for known in case.known:
        assert [found[known.time][name] for name in known.names] == pytest.approx(known.values, rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("case", FAST, ids=lambda case: case.example + case.run)
def test_torques(case):
    holds(case)


@pytest.mark.slow
@pytest.mark.parametrize("case", SLOW, ids=lambda case: case.example)
def test_motions(case):
    holds(case)
