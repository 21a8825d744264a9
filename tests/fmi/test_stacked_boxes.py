"""Boxes on boxes: the face through which they press each other, and its edges."""

from __future__ import annotations

import pytest

from tests.fmi.test_contact import G, body


@pytest.mark.parametrize("method", ["erk", "dirk", "auto"])
@pytest.mark.parametrize("stiffness", [1e4, 1e5])
@pytest.mark.parametrize("z", [0.1, 0.15])  # resting on it, 5 cm above
@pytest.mark.parametrize(("x", "width", "points"), [(0, 0.2, 8), (0.001, 0.2, 4), (0.01, 0.2, 4), (0, 0.15, 4), (0.01, 0.25, 4)])
def test_a_box_rests_on_a_box_flush_with_its_edges(built, instance, x, width, points, z, stiffness, method):
    """Corners on an edge are pushed through the face below the body, although the faces beside them are nearer."""
    shape = f'shape_a = "box"\nsize_a = [{width}, 0.2, 0.1]\nshape_b = "box"\nsize_b = [0.2, 0.2, 0.1]'
    law = f"stiffness = {stiffness}\ndamping = 2\nfriction = 0.6"
    one = instance(built(body(shape=shape, law=law, q=[x, 0, z, 1, 0, 0, 0], method=method, rtol=1e-6, atol=1e-8))).initialize()
    one.run(0.8, 0.02)
    assert one.get("body[3].q") == pytest.approx(0.1 - 2 * G / (points * stiffness) - 0.5e-4, abs=2e-5)
    assert one.get("body[1].q") == pytest.approx(x, abs=2e-3)
    assert abs(one.get("energy.balance")) < 1e-5


@pytest.mark.parametrize(("method", "error"), [("bdf", 1e-5), ("auto", 1e-3)])
def test_a_box_slides_over_the_edge_of_a_box_and_falls(built, instance, method, error):
    """Four corners lose their support within a ledge of 0.1 % of half the thickness: 18 mJ."""
    shape = 'shape_a = "box"\nsize_a = [0.2, 0.2, 0.1]\nshape_b = "box"\nsize_b = [0.2, 0.2, 0.1]'
    law = "stiffness = 1e5\ndamping = 2\nfriction = 0.1"
    one = instance(built(body(shape=shape, law=law, q=[0, 0, 0.0997, 1, 0, 0, 0], qd=[1, 0, 0, 0, 0, 0], method=method))).initialize()
    for k in range(60):
        one.run(0.01 * (k + 1), 0.01, 0.01 * k)
        beyond = one.get("body[1].q") > 0.1  # its center passed the edge
        assert beyond or one.get("body[3].q") > 0.0985
    assert one.get("body[3].q") < -0.1
    assert abs(one.get("energy.balance")) < error
