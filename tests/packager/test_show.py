"""The page of a run: complete in itself, safe with odd names, and its own kinematics checked in a browser where there is one."""

import base64
import html
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.importers.draft import DhFrame
from build_fmu.importers.rigid import pose_of
from build_fmu.show.page import MOST_VALUES, Run, page

MODEL = """
name = "reach"
description = "A <b>turning</b> arm & a slider"
gravity = [0, 0, -9.81]
[[link]]
name = "mast"
gamma = 0.3
b = 0.1
alpha = 0.4
a = 0.2
mass = 1
inertia = [1, 1, 1]
q = 0.5
qd = 1
[[link]]
name = "plate"
joint = "fixed"
alpha = 1.1
a = 0.3
[[link]]
name = "slide"
joint = "prismatic"
alpha = -0.7
d = 0.2
theta = 0.6
mass = 1
q = 0.1
[[link]]
name = "hand"
joint = "screw"
pitch = -0.15
alpha = 1.2
a = 0.25
mass = 0.5
com = [0.1, 0.2, 0.3]
inertia = [0.1, 0.1, 0.1]
[[spring]]
name = "coil"
link_a = "ground"
link_b = "slide"
point_a = [1, 0, 0]
stiffness = 3
[fmu]
stop_time = 0.5
step_size = 0.01
"""
DH = {
    "mast": DhFrame(0.3, 0.1, 0.4, 0.2),
    "plate": DhFrame(alpha=1.1, a=0.3),
    "slide": DhFrame(alpha=-0.7, theta=0.6, d=0.2),
    "hand": DhFrame(alpha=1.2, a=0.25),
}
JOINTS = {"mast": "revolute", "plate": "fixed", "slide": "prismatic", "hand": "revolute"}
PITCHES = {"hand": -0.15}


needs_library = pytest.mark.usefixtures("built_library")
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--window-size=1300,800",
)
needs_browser = pytest.mark.skipif(BROWSER is None, reason="there is no chromium")

# a hinge and a ball joint
BALL = """
name = "ball"
[[link]]
name = "arm"
alpha = 0.7
mass = 1
com = [0.5, 0, 0]
inertia = [0.1, 0.1, 0.1]
[[link]]
name = "body"
joint = "spherical"
joint_name = "socket"
a = 1
alpha = 0.4
mass = 1
com = [0.3, 0.1, -0.4]
inertia = [0.1, 0.2, 0.2]
q = [0.3, -0.4, 0.5]
qd = [1, 2, 3]
"""


@pytest.fixture
def model_file(tmp_path):
    path = tmp_path / "reach.toml"
    path.write_text(MODEL, encoding="utf-8")
    return path


def data_of(text):
    return json.loads(re.search(r'<script type="application/json" id="run">(.*?)</script>', text, re.DOTALL)[1])


@needs_library
def test_one_file_that_asks_for_nothing_else(model_file, tmp_path, capsys):
    out = tmp_path / "page.html"
    assert main(["show", str(model_file), "-o", str(out)]) == 0
    assert "open it in a browser" in capsys.readouterr().out
    text = out.read_text(encoding="utf-8")
    assert len(text) < 300_000 and "default-src 'none'" in text
    assert not re.search(r"https?://|src=|href=|@import|url\(", text.replace("<p id=", ""))
    assert "A &lt;b&gt;turning&lt;/b&gt; arm &amp; a slider" in text
    data = data_of(text)
    assert [panel["title"] for panel in data["panels"]][:3] == ["Joint position", "Joint position", "Joint velocity"]
    assert {panel["unit"] for panel in data["panels"][:2]} == {"deg", "m"}
    assert [link["q"] for link in data["drawing"]["links"]] == ["mast.q", None, "slide.q", "hand.q"]
    assert [link["q0"] for link in data["drawing"]["links"]] == [0.5, 0, 0.1, 0]


@needs_library
def test_a_warning_is_printed_once_with_its_place(tmp_path, capsys):
    model = Path(__file__).parents[2] / "models" / "hoeken.toml"
    assert main(["show", str(model), "--stop", "0.1", "-o", str(tmp_path / "page.html")]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"{model}:43:1: warning: initial velocities violate the loop constraints")


