"""Boxes on boxes whose corners have a radius: flush with each other's edges, sliding over an edge."""

from __future__ import annotations

import pytest

from tests.fmi.test_contact import G, body, refused


def boxes(width: float = 0.2, radius: float = 0.005) -> str:
    return (
        f'shape_a = "box"\nsize_a = [{width}, 0.2, 0.1]\nradius_a = {radius}\n'
        f'shape_b = "box"\nsize_b = [0.2, 0.2, 0.1]\nradius_b = {radius}'
    )


@pytest.mark.parametrize("method", ["erk", "dirk", "auto"])
@pytest.mark.parametrize("stiffness", [1e4, 1e5])
@pytest.mark.parametrize("z", [0.1, 0.15])  # resting on it, 5 cm above
@pytest.mark.parametrize(("x", "width", "points"), [(0, 0.2, 8), (0.001, 0.2, 8), (0.02, 0.2, 4), (0, 0.15, 4), (0.01, 0.25, 4)])
def test_a_box_rests_on_a_box_flush_with_its_edges(built, instance, x, width, points, z, stiffness, method):
    """The depth of the impact stays below twice the radius."""
    law = f"stiffness = {stiffness}\ndamping = 2\nfriction = 0.6"
    text = body(shape=boxes(width), law=law, q=[x, 0, z, 1, 0, 0, 0], method=method, rtol=1e-6, atol=1e-8)
    one = instance(built(text)).initialize()
    one.run(0.8, 0.02)
    assert one.get("body[3].q") == pytest.approx(0.1 - 2 * G / (points * stiffness) - 0.5e-4, abs=2e-5)
    assert one.get("body[1].q") == pytest.approx(x, abs=2e-3)
    assert abs(one.get("energy.balance")) < 1e-5
    assert not any("meets an edge" in text for _, _, text in one.messages)


@pytest.mark.parametrize("method", ["bdf", "auto"])
@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0])
def test_a_box_that_slides_over_the_edge_of_a_box_tips_and_gains_no_energy(built, instance, speed, method):
    law = "stiffness = 1e5\ndamping = 2\nfriction = 0.1"
    text = body(shape=boxes(), law=law, q=[0, 0, 0.0997, 1, 0, 0, 0], qd=[speed, 0, 0, 0, 0, 0], method=method)
    one = instance(built(text)).initialize()
    before = one.get("energy.total")
    for k in range(60):
        one.run(0.01 * (k + 1), 0.01, 0.01 * k)
        beyond = one.get("body[1].q") > 0.095  # its center passed the edge
        assert beyond or one.get("body[3].q") > 0.0985
        assert one.get("energy.total") < before + 1e-6
    assert one.get("body[3].q") < -0.1 or speed < 1
    assert abs(one.get("energy.balance")) < 1e-5


@pytest.mark.parametrize("radius", [0.05, 0.2, -0.01])
def test_an_impossible_radius_of_a_box_is_refused(tmp_path, radius):
    sentence = "radius_a must be >= 0, got -0.01" if radius < 0 else "size_a must be three lengths > 0 and > 2 radius_a"
    assert sentence in refused(tmp_path, body(shape=boxes(radius=radius)))
