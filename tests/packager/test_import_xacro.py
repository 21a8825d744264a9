"""xacro files: expansion by the package `xacro`, its arguments, packages, errors; one sentence without it."""

import sys
import xml.dom.minidom
from pathlib import Path
from types import SimpleNamespace

import pytest

from build_fmu.errors import UserError
from build_fmu.importers import urdf
from build_fmu.importers.packages import has_macros, places_of
from build_fmu.importers.urdf_visuals import mesh_file
from tests.packager.import_options import import_options

ARM = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro" name="arm">
  <xacro:arg name="length" default="0.5"/><xacro:include filename="$(find arm_parts)/part.xacro"/>
  <link name="base"/><xacro:part name="one" parent="base"/><xacro:part name="two" parent="one"/>
</robot>"""
PART = """<robot xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:macro name="part" params="name parent">
  <link name="${name}"><inertial><mass value="${2 * 1.5}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="j_${name}" type="continuous"><origin xyz="$(arg length) 0 0"/><parent link="${parent}"/><child link="${name}"/><axis xyz="0 1 0"/></joint>
</xacro:macro></robot>"""


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm_parts").mkdir()
    (tmp_path / "arm_parts" / "part.xacro").write_text(PART)
    (tmp_path / "robots").mkdir()
    path = tmp_path / "robots" / "arm.xacro"
    path.write_text(ARM)
    return path


def test_macros_arguments_and_packages(arm):
    pytest.importorskip("xacro")
    draft = urdf.read(arm, import_options(arg=["length=0.8"]))
    assert [(link.joint_name, link.mass) for link in draft.links] == [("j_one", 3), ("j_two", 3)]
    assert draft.links[1].dh.a == pytest.approx(0.8)
    assert urdf.read(arm, import_options()).links[1].dh.a == pytest.approx(0.5)
    assert "ament_index_python" not in sys.modules
    with pytest.raises(UserError, match="--arg lenght: .* has no argument of this name; did you mean 'length'"):
        urdf.read(arm, import_options(arg=["lenght=0.8"]))


def test_errors_of_xacro_are_one_sentence(arm):
    pytest.importorskip("xacro")
    arm.write_text(ARM.replace("arm_parts", "other_parts"))
    with pytest.raises(UserError, match="cannot be expanded by xacro: package 'other_parts' is not found above"):
        urdf.read(arm, import_options())


def test_without_the_package_one_sentence_says_what_to_do(arm, monkeypatch):
    monkeypatch.setitem(sys.modules, "xacro", None)
    for path in (arm, arm.rename(arm.with_suffix(".urdf"))):
        path.write_text(ARM)
        with pytest.raises(UserError, match=r"contains xacro macros: install the package xacro .*or run `xacro arm"):
            urdf.read(path, import_options())
    no_macros = arm.with_suffix(".xacro")
    no_macros.write_text("no XML")
    with pytest.raises(UserError, match=r"arm\.xacro:1:1: invalid XML"):
        urdf.read(no_macros, import_options())


def test_macros_in_comments_of_an_expanded_file_need_no_xacro(arm, monkeypatch):
    monkeypatch.setitem(sys.modules, "xacro", None)
    path = arm.with_suffix(".urdf")
    inner = PART[PART.index("<link") : PART.index("</xacro:macro>")]
    for old, new in (("${2 * 1.5}", "3"), ("$(arg length)", "0.5"), ("${name}", "one"), ("${parent}", "base")):
        inner = inner.replace(old, new)
    comment = '<!-- <xacro:part name="two"\n mass="${1 + 2}"/> -->'
    path.write_text(f'<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="base"/>{inner}{comment}</robot>')
    assert [(link.joint_name, link.mass) for link in urdf.read(path, import_options()).links] == [("j_one", 3)]


def test_the_prefix_of_macros_is_free():
    root = '<robot xmlns:{}="http://www.ros.org/wiki/xacro"><{}:arg name="a"/></robot>'
    for prefix in ("xacro", "x"):
        assert has_macros(Path("arm.urdf"), root.format(prefix, prefix))
    assert not has_macros(Path("arm.urdf"), root.format("x", "y"))


def test_the_expansion_is_what_is_read(arm, monkeypatch):
    text = ARM[: ARM.index("\n")] + '<link name="base"/><link name="b"/><joint name="j" type="hinge"/></robot>'
    seen = {}

    def process_file(path, mappings):
        seen.update(path=path, mappings=mappings)
        assert mappings["a"] == "1" and "other" not in mappings
        seen["with_b"] = "b" in mappings
        return xml.dom.minidom.parseString(text)

    monkeypatch.setitem(sys.modules, "xacro", SimpleNamespace(process_file=process_file))
    with pytest.raises(UserError, match=r"arm\.xacro \(expanded\):\d+: joint 'j': unknown type 'hinge'"):
        urdf.read(arm, import_options(arg=["a=1", "b:=x=2"]))
    assert seen == {"path": str(arm), "mappings": {"a": "1", "b": "x=2"}, "with_b": True}
    with pytest.raises(UserError, match="--arg a_: .* has no argument of this name; did you mean 'a'"):
        urdf.read(arm, import_options(arg=["a=1", "a_=2"]))
    with pytest.raises(UserError, match="--arg: 'a' must be NAME=VALUE"):
        urdf.read(arm, import_options(arg=["a"]))


def test_packages_of_the_environment(tmp_path, monkeypatch):
    for inner in ("ros/arm/meshes", "prefix/share/hand/meshes"):
        (tmp_path / inner).mkdir(parents=True)
        (tmp_path / inner / "a.stl").write_text("")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "ros"))
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path / "prefix"))
    robot = tmp_path / "elsewhere" / "r.urdf"
    assert mesh_file("package://arm/meshes/a.stl", robot).samefile(tmp_path / "ros/arm/meshes/a.stl")
    assert mesh_file("package://hand/meshes/a.stl", robot).samefile(tmp_path / "prefix/share/hand/meshes/a.stl")
    assert mesh_file("package://foot/meshes/a.stl", robot) is None
    assert tmp_path in places_of(tmp_path.name, tmp_path / "elsewhere")