@needs_library
def test_a_coarse_step_still_plays_smoothly(model_file, tmp_path):
    for options, rows in (([], 251), (["--step", "0.125"], 5)):
        assert main(["show", str(model_file), *options, "-o", str(tmp_path / "page.html")]) == 0
        assert len(base64.b64decode(data_of((tmp_path / "page.html").read_text(encoding="utf-8"))["time"])) == 8 * rows


@needs_library
@pytest.mark.parametrize(
    ("options", "ends", "position", "sentence"),
    [
        (["--input", "mast.tau=1e200*(t>0.2)"], 0.2, 0.5, "the accelerations at the start of the step are not finite"),
        (["--start", "mast.q0=1.2", "mast.qd0=1e300"], 0, 1.2, "the accelerations at 0 s are not finite"),
    ],
    ids=["in a step", "at the start"],
)
def test_a_run_that_fails_is_shown_until_then(model_file, tmp_path, capsys, options, ends, position, sentence):
    out, picture = tmp_path / "page.html", tmp_path / "pose.png"
    assert main(["show", str(model_file), *options, "-o", str(out), "--still", str(picture)]) == 1
    assert sentence in capsys.readouterr().err and picture.is_file()
    text = out.read_text(encoding="utf-8")
    assert sentence in re.search(r'<p id="failure">(.*?)</p>', text)[1]
    data = data_of(text)
    times = np.frombuffer(base64.b64decode(data["time"]))
    values = np.frombuffer(base64.b64decode(data["values"]), np.float32).reshape(len(data["names"]), len(times))
    # up to one frame before the failure
    assert times[0] == 0 and ends - 0.002 - 1e-9 <= times[-1] <= ends + 1e-9
    assert values[data["names"].index("mast.q"), 0] == np.float32(position)


@needs_library
def test_an_fmu_and_a_record(model_file, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["build", str(model_file)]) == 0
    assert main(["simulate", "reach.fmu", "--csv", "run.csv", "--input", "mast.tau=1"]) == 0
    for targets, links in ((["reach.fmu"], 4), (["run.csv", "reach.fmu"], 4), (["run.csv"], 0)):
        assert main(["show", *targets, "-o", "x.html"]) == 0
        assert len(data_of((tmp_path / "x.html").read_text(encoding="utf-8"))["drawing"]["links"]) == links
    assert main(["show", "run.csv"]) == 0 and (tmp_path / "run.html").is_file()
    assert main(["simulate", "reach.fmu", "--csv", "part.csv", "--output", "mast.q"]) == 0
    capsys.readouterr()
    assert main(["show", "part.csv", "reach.fmu"]) == 0
    assert "'part.csv' has no column 'slide.q' and 1 more: these joints do not move" in capsys.readouterr().err


