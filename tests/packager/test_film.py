"""Films, the page inside an FMU, and joints that a drawing shows as people know them."""

import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.draw.plots import panels
from build_fmu.errors import UserError
from build_fmu.fmu.run_page import attached_page
from build_fmu.model.describe import describe
from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, simulate
from build_fmu.show.film import encoder, views
from build_fmu.show.motion import Motion
from build_fmu.show.runs import run_of
from tests.command_line import command
from tests.packager.test_real_fmu import ROOT, pytestmark  # noqa: F401  skips where nothing is built

# every kind of joint, a branch, a loop that moves, and a frame at each end for the FMU's own kinematics
MODEL = """
name = "zoo"
gravity = [0, -9.81, 0]
[[link]]
name = "base"
joint = "free"
mass = 4
com = [0.1, 0, 0]
inertia = [1, 1, 1]
q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6]
qd = [0.1, -0.1, 0.2, 0.5, -0.7, 0.9]
[[link]]
name = "slide"
joint = "prismatic"
alpha = 0.5
a = 0.3
theta = 0.4
mass = 1
q = 0.2
qd = 0.3
[[link]]
name = "hand"
joint = "screw"
pitch = 0.06
alpha = 0.7
a = 0.4
d = 0.1
gamma = 0.2
b = 0.3
mass = 1
com = [0.2, 0.1, 0]
inertia = [0.1, 0.1, 0.1]
q = -0.3
qd = 2
[[link]]
name = "head"
parent = "base"
joint = "spherical"
joint_name = "neck"
a = -0.5
alpha = 0.9
mass = 1
com = [0.3, 0, 0.1]
inertia = [0.1, 0.2, 0.2]
q = [0.3, -0.4, 0.5]
qd = [1, 2, -1]
[[frame]]
name = "at_hand"
link = "hand"
[[frame]]
name = "at_head"
link = "head"
position = [0.3, 0, 0.1]
[fmu]
stop_time = 0.5
step_size = 0.05
"""


@pytest.fixture
def zoo(tmp_path):
    path = tmp_path / "zoo.toml"
    path.write_text(MODEL, encoding="utf-8")
    return path


def test_the_mechanism_of_a_film_moves_as_the_fmu_does(zoo, tmp_path):
    assert main(["build", str(zoo), "-o", str(tmp_path / "zoo.fmu"), "--no-show"]) == 0
    with Session(tmp_path / "zoo.fmu") as session:
        result = simulate(session, Settings())
        run = run_of(session, result)
    motion = Motion(describe(zoo).drawing, run.columns)
    names = [link["name"] for link in motion.drawing["links"]]
    for row in (0, 4, len(run.time) - 1):
        links = motion.at(row)["links"]
        for frame, place in (("at_hand", links[names.index("hand")]["origin"]), ("at_head", links[names.index("head")]["com"])):
            assert place == pytest.approx([result[f"{frame}.position[{i}]"][row] for i in (1, 2, 3)], abs=1e-12)


def test_a_gif_has_the_pictures_that_were_asked_for(tmp_path, capsys):
    from PIL import Image

    target = tmp_path / "arm.gif"
    assert main(["show", str(ROOT / "models" / "four_bar.toml"), "--gif", str(target), "--stop", "0.5", "--rate", "10"]) == 0
    assert "6 frames, t = 0 to 0.5 s" in capsys.readouterr().out
    with Image.open(target) as film:
        assert film.n_frames == 6 and film.info["duration"] == 100 and film.info["loop"] == 0
        first = np.asarray(film.convert("RGB"), int)
        film.seek(5)
        assert np.abs(np.asarray(film.convert("RGB"), int) - first).max() > 100
    assert not list(Path.cwd().glob("four_bar.html"))


