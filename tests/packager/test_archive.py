"""The FMU as a file: its content, its bytes, and what happens when writing it fails."""

import io
import os
import stat
import zipfile

import pytest
from fmpy.validation import validate_fmu

from build_fmu import native
from build_fmu.errors import UserError
from build_fmu.files import whole_file
from build_fmu.fmu import archive
from build_fmu.fmu.archive import Entry, write_archive
from build_fmu.fmu.build import build
from build_fmu.model.describe import describe

FILES = [
    "modelDescription.xml",
    "model.png",
    "binaries/linux64/crane.so",
    "resources/model.toml",
    "documentation/index.html",
    "documentation/licenses/license.txt",
]


@pytest.fixture
def fmu(compiled, model, tmp_path):
    target = tmp_path / "out ü %20" / "crane.fmu"
    build(describe(model), model, target)
    return target


def test_content(fmu, model):
    with zipfile.ZipFile(fmu) as file:
        assert file.namelist() == FILES
        assert file.testzip() is None
        assert file.read("resources/model.toml") == model.read_bytes()
        assert file.read("binaries/linux64/crane.so") == b"not a library"
        assert file.read("model.png").startswith(b"\x89PNG")


def test_fmpy_validates(fmu):
    assert validate_fmu(str(fmu)) == []


def test_equal_input_gives_equal_bytes(fmu, compiled, model, tmp_path, monkeypatch):
    # another name, time, folder, time zone and file mode of the model
    os.utime(model, (0, 0))
    model.chmod(0o600)
    monkeypatch.setenv("TZ", "Asia/Kolkata")
    monkeypatch.chdir(tmp_path)
    other = tmp_path / "other.fmu"
    build(describe(model), model, other)
    assert other.read_bytes() == fmu.read_bytes()


def test_times_and_permissions_are_fixed(fmu):
    with zipfile.ZipFile(fmu) as file:
        for info in file.infolist():
            assert info.date_time == archive.EPOCH
            assert stat.filemode(info.external_attr >> 16) == ("-rwxr-xr-x" if info.filename.endswith(".so") else "-rw-r--r--")


def test_no_stray_file_beside_the_target(fmu):
    assert [p.name for p in fmu.parent.iterdir()] == ["crane.fmu"]


