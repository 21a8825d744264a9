"""DH tables in CSV: columns, units, joint variables as books print them, and standard DH converted exactly."""

import math
import re
from zipfile import ZipFile

import numpy as np
import pytest
from openpyxl import Workbook

from build_fmu.errors import UserError
from build_fmu.importers import dh_table
from build_fmu.importers.draft import DhFrame
from build_fmu.importers.rigid import matrix_of, pose_of, rotation_x, rotation_z, transform
from build_fmu.importers.toml_writer import model_text
from tests.packager.import_options import import_options


def imported(tmp_path, text, dh="modified", angles=None, name="arm.csv", stops=None):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return dh_table.read(path, import_options(dh=dh, angles=angles, stops=stops))


def test_a_table_as_books_print_it(tmp_path):
    draft = imported(
        tmp_path,
        """i,α_{i-1} [deg],a_{i-1} [mm],θ_i,d_i [mm],mass
        1,0,0,θ1,400,1
        2,90,180,θ_2 - 90,0,1
        3,-90,0,0,d3,1
        4,45,0,q4*,0,0.5
        """,
    )
    assert [link.joint for link in draft.links] == ["revolute", "revolute", "prismatic", "revolute"]
    assert draft.links[0].dh == DhFrame(d=0.4)
    assert draft.links[1].dh == DhFrame(alpha=math.pi / 2, a=0.18, theta=-math.pi / 2)
    assert draft.links[3].dh.alpha == math.pi / 4
    assert [link.name for link in draft.links] == ["link1", "link2", "link3", "link4"]


def test_names_branches_and_the_rest(tmp_path):
    draft = imported(
        tmp_path,
        """name;parent;type;alpha (rad);a;gamma;b;com_x;Ixx;Ixy;damping;stiffness;rest;q;armature;mass
        # a comment
        base;;revolute;0;0;0;0;0,1;1;0,01;0,5;2;0,25;pi/3;0,001;1
        left;base;p;pi/2;0,2;pi/4;0,1;0;1;0;0;0;0;0,3;0;1

        right;1;fixed;-pi/2;0,2;0;0;0;1;0;0;0;0;0;0;1
        """,
    )
    base, left, right = draft.links
    assert (base.q, base.damping, base.rest, base.armature, base.com[0], base.inertia[3]) == (math.pi / 3, 0.5, 0.25, 0.001, 0.1, 0.01)
    assert (left.parent, left.joint, left.dh.gamma, left.dh.b, left.q) == ("base", "prismatic", math.pi / 4, 0.1, 0.3)
    assert (right.parent, right.joint) == ("base", "fixed")


def test_rotor_inertia_and_gear_ratio_make_the_armature(tmp_path):
    """The first two joints of a Puma 560: the sign of a gear ratio does not matter."""
    draft = imported(tmp_path, "alpha,a,theta,d,mass,Jm [kg m2],G\n0,0,q1,0,1,200e-6,-62.6111\n1,0,q2,0,1,200e-6,107.815\n0,0,q3,0,1,,\n")
    assert [link.armature for link in draft.links] == pytest.approx([200e-6 * 62.6111**2, 200e-6 * 107.815**2, 0], rel=1e-15)
    draft = imported(tmp_path, "a,mass,rotor_inertia [kg mm2],gear_ratio\n1,1,50,100\n")
    assert draft.links[0].armature == pytest.approx(0.5, rel=1e-15)


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        ("a,mass,Jm\n1,1,2e-4\n", "arm.csv:2: column 'Jm': the gear ratio is missing; write it in the column 'G' (1 for a direct drive)"),
        ("a,mass,Jm,G\n1,1,2e-4,0\n", "column 'Jm': the gear ratio is missing"),
        ("a,mass,Jm,G\n1,1,-2e-4,5\n", "column 'Jm': must be >= 0, got -2e-4"),
        ("a,mass,Jm,G,armature\n1,1,2e-4,5,1\n", "columns 'armature' and 'Jm' both define the inertia of the drive"),
        ("a,mass,Jm,G [deg]\n1,1,2e-4,5\n", "the unit of G must be 1 or -"),
    ],
)
def test_what_is_wrong_with_a_drive_is_said(tmp_path, table, sentence):
    with pytest.raises(UserError, match=re.escape(sentence)):
        imported(tmp_path, table)