def test_an_mp4_without_ffmpeg_is_one_sentence(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert main(["show", str(ROOT / "models" / "pendulum.toml"), "--mp4", str(tmp_path / "a.mp4")]) == 1
    assert capsys.readouterr().err.strip() == "MP4 requires the program ffmpeg: install it or the package imageio-ffmpeg, or use --gif"


def test_an_mp4_plays(tmp_path):
    """The pictures that a real ffmpeg reads back from the film: as many as asked for, and they move."""
    try:
        program = encoder()
    except UserError as error:
        pytest.skip(str(error))
    target = tmp_path / "a b.mp4"
    assert main(["show", str(ROOT / "models" / "pendulum.toml"), "--mp4", str(target), "--stop", "0.5", "--rate", "10"]) == 0
    raw = subprocess.run(
        [program, "-loglevel", "error", "-i", target, "-f", "rawvideo", "-pix_fmt", "gray", "-"], capture_output=True, check=True
    ).stdout
    pictures = np.frombuffer(raw, np.uint8).reshape(-1, 448, 512).astype(int)
    assert len(pictures) == 6 and all(np.abs(after - before).max() > 50 for before, after in zip(pictures, pictures[1:], strict=False))


def test_an_mp4_goes_through_ffmpeg(tmp_path, capsys, monkeypatch):
    """A stand-in for ffmpeg counts the bytes of the pictures that it is given."""
    program = tmp_path / "ffmpeg"
    program.write_text('#!/bin/sh\nfor last; do :; done\nwc -c >"$last"\n')
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    target = tmp_path / "a.mp4"
    assert main(["show", str(ROOT / "models" / "pendulum.toml"), "--mp4", str(target), "--stop", "0.2", "--rate", "10"]) == 0
    assert int(target.read_text()) == 3 * 512 * 448 * 3
    program.write_text("#!/bin/sh\necho 'no such codec' >&2\nexit 3\n")
    assert main(["show", str(ROOT / "models" / "pendulum.toml"), "--mp4", str(tmp_path / "b.mp4"), "--stop", "0.2"]) == 1
    assert capsys.readouterr().err.strip() == "ffmpeg failed: no such codec" and not (tmp_path / "b.mp4").exists()


def test_a_film_of_too_many_frames(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["show", str(ROOT / "models" / "pendulum.toml"), "--gif", "a.gif", "--speed", "0.001"]) == 1
    said = capsys.readouterr().err
    assert "the film would have" in said and len(said.strip().splitlines()) == 1 and not list(tmp_path.iterdir())


def test_a_record_alone_has_no_mechanism_to_film(tmp_path, capsys):
    (tmp_path / "a.csv").write_text("time,x\n0,1\n1,2\n")
    assert main(["show", str(tmp_path / "a.csv"), "--gif", str(tmp_path / "a.gif")]) == 1
    assert "requires the mechanism" in capsys.readouterr().err


def test_hidden_links_of_spherical_joints_do_not_show(zoo, tmp_path, capsys):
    assert main(["check", str(zoo)]) == 0
    assert main(["build", str(zoo), "-o", str(tmp_path / "zoo.fmu")]) == 0
    said = capsys.readouterr().out
    with zipfile.ZipFile(tmp_path / "zoo.fmu") as fmu:
        pages = [fmu.read(f"documentation/{name}.html").decode() for name in ("index", "run")]
    for text in (said, *pages):
        assert "spherical" in text and not any(f"[{letter}]" in text for letter in ("chart", "z]", "x", "y"))
    links = describe(zoo).drawing["links"]
    assert [link["name"] for link in links if "[" not in link["name"]] == ["base", "slide", "hand", "head"]
    assert [links[link["parent"]]["name"] for link in links[-3:]] == ["base", "slide", "base"]


def test_the_page_inside_an_fmu(tmp_path, capsys):
    for name, option in (("a", []), ("b", []), ("c", ["--no-show"])):
        assert main(["build", str(ROOT / "models" / "planar_3r.toml"), "-o", str(tmp_path / f"{name}.fmu"), *option]) == 0
    assert capsys.readouterr().err == ""
    assert (tmp_path / "a.fmu").read_bytes() == (tmp_path / "b.fmu").read_bytes()
    with zipfile.ZipFile(tmp_path / "a.fmu") as fmu:
        text = fmu.read("documentation/run.html").decode()
        assert len(text) < 150_000 and "default-src 'none'" in text and '"joint3.q"' in text
        assert 'href="run.html"' in fmu.read("documentation/index.html").decode()
    with zipfile.ZipFile(tmp_path / "c.fmu") as fmu:
        assert "documentation/run.html" not in fmu.namelist() and "run.html" not in fmu.read("documentation/index.html").decode()


def test_a_run_that_takes_too_long_is_left_out(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("build_fmu.fmu.run_page.MOST_STEPS", 20)
    assert main(["build", str(ROOT / "models" / "planar_3r.toml"), "-o", str(tmp_path / "a.fmu")]) == 0
    assert "no page that plays it: its simulation takes more than 20 solver steps" in capsys.readouterr().err


def test_a_model_in_which_nothing_moves_has_no_page(crane, tmp_path):
    crane.drawing["links"] *= 40
    assert attached_page(crane, [])[0] is None


def test_a_plot_shows_how_balls_turn(zoo, tmp_path):
    assert main(["build", str(zoo), "-o", str(tmp_path / "zoo.fmu"), "--no-show"]) == 0
    with Session(tmp_path / "zoo.fmu") as session:
        drawn = {
            (panel.kind, panel.unit): panel
            for panel in panels(session, simulate(session, Settings(stop=3, inputs=["base.tau[3]=30"])), asked=False)
        }
    assert [label for label, _ in drawn["angle", "deg"].curves] == [f"{joint}.{axis}" for joint in ("base", "neck") for axis in "zxy"]
    assert ("omega", "deg/s") in drawn and [label for label, _ in drawn["tau", "N.m"].curves] == ["base[3]"]
    turns = np.array([values for _, values in drawn["angle", "deg"].curves])
    # what goes on at -180 degrees leaves a gap and no line across the panel
    assert np.isnan(turns).any() and np.nanmax(np.abs(np.diff(turns))) <= 270


def test_a_still_shows_one_configuration(built_library, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    pendulum = Path(__file__).parents[2] / "models" / "pendulum.toml"
    for name, more in (("start", []), ("up", ["--start", "pivot.q0=0"]), ("later", ["--at", "0.5"])):
        done = command("show", pendulum, "--stop", "0.5", "--still", f"{name}.png", *more)
        assert done.returncode == 0, done.stderr
        assert f"{name}.png" in done.stdout
    pictures = {path.stem: path.read_bytes() for path in tmp_path.iterdir()}
    assert set(pictures) == {"start", "up", "later"} and len(set(pictures.values())) == 3
    assert "--at must be between 0 and 0.5 s, got 9" in command("show", pendulum, "--stop", "0.5", "--still", "a.png", "--at", "9").stderr
    assert "add --still" in command("show", pendulum, "--at", "1").stderr


def test_the_view_follows_what_leaves_its_place():
    """A falling body is shown at its size; one that swings, and one that hops above a ground, in the extent of the run."""
    link = {"name": "body", "parent": -1, "type": "revolute", "turn": 1, "slide": 0, "rotation": np.eye(3).tolist(), "mass": 1.0}
    tables = {"loops": [], "springs": [], "contacts": []}
    falls = [{**tables, "links": [{**link, "origin": [0, 0, z], "com": [0.1, 0, z]}]} for z in (0.0, -2.0, -5.0)]
    anchor = {**link, "origin": [0, 0, 0], "com": [0, 0, 0], "mass": 0}
    bounds = views([{**frame, "links": [anchor, {**frame["links"][0], "parent": 0}]} for frame in falls])
    assert np.ptp(bounds, axis=1).max() == pytest.approx(5) and bounds[2][0] - bounds[0][0] == pytest.approx([0, 0, 0])
    for frame in falls:
        frame["links"] = [
            {**link, "name": f"body[{k}]", "slide": 1, "turn": 0, "origin": [0, 0, 0], "com": [0, 0, 0], "mass": 0} for k in (1, 2, 3)
        ] + [{**frame["links"][0], "type": "spherical", "turn": 0}]
    bounds = views(falls)
    assert np.ptp(bounds, axis=1).max() == pytest.approx(0.1) and bounds[2][0] - bounds[0][0] == pytest.approx([0, 0, -5])
    plane = {"link": "ground", "kind": "plane", "origin": [0, 0, -5], "rotation": np.eye(3).tolist()}
    foot = {"link": "body", "kind": "points", "points": [[0, 0, 0]], "origin": [0, 0, 0], "rotation": np.eye(3).tolist()}
    bounds = views([{**frame, "contacts": [{"a": foot, "b": plane}]} for frame in falls])
    assert np.all(bounds[0] == bounds[2])
