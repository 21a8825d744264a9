"""The picture: byte-stable, planar where the mechanism is, and drawn for awkward mechanisms too."""

import numpy as np
import pytest

from build_fmu.draw.drawing import _Scene, draw
from build_fmu.draw.groups import group_of, label_of
from build_fmu.model.planar import joint_counts, planar_axes

UP = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
ALONG_Y = [[1, 0, 0], [0, 0, -1], [0, 1, 0]]


def link(name, parent=-1, kind="revolute", origin=(0, 0, 0), rotation=UP, com=(0, 0, 0), mass=1.0):
    turn, slide = {"revolute": (1, 0), "prismatic": (0, 1)}.get(kind, (0, 0))
    return {
        "name": name,
        "parent": parent,
        "type": kind,
        "turn": turn,
        "slide": slide,
        "origin": list(origin),
        "rotation": rotation,
        "com": list(com),
        "mass": mass,
    }


def test_equal_drawings_are_equal_bytes(crane):
    import matplotlib

    first = draw(crane.drawing, "crane")
    with matplotlib.rc_context({"axes.facecolor": "red", "font.size": 30}):
        assert draw(crane.drawing, "crane") == first


def test_planes():
    assert planar_axes([link("a"), link("b", 0)]) == (0, 1)
    assert planar_axes([link("a", rotation=ALONG_Y)]) == (0, 2)
    assert planar_axes([link("a"), link("b", 0, rotation=ALONG_Y)]) is None
    # a slider moves in the plane only across the hinges' axis
    assert planar_axes([link("a"), link("b", 0, "prismatic", rotation=ALONG_Y)]) == (0, 1)
    assert planar_axes([link("a"), link("b", 0, "prismatic")]) is None
    assert planar_axes([link("a"), link("b", 0, "spherical")]) is None


@pytest.mark.parametrize(
    "links",
    [
        [link("point")],
        [link("massless", mass=0.0)],
        [link("base", kind="fixed")],
        [link(f"l{i}", i - 1, origin=(i, np.sin(i), 0), com=(i + 0.5, 0, 0)) for i in range(60)],
        [link("a", com=(1e-6, 0, 0)), link("$x_$", 0, origin=(1e-6, 0, 0), rotation=ALONG_Y)],
    ],
    ids=["point", "massless", "only fixed", "long chain", "tiny, odd name"],
)
def test_awkward_mechanisms(links):
    assert draw({"links": links}, "a $ strange_ name").startswith(b"\x89PNG")


def test_loops_springs_and_bushings_show():
    links = [link("a", com=(1, 0, 0)), link("b", 0, origin=(1, 1, 0), com=(2, 1, 0))]
    bare = draw({"links": links}, "x")
    loop = {"name": "l", "link_a": "ground", "link_b": "b", "point_a": [1, 0, 0], "point_b": [1, 0, 0]}
    assert draw({"links": links, "loops": [loop]}, "x") != bare
    assert draw({"links": links, "springs": [{**loop, "point_b": [2, 2, 0]}]}, "x") != bare
    assert draw({"links": links, "bushings": [loop]}, "x") != bare
    # a spring of no length has no direction, and must not matter
    assert draw({"links": links, "springs": [loop]}, "x").startswith(b"\x89PNG")


def test_couplings_show_and_are_counted():
    links = [link("a", com=(1, 0, 0)), link("b", 0, origin=(1, 1, 0), com=(2, 1, 0)), link("c", 0, "prismatic", origin=(0, 1, 0))]
    drawing = {"links": links, "couplings": [{"name": "gear", "links": [1, 2]}]}
    assert draw(drawing, "x") != draw({"links": links}, "x")
    assert joint_counts(drawing) == ["2 revolute", "1 prismatic", "1 coupling"]
    assert joint_counts({**drawing, "loops": [{}, {}]})[2:] == ["2 loops", "1 coupling"]


def test_names_stay_left_of_the_numbers():
    """A name whose point lies near the right edge ends there."""
    from matplotlib.figure import Figure

    for plane in ((0, 1), None):
        scene = _Scene(Figure(), plane, 1.0, 2)
        for x in (0.0, 0.5, 2.0):
            scene.points.append(np.array([x, 0, 0]))
            scene.text([x, 0.0, 0.0], f"at {x}")
        scene.finish("names", "", None)
        assert [shown.get_ha() for _, shown in scene.names] == ["left", "left", "right"]
        assert [shown.get_text().strip() for _, shown in scene.names] == ["at 0.0", "at 0.5", "at 2.0"]


@pytest.mark.parametrize(
    ("name", "group", "label"),
    [
        ("hand.angle[2]", "angle", "hand[2]"),
        ("energy.kinetic", "energy", "kinetic"),
        ("energy.balance", "balance", "balance"),
        ("tip.position[1]", "position", "tip[1]"),
        ("solver.steps", "steps", "solver.steps"),
        ("speed", "speed", "speed"),
    ],
)
def test_variables_are_grouped_by_their_last_part(name, group, label):
    assert group_of(name) == group
    assert label_of(name, group) == label