def test_gear_ratios_without_rotor_inertia_are_listed(tmp_path):
    assert any("gear ratios in column 'G'" in line for line in imported(tmp_path, "a,mass,G\n1,1,50\n").lost)


def test_a_column_joint_may_hold_kinds_or_names(tmp_path):
    assert [x.joint for x in imported(tmp_path, "joint,a,mass\nR,1,1\nP,1,1\n").links] == ["revolute", "prismatic"]
    assert [x.joint_name for x in imported(tmp_path, "joint,a,mass\n1,1,1\n2,1,1\n").links] == ["joint1", "joint2"]


def test_degrees_are_suspected_and_never_guessed(tmp_path):
    table = "alpha,a,mass\n90,0,1\n"
    with pytest.raises(UserError, match="arm.csv:2: column 'alpha': 90 looks like degrees"):
        imported(tmp_path, table)
    assert imported(tmp_path, table, angles="deg").links[0].dh.alpha == math.pi / 2
    assert imported(tmp_path, table, angles="rad").links[0].dh.alpha == 90
    # --angles applies to the joint values, too, except those of a slider
    draft = imported(tmp_path, "type,alpha,q,mass\nr,0,90,1\np,0,0.5,1\n", angles="deg")
    assert [link.q for link in draft.links] == [math.pi / 2, 0.5]


@pytest.mark.parametrize("unit", ["[rad,m]", "[rad/m]", "(rad|m)", "[rad or m]"])
@pytest.mark.parametrize("field", ["q", "rest"])
@pytest.mark.parametrize("angles", [None, "deg"])
def test_joint_values_in_rad_or_m_stay_in_degree_tables(tmp_path, unit, field, angles):
    draft = imported(tmp_path, f"type;alpha [deg];theta;{field} {unit};mass\nr;90;30;0.5;1\np;0;0;0.2;1\n", angles=angles)
    assert [getattr(link, field) for link in draft.links] == [0.5, 0.2] and draft.links[0].dh.theta == math.radians(30)
    assert not any("the header gives no unit" in doubt for doubt in draft.doubts)


def test_joint_values_without_a_unit_are_rad_beside_angles_in_degrees(tmp_path):
    table = "alpha [deg];theta;q;qd;rest;lower;upper;mass\n90;30;0.5;2;0;-1;1;1\n"
    draft = imported(tmp_path, table, stops=1.0)
    link = draft.links[0]
    assert (link.dh.theta, link.q, link.qd, link.lower, link.upper) == (math.radians(30), 0.5, 2, -1, 1)
    assert any("the header gives no unit of q, qd, lower, upper: read in rad or m" in doubt for doubt in draft.doubts)
    asked = [imported(tmp_path, table, stops=1.0, angles=angles) for angles in ("rad", "deg")]
    assert [draft.links[0].q for draft in asked] == [0.5, math.radians(0.5)]
    assert not any("the header gives no unit" in doubt for draft in asked for doubt in draft.doubts)
    assert any("90 was read as 90 rad" in doubt for doubt in imported(tmp_path, "alpha [deg],q,mass\n0,90,1\n").doubts)


