"""The picture: byte-stable, planar where the mechanism is, and drawn for awkward mechanisms too."""

import numpy as np
import pytest

from build_fmu.draw.drawing import PLAIN_TEXT, _Scene, draw
from build_fmu.draw.figure import new_figure
from build_fmu.draw.groups import group_of, joint_parts, label_of, noise_of
from build_fmu.draw.skeleton import Skeleton
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
    for plane in ((0, 1), None):
        with new_figure(6.4, 4.8) as figure:
            scene = _Scene(figure, plane, 1.0, 2)
            for x in (0.0, 0.5, 2.0):
                scene.points.append(np.array([x, 0, 0]))
                scene.text([x, 0.0, 0.0], f"at {x}")
            scene.finish("names", "", None)
        assert [shown.get_ha() for _, shown in scene.names] == ["left", "left", "right"]
        assert [shown.get_text().strip() for _, shown in scene.names] == ["at 0.0", "at 0.5", "at 2.0"]


@pytest.mark.parametrize(
    ("name", "group", "label"),
    [
        ("hand.angle[2]", "angle", "hand.x"),
        ("gap.lambda[2]", "lambda", "gap[2]"),
        ("energy.kinetic", "energy", "kinetic"),
        ("energy.balance", "balance", "balance"),
        ("tip.position[1]", "position", "tip.x"),
        ("solver.steps", "steps", "solver.steps"),
        ("speed", "speed", "speed"),
    ],
)
def test_variables_are_grouped_by_their_last_part(name, group, label):
    assert group_of(name) == group
    assert label_of(name, group) == label


def test_parts_of_free_and_planar_joints_have_the_names_of_their_axes():
    names = [
        "trunk[1].q",
        "trunk[2].q",
        "trunk[3].q",
        "trunk.quaternion[1]",
        "cart[1].q",
        "cart[2].q",
        "cart[3].q",
        "hinge[1].q",
        "hinge[2].q",
    ]
    parts = joint_parts(names)
    assert [parts[f"trunk[{k}]"] for k in (1, 2, 3)] == ["trunk.x", "trunk.y", "trunk.z"]
    assert [parts[f"cart[{k}]"] for k in (1, 2, 3)] == ["cart.x", "cart.y", "cart.angle"] and "hinge[1]" not in parts
    assert label_of("trunk[3].qd", "qd", parts) == "trunk.z"


def test_rounding_errors_are_noise_and_results_are_not():
    # the angles of a free base at rest vary by 1e-12 rad
    assert noise_of("angle", 0.0, 0.0) > 1e-9 and noise_of("omega", 0.0, 0.0) > 1e-9 and noise_of("gap", 0.0, 0.0) < 1e-9
    # the error of an energy balance is measured by the energies
    assert 1e-14 < noise_of("balance", 1e-9, 5.0) < 1e-11 and noise_of("balance", 1e-9, 0.0) == 0


def test_a_free_base_is_free():
    """No rods, rails or blocks between the ground and the base, and one joint in the caption."""
    chain = [link(f"trunk[{k}]", k - 2, "prismatic", origin=(0, 0, 2 if k == 3 else 0), mass=0.0) for k in (1, 2, 3)]
    trunk = link("trunk", 2, "spherical", origin=(0, 0, 2), com=(0, 0, 2))
    arm = link("arm", 3, origin=(1, 0, 2), com=(1.5, 0, 2))
    drawing = {"links": [*chain, trunk, arm]}
    corners = np.concatenate([triangles.reshape(-1, 3) for triangles, _ in Skeleton(drawing, set(), 2.0).parts])
    assert corners[:, 2].min() > 1.7 and joint_counts(drawing) == ["1 revolute", "1 free"]
    # a slide of its own is drawn down to the ground
    slide = Skeleton({"links": [link("slide", kind="prismatic", origin=(0, 0, 2)), arm | {"parent": 0}]}, set(), 2.0)
    assert min(triangles[..., 2].min() for triangles, _ in slide.parts) < 0.1


def test_links_and_joints_are_round_bodies():
    """Rods between joints, and a cylinder along the axis of a joint."""
    drawing = {"links": [link("a", rotation=ALONG_Y, com=(0, 0, 0)), link("b", 0, rotation=ALONG_Y, origin=(1, 0, 0), com=(1, 0, 0))]}
    skeleton = Skeleton(drawing, set(), 1.0)
    rod = np.concatenate([t.reshape(-1, 3) for t, owner in skeleton.parts if owner == 0])
    assert rod[:, 0].max() == pytest.approx(1) and np.abs(rod[:, 2]).max() == pytest.approx(1.28 * skeleton.thick)
    joint = np.concatenate([t.reshape(-1, 3) for t, owner in skeleton.parts if owner == 1])
    assert np.ptp(joint[:, 1]) == pytest.approx(3.4 * skeleton.thick) and np.ptp(joint[:, 0]) == pytest.approx(2.56 * skeleton.thick)


@pytest.mark.parametrize("plane", [(0, 1), None])
def test_axis_labels_are_plain_numbers(plane):
    with new_figure(6.4, 5.6, 110, PLAIN_TEXT) as figure:
        scene = _Scene(figure, plane, 1.0, 2)
        scene.points += [np.array([-0.1, -0.2, -0.2]), np.array([1.0, 0.4, 0.2])]
        scene.finish("numbers", "", None)
        figure.canvas.draw()
        labels = [label.get_text() for label in scene.axes.get_xticklabels()]
        assert len(labels) > 2 and np.isfinite([float(label.replace("\N{MINUS SIGN}", "-")) for label in labels]).all()


def test_axis_labels_are_inside_the_picture():
    """Also those of a tall mechanism, whose lowest label would be below the lower edge."""
    with new_figure(6.4, 5.6, 110) as figure:
        scene = _Scene(figure, None, 1.0, 0)
        scene.points += [np.array([-0.1, -0.2, -0.2]), np.array([1.0, 0.4, 0.2])]
        scene.finish("tall", "", None)
        boxes = [axis.get_tightbbox(figure.canvas.get_renderer()) for axis in (scene.axes.xaxis, scene.axes.yaxis, scene.axes.zaxis)]
        assert min(box.y0 for box in boxes) >= 0 and max(box.x1 for box in boxes) <= figure.bbox.width and min(box.x0 for box in boxes) >= 0
