"""Where the FMU lies and what belongs to it: paths, locations, GUID, damaged resources."""

from __future__ import annotations

import os
import shutil
import urllib.parse

import pytest

from tests.fmi.raw import OK, Slave, Unpacked
from tests.fmi.subjects import isolated

FOLDERS = ["plain", "with space", "ü", "a%20b", "100%", "a#b?c", "deep/er/and deeper"]


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_spelling_of_every_folder(fmu_file, tmp_path, folder):
    fmu = Unpacked(fmu_file("pendulum"), tmp_path / folder)
    # loaded from elsewhere, so that nothing but the location leads to the resources
    fmu.library_path = shutil.copy(fmu.library_path, tmp_path / "library.so")
    import ctypes as c

    fmu.library = c.CDLL(str(fmu.library_path))
    fmu.library.fmi2Instantiate.restype = c.c_void_p
    raw = str(fmu.folder / "resources")
    encoded = urllib.parse.quote(raw)
    for path in {raw, encoded}:
        for prefix in ("file://", "file:", "file:///", "FILE://", "file://localhost"):
            for end in ("", "/"):
                with Slave(fmu, location=prefix + path + end) as slave:
                    assert slave.setup() == OK
    with Slave(fmu, location=raw):
        pass


@pytest.mark.parametrize("location", ["", "file:///nowhere/resources", "http://example.org/resources", "%", "file:"])
def test_resources_beside_the_library_are_the_fallback(fmu, location):
    with Slave(fmu("pendulum"), location=location) as slave:
        assert slave.setup() == OK


def test_missing_resources_are_named(fmu_file, tmp_path):
    fmu = Unpacked(fmu_file("pendulum"), tmp_path / "100%s here")
    shutil.rmtree(fmu.folder / "resources")
    slave = Slave(fmu)
    assert not slave.component.value
    assert len(slave.errors) == 1 and "model.toml" in slave.errors[0] and "100%s here" in slave.errors[0]


def test_damaged_resources_are_named(fmu_file, tmp_path):
    fmu = Unpacked(fmu_file("pendulum"), tmp_path / "fmu")
    model = fmu.folder / "resources" / "model.toml"
    original = model.read_text()
    model.write_text(original.replace("mass = 1", "mass = -1"))
    slave = Slave(fmu)
    assert not slave.component.value
    assert "mass must be >= 0" in slave.errors[0] and "model.toml:" in slave.errors[0]
    model.write_text(original + "# changed\n")
    slave = Slave(fmu)
    assert not slave.component.value
    assert "GUID" in slave.errors[0]


def test_a_wrong_guid_is_refused(fmu):
    slave = Slave(fmu("pendulum"), guid="{00000000-0000-0000-0000-000000000000}")
    assert not slave.component.value
    assert "GUID" in slave.errors[0] and fmu("pendulum").guid in slave.errors[0]


@pytest.mark.parametrize("spelled", [str.upper, str.title])
def test_the_guid_is_a_number_in_either_case(fmu, spelled):
    with Slave(fmu("pendulum"), guid=spelled(fmu("pendulum").guid)) as slave:
        assert slave.setup() == OK


@pytest.mark.parametrize("make", [os.mkfifo, os.mkdir, lambda path: path.symlink_to("/dev/zero")], ids=["pipe", "folder", "device"])
def test_what_is_no_regular_file_is_refused_at_once(fmu_file, tmp_path, make):
    fmu = Unpacked(fmu_file("pendulum"), tmp_path / "fmu")
    model = fmu.folder / "resources" / "model.toml"
    model.unlink()
    make(model)

    def refuse():
        slave = Slave(fmu)
        assert not slave.component.value and len(slave.errors) == 1
        assert "model.toml' is not a regular file" in slave.errors[0]

    isolated(refuse)


def test_no_callbacks_at_all(fmu):
    import ctypes as c

    pendulum = fmu("pendulum")
    component = c.c_void_p(pendulum.library.fmi2Instantiate(b"quiet", 1, pendulum.guid.encode(), pendulum.location().encode(), None, 0, 1))
    assert component.value
    assert pendulum.library.fmi2Reset(component) == OK
    pendulum.library.fmi2FreeInstance(component)


def test_the_environments_memory_is_used_and_given_back(fmu):
    slave = Slave(fmu("pendulum"), memory=True)
    assert slave.blocks
    slave.initialize()
    slave.free()
    assert not slave.blocks


def test_many_instances_come_and_go(fmu):
    slaves = [Slave(fmu("pendulum")) for _ in range(200)]
    assert all(slave.component.value for slave in slaves)
    for slave in slaves:
        slave.free()