def test_standard_dh_is_converted_exactly(tmp_path):
    rng = np.random.default_rng(3)
    rows, head = [], "type,parent,alpha,a,theta,d,mass,com_x,com_y,com_z,Ixx,Iyy,Izz,Ixy,Ixz,Iyz"
    numbers, kinds, parents = [], ["revolute", "prismatic", "revolute", "revolute", "prismatic"], ["", "1", "2", "2", "4"]
    for kind, parent in zip(kinds, parents, strict=True):
        numbers.append(rng.normal(size=14))
        numbers[-1][4] = 1.5
        rows.append(f"{kind},{parent}," + ",".join(repr(float(x)) for x in numbers[-1]))
    draft = imported(tmp_path, "\n".join([head, *rows]), dh="standard", angles="rad")
    q = rng.normal(size=5)
    distal, ours = {"": np.eye(4)}, {"ground": np.eye(4)}
    for i, link in enumerate(draft.links):
        alpha, a, theta, d = numbers[i][:4]
        theta, d = (theta + q[i], d) if kinds[i] == "revolute" else (theta, d + q[i])
        distal[str(i + 1)] = distal[parents[i]] @ transform(rotation_z(theta), (0, 0, d)) @ transform(rotation_x(alpha), (a * 1.0, 0, 0))
        ours[link.name] = ours[link.parent] @ pose_of(link.dh, link.joint, q[i])
        theirs, mine = distal[str(i + 1)], ours[link.name]
        assert np.allclose(theirs @ [*numbers[i][5:8], 1], mine @ [*link.com, 1], atol=1e-14)
        turned = [t[:3, :3] @ matrix_of(inertia) @ t[:3, :3].T for t, inertia in ((theirs, numbers[i][8:]), (mine, link.inertia))]
        assert np.allclose(*turned, atol=1e-13)
    assert "Tool frame of the table" in model_text(draft)


LIMITED = (
    "name,type,a,mass,com_x,friction,damping [N m s/rad],q_min [deg],q_max [deg],d\nl1,R,1,2,0.1,0.3,0.5,-90,180,0\nl2,P,1,2,0.1,0,0,,,0\n"
)


def test_friction_and_limits(tmp_path):
    first, second = imported(tmp_path, LIMITED, stops=1000).links
    assert (first.friction, first.damping, first.stop_stiffness) == (0.3, 0.5, 1000)
    assert first.lower == pytest.approx(-math.pi / 2) and first.upper == pytest.approx(math.pi)
    assert second.lower is None and second.upper is None
    draft = imported(tmp_path, LIMITED)
    assert draft.links[0].lower is None and any("the limits of l1: --stops" in said for said in draft.lost)
    # a column of its own needs no option; a slider counts in m or what its column says
    stiff = "type,a,mass,com_x,lower [mm],upper [mm],stop_stiffness\nP,1,1,0.1,-5,250,2e4\n"
    link = imported(tmp_path, stiff).links[0]
    assert (link.lower, link.upper, link.stop_stiffness) == (-0.005, 0.25, 2e4)
    with pytest.raises(UserError, match="the joint is revolute, but -5 is a length"):
        imported(tmp_path, stiff.replace("P,", "R,"))


def test_a_table_as_spreadsheets_write_it(tmp_path):
    expected = model_text(imported(tmp_path, "name,alpha [deg],a [m],mass,com_x\nl1,90,0.5,2.5,0.1\n", name="same.csv"))
    for text, encoding in (
        ("\ufeffname;alpha [deg];a [m];mass;com_x\r\nl1;90;0,5;2,5;0,1\r\n", "utf-8"),  # with decimal commas
        ("\ufeffname\talpha [deg]\ta [m]\tmass\tcom_x\r\nl1\t90\t0,5\t2,5\t0,1\r\n", "utf-16-le"),  # Unicode text
        ("sep=|\nname|alpha / deg|a / m|mass / kg|com_x / m\nl1|90|0.5|2.5|0.1\n", "utf-8"),
        ("name;alpha [°];a [m];mass;com_x\nl1;90;0,5;2,5;0,1;;\n", "latin-1"),
    ):
        path = tmp_path / "same.csv"
        path.write_bytes(text.encode(encoding))
        assert model_text(dh_table.read(path, import_options(dh="modified", angles=None, stops=None))) == expected


def workbook(path, angle=90):
    """Saves a workbook of two sheets with a blank row, a column without a name, a formula for an angle with this value, and a blank one."""
    book = Workbook()
    for row in (["name", "alpha [deg]", "a [mm]", "mass", "com_x", None], [], ["l1", "=45*2", 500.5, 2.5, 0.1], ["l2", -90, '=""', 1, 0.2]):
        book.active.append(row)
    book.create_sheet("notes")
    book.calculation.fullCalcOnLoad = False
    book.save(path)
    # the value that a spreadsheet program stores with a formula
    with ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    sheet = files["xl/worksheets/sheet1.xml"]
    assert 2 in map(sheet.count, (b"<v />", b"<v></v>", b"<v/>"))
    kind = b' t="e"' if isinstance(angle, str) else b""
    sheet = re.sub(rb'<c r="B3"[^>]*><f>45\*2</f><v ?/?>(</v>)?', b'<c r="B3"%b><f>45*2</f><v>%b</v>' % (kind, str(angle).encode()), sheet)
    with ZipFile(path, "w") as archive:
        for name, content in (files | {"xl/worksheets/sheet1.xml": sheet}).items():
            archive.writestr(name, content)
    return path


