"""Mesh files of MJCF: faces with more than three corners, MuJoCo's own format, files that cannot be read."""

from __future__ import annotations

import numpy as np
import pytest

from build_fmu.draw.meshes import mesh_parts
from build_fmu.errors import UserError
from build_fmu.importers import mjcf
from tests.packager.import_options import import_options

POINTS = [(0, 0, 0), (1, 0, 0.2), (1, 1, 0), (0, 1, 0.2), (0, 0, 1), (1, 0, 1.3), (1, 1, 1), (0, 1, 1.3)]
BENT = POINTS, [(4, 3, 2, 1), (5, 6, 7, 8), (1, 2, 6, 5), (2, 3, 7, 6), (3, 4, 8, 7), (4, 1, 5, 8)]
# the diagonals 1-3 of bottom and top are longer here
STRETCHED = [(x + 0.2 * y, y + 0.2 * x, z) for x, y, z in POINTS], BENT[1]


def imported(tmp_path, file: str, inertia: str = "legacy"):
    path = tmp_path / "robot.xml"
    path.write_text(
        f"""<mujoco><asset><mesh name="m" file="{file}" inertia="{inertia}"/></asset><worldbody>\n<body name="b"><joint/>
        <geom type="mesh" mesh="m"/></body></worldbody></mujoco>"""
    )
    return mjcf.read(path, import_options())


def obj(points, faces) -> str:
    corners = "".join(f"v {x} {y} {z}\n" for x, y, z in points)
    return corners + "vn 0 0 1\n" + "".join(f"f {' '.join(f'{corner}//1' for corner in face)}\n" for face in faces)


@pytest.mark.parametrize("inertia", ["legacy", "exact"])
@pytest.mark.parametrize(("shape", "mass"), [(BENT, 1133.3333005507786), (STRETCHED, 1024.0000044504786)], ids=["equal", "unequal"])
def test_quadrangles_are_split_along_the_shorter_diagonal(tmp_path, shape, mass, inertia):
    """body_mass of MuJoCo 4.0.0, which takes the diagonal 2-4 where both are equal."""
    pytest.importorskip("trimesh")
    (tmp_path / "bent.obj").write_text(obj(*shape))
    draft = imported(tmp_path, "bent.obj", inertia)
    assert draft.links[0].mass == pytest.approx(mass, rel=1e-7) and not any("mesh" in line for line in draft.doubts)


def test_faces_with_more_corners_are_listed(tmp_path):
    pytest.importorskip("trimesh")
    base = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 3), (0, 3)]
    sides = [(i + 1, (i + 1) % 6 + 1, (i + 1) % 6 + 7, i + 7) for i in range(6)]
    prism = [(x, y, z) for z in (0, 1) for x, y in base], [(6, 5, 4, 3, 2, 1), (7, 8, 9, 10, 11, 12), *sides]
    (tmp_path / "prism.obj").write_text(obj(*prism))
    (line,) = [line for line in imported(tmp_path, "prism.obj").doubts if "mesh" in line]
    assert line.startswith(f"{tmp_path / 'robot.xml'}:3: mass and inertia of the mesh may differ") and line.endswith("(2 x)")


@pytest.mark.parametrize(
    ("statements", "mass"), [(("o a", "o b"), 1000 / 6), (("g a", "g b"), 1000 / 6), (("", "usemtl b"), 4653.775140259422)]
)
@pytest.mark.parametrize("inertia", ["legacy", "exact"])
def test_the_first_object_counts(tmp_path, statements, mass, inertia):
    """body_mass of MuJoCo 4.0.0 for tetrahedra of edges 1 and 2."""
    pytest.importorskip("trimesh")
    parts = [obj([(x, 0, 0), (x + size, 0, 0), (x, size, 0), (x, 0, size)], []) for x, size in ((0, 1), (5, 2))]
    faces = [obj([], np.array([(1, 3, 2), (1, 2, 4), (1, 4, 3), (2, 3, 4)]) + first) for first in (0, 4)]
    text = "".join(f"{statement}\n{part}{own}" for statement, part, own in zip(statements, parts, faces, strict=True))
    (tmp_path / "two.obj").write_text(text)
    draft = imported(tmp_path, "two.obj", inertia)
    both = statements[0] == ""
    assert draft.links[0].mass == pytest.approx(1500 if both and inertia == "exact" else mass, rel=1e-9)
    assert any("objects after the first one" in line for line in draft.lost) != both


def msh(normals: int = 0) -> bytes:
    """Returns a tetrahedron of edges 1, 2, 3 in MuJoCo's format."""
    numbers = np.array([4, normals, normals, 4], "<i4").tobytes() + np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (0, 0, 3)], "<f4").tobytes()
    return numbers + bytes(4 * 5 * normals) + np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], "<i4").tobytes()


@pytest.mark.parametrize("normals", [0, 4])
def test_the_format_of_mujoco_is_read(tmp_path, normals):
    (tmp_path / "tetrahedron.msh").write_bytes(msh(normals))
    draft = imported(tmp_path, "tetrahedron.msh")
    assert draft.links[0].mass == pytest.approx(1000.0, rel=1e-12)
    ((points, triangles, _),) = mesh_parts(draft.shapes[0].fields["file"])
    assert points.shape == (4, 3) and triangles.shape == (4, 3)


@pytest.mark.parametrize("data", [msh()[:-4], msh()[:-4] + b"\4\0\0\0", b"", bytes(16)], ids=["short", "corner", "empty", "none"])
def test_a_mesh_that_cannot_be_read_has_a_place(tmp_path, data):
    pytest.importorskip("trimesh")
    (tmp_path / "broken.msh").write_bytes(data)
    with pytest.raises(UserError, match=r"robot\.xml:3: mesh file '.*broken\.msh' cannot be read"):
        imported(tmp_path, "broken.msh")