def test_a_failed_build_keeps_the_old_file_and_leaves_nothing(tmp_path, monkeypatch):
    target = tmp_path / "a.fmu"
    target.write_bytes(b"old")

    def broken(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(zipfile.ZipFile, "writestr", broken)
    with pytest.raises(UserError, match="No space left on device"):
        write_archive(target, [Entry("a", b"b")])
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_an_interrupt_leaves_nothing(tmp_path):
    def interrupted(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        whole_file(tmp_path / "a.fmu", interrupted)
    assert list(tmp_path.iterdir()) == []


def test_permissions_follow_the_users_mask(tmp_path):
    old = os.umask(0o022)
    try:
        whole_file(tmp_path / "a.csv", lambda p: p.write_text("x"))
    finally:
        os.umask(old)
    assert stat.S_IMODE((tmp_path / "a.csv").stat().st_mode) == 0o644


def test_a_folder_is_no_target(tmp_path):
    with pytest.raises(UserError, match="is a folder"):
        whole_file(tmp_path, lambda p: None)


@pytest.mark.parametrize("name", ["model.toml", "model", "model.fmu.toml"])
def test_only_fmu_names_are_written(compiled, model, name):
    with pytest.raises(UserError, match="must end in .fmu"):
        build(describe(model), model, model.parent / name)


def test_pages(fmu):
    with zipfile.ZipFile(fmu) as file:
        page = file.read("documentation/index.html").decode()
        licence = file.read("documentation/licenses/license.txt").decode()
    for text in ("slew.tau", "N.m", "boom &lt;with hook&gt;", "../model.png", "licenses/license.txt", "tunable"):
        assert text in page
    for text in ("SUNDIALS", "MPL-2.0", "MIT", "GCC-exception", "Redistribution"):
        assert text in licence


def test_terms_beside_the_library_go_into_the_fmu(compiled, model, tmp_path):
    (compiled / "licenses").mkdir()
    (compiled / "licenses" / "sundials.txt").write_text("terms of ü", encoding="utf-8")
    build(describe(model), model, tmp_path / "crane.fmu")
    with zipfile.ZipFile(tmp_path / "crane.fmu") as file:
        assert file.read("documentation/licenses/sundials.txt").decode() == "terms of ü"
        assert "sundials.txt" in file.read("documentation/licenses/license.txt").decode()


def test_a_library_for_each_platform(compiled, model, tmp_path, monkeypatch):
    foreign = tmp_path / "foreign"
    (foreign / "licenses").mkdir(parents=True)
    (foreign / "licenses" / "mingw-w64.txt").write_text("terms of the run time")
    (foreign / "library.dll").write_bytes(b"not a library either")
    monkeypatch.setenv("REDYSIM_FMU_LIBRARY_WIN64", str(foreign / "library.dll"))
    build(describe(model), model, tmp_path / "both.fmu", platforms=["linux64", "win64"])
    build(describe(model), model, tmp_path / "one.fmu", platforms=["win64"])
    with zipfile.ZipFile(tmp_path / "both.fmu") as file:
        binaries = [name for name in file.namelist() if name.startswith("binaries/")]
        assert binaries == ["binaries/linux64/crane.so", "binaries/win64/crane.dll"]
        assert file.read("binaries/win64/crane.dll") == b"not a library either"
        assert "mingw-w64.txt" in file.read("documentation/licenses/license.txt").decode()
    with zipfile.ZipFile(tmp_path / "one.fmu") as file:
        assert [name for name in file.namelist() if name.startswith("binaries/")] == ["binaries/win64/crane.dll"]


def test_an_arm_library_lies_where_importers_look(compiled, model, tmp_path, monkeypatch):
    (tmp_path / "library.so").write_bytes(b"for Arm")
    monkeypatch.setenv("REDYSIM_FMU_LIBRARY_AARCH64_LINUX", str(tmp_path / "library.so"))
    folders = {
        (2, "linux64", "aarch64-linux"): ["linux64", "aarch64-linux"],
        (2, "aarch64-linux"): ["aarch64-linux", "linux64"],
        (3, "linux64", "aarch64-linux"): ["x86_64-linux", "aarch64-linux"],
        (3, "aarch64-linux"): ["aarch64-linux"],
    }
    for (fmi, *platforms), expected in folders.items():
        build(describe(model), model, tmp_path / "crane.fmu", platforms=platforms, fmi=fmi)
        with zipfile.ZipFile(tmp_path / "crane.fmu") as file:
            assert [name for name in file.namelist() if name.startswith("binaries/")] == [f"binaries/{f}/crane.so" for f in expected]
            assert file.read("binaries/aarch64-linux/crane.so") == b"for Arm"
            assert (file.read(f"binaries/{expected[-1]}/crane.so") == b"for Arm") or expected[-1] == "x86_64-linux"


def test_tested_libraries_that_are_not_older_are_packed_by_default(compiled, monkeypatch, tmp_path):
    monkeypatch.setattr(native, "SOURCE_TREE", tmp_path)
    monkeypatch.setattr(native, "PACKAGE", tmp_path / "build_fmu")
    for variable in ("WIN64", "AARCH64_LINUX"):
        monkeypatch.delenv(f"REDYSIM_FMU_LIBRARY_{variable}", raising=False)
    assert native.platforms() == ["linux64"]
    for platform, (name, _) in native.LIBRARIES.items():
        if platform != "linux64":
            folder = tmp_path / "build" / platform / "fmu_src" / "fmi"
            folder.mkdir(parents=True)
            (folder / name).write_bytes(b"library")
    assert native.platforms() == ["linux64", "win64", "aarch64-linux"]
    os.utime(tmp_path / "build" / "win64" / "fmu_src" / "fmi" / "libredysim_fmu.dll", (1, 1))
    assert native.platforms() == ["linux64", "aarch64-linux"]
    installed = tmp_path / "build_fmu" / "native" / "win64" / "libredysim_fmu.dll"
    installed.parent.mkdir(parents=True)
    installed.write_bytes(b"library")
    os.utime(installed, (1, 1))
    assert native.platforms() == ["linux64", "win64", "aarch64-linux"], "those of a wheel belong together"


def test_picture_is_of_a_useful_size(fmu):
    from PIL import Image

    with zipfile.ZipFile(fmu) as file, Image.open(io.BytesIO(file.read("model.png"))) as picture:
        assert min(picture.size) >= 400 and len(file.read("model.png")) < 200_000