def test_a_workbook(tmp_path):
    options = import_options(dh="modified", angles=None, stops=None)
    draft = dh_table.read(workbook(tmp_path / "arm.xlsx"), options)
    assert [(link.name, link.dh.alpha, link.dh.a, link.mass, link.com[0]) for link in draft.links] == [
        ("l1", math.pi / 2, 0.5005, 2.5, 0.1),
        ("l2", -math.pi / 2, 0, 1, 0.2),
    ]
    assert any("the sheets notes" in said for said in draft.lost)
    with pytest.raises(UserError, match="arm.xlsx:3: column 'alpha': cannot read '#REF!'"):
        dh_table.read(workbook(tmp_path / "arm.xlsx", "#REF!"), options)


@pytest.mark.parametrize(
    ("cell", "sentence"),
    [("=45+45", "arm.xlsx:2: a formula without a computed value"), ("#N/A", "arm.xlsx:2: the first cell contains the error #N/A")],
)
def test_cells_without_values_are_refused(tmp_path, cell, sentence):
    book = Workbook()
    for row in (["alpha [deg]", "a", "mass"], [cell, 0.5, 1], [90, 0.5, 1]):
        book.active.append(row)
    book.save(tmp_path / "arm.xlsx")
    with pytest.raises(UserError, match=sentence):
        dh_table.read(tmp_path / "arm.xlsx", import_options(dh="modified", angles=None, stops=None))


@pytest.mark.parametrize(
    ("name", "content", "sentence"),
    [
        ("arm.xlsx", b"no", "is not a readable .xlsx workbook"),
        ("arm.csv", b"PK\x03\x04", "is not a readable .xlsx workbook"),
        ("arm.ods", b"PK\x03\x04", "save the table as .xlsx or .csv"),
    ],
)
def test_no_workbook(tmp_path, name, content, sentence):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError) as error:
        dh_table.read(tmp_path / name, import_options(dh="modified", angles=None, stops=None))
    assert sentence in str(error.value) and name in str(error.value)