@needs_library
def test_a_record_without_a_quaternion_names_the_joint_that_does_not_move(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    links = [
        f'[[link]]\nname = "{name}"\njoint = "{kind}"\nmass = 1\ninertia = [1, 1, 1]\n'
        for name, kind in (("base", "free"), ("hip", "spherical"))
    ]
    Path("ball.toml").write_text('name = "ball"\n' + "".join(links))
    heads = [
        "time",
        *(f"base[{k}].q" for k in (1, 2, 3)),
        *(f"base.quaternion[{k}]" for k in (1, 2, 3, 4)),
        *(f"hip.quaternion[{k}]" for k in (1, 2, 3, 4)),
    ]
    gone = (
        (heads, ""),
        (heads[:11], "'hip.quaternion[4]': "),
        (heads[:4], "'base.quaternion[1]' and 1 more: "),
        (["time", "x"], "'base[1].q' and 4 more: "),
    )
    for named, said in gone:
        Path("run.csv").write_text("\n".join([",".join(named), *(",".join([f"{t}"] + ["0.5"] * (len(named) - 1)) for t in (0, 1))]) + "\n")
        capsys.readouterr()
        assert main(["show", "run.csv", "ball.toml", "-o", "x.html", "--still", "x.png"]) == 0
        err = capsys.readouterr().err
        assert (f"'run.csv' has no column {said}these joints do not move" in err) if said else "do not move" not in err, err


@needs_library
@pytest.mark.parametrize(
    ("targets", "sentence"),
    [
        (["a.txt"], "unsupported file type: 'a.txt'"),
        (["--input", "nothing.tau=1", "reach.toml"], "unknown input 'nothing.tau'"),
        (["missing.fmu"], "FMU 'missing.fmu' does not exist"),
        (["missing.toml"], "model file 'missing.toml' does not exist"),
        (["missing.csv"], "cannot read 'missing.csv'"),
        (["broken.fmu"], "is not a readable FMU"),
        (["empty.csv"], "has no column except time"),
    ],
)
def test_mistakes(model_file, tmp_path, monkeypatch, capsys, targets, sentence):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.fmu").write_bytes(b"PK no")
    (tmp_path / "empty.csv").write_text("time\n0\n1\n")
    assert main(["show", *targets]) == 1
    said = capsys.readouterr().err
    assert sentence in said and len(said.strip().splitlines()) == 1 and not list(tmp_path.glob("*.html"))


def test_names_cannot_leave_the_data(crane):
    run = Run(np.array([0.0, 1.0]), {"</script><b>.q": np.array([0.0, 1.0])})
    text, _ = page("</title><i>", "a & b", run, None)
    assert "</script><b>" not in text and "</title><i>" not in text
    assert data_of(text)["names"] == ["</script><b>.q"]


def test_long_runs_keep_every_kth_row_and_the_last(crane):
    time = np.linspace(0, 1, 100_001)
    text, stride = page("x", "", Run(time, {"a.q": time, "b.q": time}), None)
    assert stride == 4 and len(text) < 1_000_000
    values = np.frombuffer(__import__("base64").b64decode(data_of(text)["time"]), "<f8")
    assert values[0] == 0 and values[-1] == 1 and 2 * len(values) <= MOST_VALUES + 2


def test_the_crane_of_a_record(crane):
    """A table with other names than the model's leaves the drawing in its start pose."""
    text, _ = page("x", "", Run(np.array([0.0, 1.0]), {"other": np.array([0.0, 1.0])}), crane)
    assert all(link["q"] is None for link in data_of(text)["drawing"]["links"])


def browse(path, folder, *options):
    profile = folder / "profile"
    command = [BROWSER, *FLAGS, f"--user-data-dir={profile}", *options, path]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True, cwd=folder).stdout


def attribute(dom, name):
    found = re.search(rf'data-{name}="([^"]*)"', dom)
    return html.unescape(found[1]) if found else None


@needs_library
@needs_browser
def test_the_browser_puts_the_links_where_the_model_has_them(model_file, tmp_path):
    """Also from another start than the drawing's: only the difference of the joint values counts."""
    record, out = tmp_path / "run.csv", tmp_path / "page.html"
    start = ["--start", "mast.q0=-0.7", "slide.q0=0.4"]
    assert main(["simulate", str(model_file), *start, "--csv", str(record)]) == 0
    assert main(["show", str(model_file), *start, "-o", str(out)]) == 0
    dom = browse(f"{out.as_uri()}#t=0.25", tmp_path, "--dump-dom")
    assert attribute(dom, "trouble") is None and int(attribute(dom, "faces")) > 100
    assert json.loads(attribute(dom, "extent"))[2:] == [False, [0, 0, 0]]
    table = np.genfromtxt(record, delimiter=",", names=True, deletechars="")
    row = table[np.argmin(np.abs(table["time"] - 0.25))]
    pose = np.eye(4)
    for name, dh in DH.items():
        q = row[f"{name}.q"] if f"{name}.q" in table.dtype.names else 0.0
        pose = pose @ pose_of(dh, JOINTS[name], q)
        pose[:3, 3] += pose[:3, 2] * PITCHES.get(name, 0.0) * q
    assert json.loads(attribute(dom, "tips"))[0] == pytest.approx((pose @ [0.1, 0.2, 0.3, 1])[:3], abs=1e-6)
    assert "0.250 of 0.500 s" in dom and dom.count('class="panel"') >= 5


@needs_library
@needs_browser
def test_a_spherical_joint_turns_by_its_quaternion(tmp_path):
    model, record, out = tmp_path / "ball.toml", tmp_path / "run.csv", tmp_path / "page.html"
    model.write_text(BALL, encoding="utf-8")
    assert main(["simulate", str(model), "--stop", "0.5", "--step", "0.01", "--csv", str(record)]) == 0
    assert main(["show", str(model), str(record), "-o", str(out)]) == 0
    dom = browse(f"{out.as_uri()}#t=0.25", tmp_path, "--dump-dom")
    table = np.genfromtxt(record, delimiter=",", names=True, deletechars="")
    row = table[np.argmin(np.abs(table["time"] - 0.25))]
    w, x, y, z = (row[f"socket.quaternion[{i}]"] for i in range(1, 5))
    com = np.array([0.3, 0.1, -0.4])
    axis = np.array([x, y, z])
    turned = com + 2 * np.cross(axis, np.cross(axis, com) + w * com)
    expected = pose_of(DhFrame(alpha=0.7), "revolute", row["arm.q"]) @ pose_of(DhFrame(alpha=0.4, a=1)) @ [*turned, 1]
    assert attribute(dom, "trouble") is None
    assert json.loads(attribute(dom, "tips"))[0] == pytest.approx(expected[:3], abs=1e-6)