def test_what_is_said(tmp_path):
    draft = imported(tmp_path, "a,theta\n1,q1\n", dh=None)
    assert any("modified DH" in x for x in draft.doubts) and any("masses and inertias" in x for x in draft.lost)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "is empty"),
        ("alpha\n1\n", "arm.csv:1: the header 'alpha' has one column"),
        ("alpha,a\n", "has a header but no rows"),
        ("alfa,a\n0,1\n", "arm.csv:1: unknown column 'alfa'; did you mean 'alpha'?"),
        ("xyzzy,a\n0,1\n", "arm.csv:1: unknown column 'xyzzy'; supported: name, "),
        ("alpha [deg],alp\n0,1\n", "arm.csv:1: two columns for 'alpha'"),
        ("alpha [kg],a\n0,1\n", "'alpha [kg]': 'kg' is not a unit of alpha"),
        ("alpha [dg],a\n0,1\n", "'dg' is not a unit of alpha; did you mean 'deg'?"),
        ("alpha,a\n0,1\n0\n", "arm.csv:3: 1 cells, but the header has 2 columns"),
        ("alpha,a\n0,1m\n", "arm.csv:2: column 'a': cannot read '1m' as a number"),
        (
            'a,mass\n1,"0,5"\n',
            "arm.csv:2: column 'mass': cannot read '0,5' as a number; with decimal commas, separate columns by ; or tabs",
        ),
        (
            "alpha,a\ndeg,mm\n",
            "arm.csv:2: column 'alpha': cannot read 'deg' as a number; write units in the header, for example 'alpha [deg]'",
        ),
        ("a,mass\n1,-2\n", "arm.csv:2: column 'mass': must be >= 0, got -2"),
        ("a,damping [N mm s/rad]\n1,2\n", "arm.csv:1: 'damping [N mm s/rad]': the unit of damping must be Nms/rad"),
        ("a,q [mm]\n1,2\n", "arm.csv:2: column 'q [mm]': the joint is revolute, but 2 is a length"),
        ("type,a,q [deg]\np,1,2\n", "arm.csv:2: column 'q [deg]': the joint is prismatic, but 2 is an angle"),
        ("type,a,upper [deg]\np,1,2\n", "arm.csv:2: column 'upper [deg]': the joint is prismatic, but 2 is an angle"),
        ("theta,d\nq1,0\n0,q_1\n", "arm.csv:3: 'q1' is also the variable of "),
        ("alpha,a\n0,t\n", "arm.csv:2: column 'a': cannot read 't' as a number"),
        ("alpha,a\n0,1e999\n", "cannot read '1e999' as a number"),
        ("theta,d\nq1,q1\n", "arm.csv:2: both theta and d are joint variables"),
        ("type,theta\np,q1\n", "the joint is prismatic, but 'theta' is its variable"),
        ("type,theta\nball,0\n", "'ball' must be revolute, prismatic or fixed"),
        ("parent,a\n,0\nlink7,1\n", "arm.csv:3: column 'parent': 'link7' is not a link of a previous row; did you mean 'link1'?"),
        ("name,parent,a\n1,0,1\n3,1,1\n4,2,1\n", "arm.csv:4: column 'parent': '2' is not a link of a previous row"),
        ("name,parent,a\na,0,1\na,a,1\nb,a,1\n", "arm.csv:4: column 'parent': several previous rows have the name 'a'"),
    ],
)
def test_mistakes(tmp_path, text, sentence):
    with pytest.raises(UserError) as error:
        imported(tmp_path, text)
    assert sentence in str(error.value) and "arm.csv" in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("names", "parents", "expected"),
    [
        (["0", "1", "2"], ["ground", "0", "1"], [-1, 0, 1]),
        (["2", "1", "3"], ["0", "2", "1"], [-1, 0, 1]),
        (["1", "2", "3"], ["0", "1", "1"], [-1, 0, 0]),
        (["link 1", "link 2", "tip"], ["0", "link 1", "2"], [-1, 0, 1]),
        (["20", "21", "22"], ["", "20", "20"], [-1, 0, 0]),
    ],
)
def test_parents_are_names_of_the_table_then_numbers_of_rows(tmp_path, names, parents, expected):
    rows = "".join(f"{name},{parent},1\n" for name, parent in zip(names, parents, strict=True))
    links = imported(tmp_path, f"name,parent,a\n{rows}").links
    order = {"ground": -1} | {link.name: i for i, link in enumerate(links)}
    assert [order[link.parent] for link in links] == expected


@pytest.mark.parametrize(
    "cell", ["90-q1", "-q2", "2*q3", "pi/2-q2", "-θ2", "180-th2", "q3-q2", "q1+q2", "2*q1-q2", "q1*0", "cos(q1)", "sqrt(q1)", "q1*q1"]
)
def test_only_the_variable_plus_a_constant_is_a_joint(tmp_path, cell):
    """A sign, a factor or a second variable would be lost."""
    with pytest.raises(UserError, match=f"arm.csv:2: column 'theta': '{re.escape(cell)}' must be the variable plus a constant"):
        imported(tmp_path, f"a,theta\n1,{cell}\n", angles="deg")


@pytest.mark.parametrize(
    ("cell", "constant"), [("q1", 0), ("90+q1", 90), ("θ_1 - 90", -90), ("2*q1 - q1 + 45", 45), ("0*", 0), ("90*", 90)]
)
def test_the_constant_beside_the_variable_is_kept(tmp_path, cell, constant):
    assert imported(tmp_path, f"a,theta\n1,{cell}\n", angles="deg").links[0].dh.theta == math.radians(constant)


def test_standard_dh_has_no_branch_parameters(tmp_path):
    with pytest.raises(UserError, match="standard DH has no gamma and b"):
        imported(tmp_path, "alpha,gamma\n0,1\n", dh="standard")