@needs_library
@needs_browser
@pytest.mark.parametrize(("gravity", "up"), [([0, -9.81, 0], [0, 1, 0]), ([-3, 0, -4], [0.6, 0, 0.8]), ([0, 0, 0], [0, 0, 1])])
def test_up_is_against_gravity(model_file, tmp_path, gravity, up):
    model_file.write_text(MODEL.replace("[0, 0, -9.81]", str(gravity)), encoding="utf-8")
    assert main(["show", str(model_file), "-o", str(tmp_path / "page.html")]) == 0
    dom = browse((tmp_path / "page.html").as_uri() + "#t=0", tmp_path, "--dump-dom")
    assert json.loads(attribute(dom, "up")) == pytest.approx(up)


FALLING = """
name = "falling"
gravity = [0, 0, -9.81]
[[link]]
name = "trunk"
joint = "free"
drive = "free"
mass = 1
com = [0.1, 0, 0]
inertia = [0.1, 0.1, 0.1]
[fmu]
stop_time = 2
step_size = 0.1
"""


@needs_library
@needs_browser
def test_the_view_follows_a_free_base(tmp_path):
    """The picture has the size of the robot and not of its fall; a robot on a fixed base is not followed."""
    (tmp_path / "falling.toml").write_text(FALLING, encoding="utf-8")
    assert main(["show", str(tmp_path / "falling.toml"), "-o", str(tmp_path / "page.html")]) == 0
    text = (tmp_path / "page.html").read_text(encoding="utf-8")
    labels = [curve["label"] for panel in data_of(text)["panels"] if panel["title"] == "Joint position" for curve in panel["curves"]]
    assert labels == ["trunk.x", "trunk.y", "trunk.z"] and "1 free, 1 kg" in text
    dom = browse((tmp_path / "page.html").as_uri() + "#t=1", tmp_path, "--dump-dom")
    whole, robot, leaves, travelled = json.loads(attribute(dom, "extent"))
    assert attribute(dom, "trouble") is None and leaves and robot < 0.2 and whole > 9
    assert travelled == pytest.approx([0, 0, -9.81 / 2], rel=1e-5, abs=1e-5) and int(attribute(dom, "faces")) < 60


@needs_library
@needs_browser
def test_the_run_plays_by_itself(model_file, tmp_path):
    out = tmp_path / "page.html"
    assert main(["show", str(model_file), "--stop", "5", "-o", str(out)]) == 0
    dom = browse(out.as_uri(), tmp_path, "--virtual-time-budget=1500", "--dump-dom")
    clock = re.search(r'<output id="clock">([\d.]+) of', dom)
    assert attribute(dom, "trouble") is None and float(clock[1]) > 0


@needs_browser
def test_a_record_without_mechanism(tmp_path):
    (tmp_path / "a.csv").write_text("time,x,y.q\n0,1,0\n1,nan,2\n2,3,2\n".replace("nan", "2"))
    assert main(["show", str(tmp_path / "a.csv"), "-o", str(tmp_path / "a.html")]) == 0
    dom = browse((tmp_path / "a.html").as_uri() + "#t=1", tmp_path, "--dump-dom")
    assert attribute(dom, "trouble") is None and dom.count('class="panel"') == 2 and 'class="plain"' in dom


@needs_library
def test_an_output_that_is_not_finite_is_one_sentence(tmp_path, capsys):
    pendulum = tmp_path / "pendulum.toml"
    pendulum.write_text('name = "pendulum"\n[[link]]\nname = "rod"\nmass = 1\ncom = [1, 0, 0]\n', encoding="utf-8")
    assert main(["simulate", str(pendulum), "--start", "rod.qd0=1e300"]) == 1
    assert "the FMU failed when reading its outputs: fmi2GetReal: energy.kinetic is not finite: inf" in capsys.readouterr().err
