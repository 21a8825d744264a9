"""From a model file to a plot with the compiled library, by the command line. Skipped where nothing is built."""

import csv
import json
import os
import subprocess
import sys
import zipfile
from contextlib import chdir
from pathlib import Path

import numpy as np
import pytest

from build_fmu.draw.groups import title_of
from build_fmu.model.describe import describe
from tests.command_line import command

ROOT = Path(__file__).parents[2]
PENDULUM = ROOT / "models" / "pendulum.toml"


pytestmark = pytest.mark.usefixtures("built_library")


ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}


def run(*arguments, cwd):
    with chdir(cwd):
        return command(*arguments)


def run_program(*arguments, cwd):
    words = [sys.executable, "-m", "build_fmu", *map(str, arguments)]
    return subprocess.run(words, cwd=cwd, env=ENVIRONMENT, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)


def test_check_counts_couplings_and_the_plot_names_their_gaps(folder):
    """The couplings of describe's table: joints with a drawing link each, also behind a spherical joint's hidden links."""
    assert "couplings    3" in run("check", ROOT / "models" / "mimic_hand.toml", cwd=folder).stdout
    drawing = describe(ROOT / "models" / "mimic_hand.toml").drawing
    named = [[drawing["links"][i]["joint"] for i in coupling["links"]] for coupling in drawing["couplings"]]
    assert named[0] == ["left_distal", "left_proximal"]
    head = '[[link]]\nname = "ball"\njoint = "spherical"\nmass = 1\ninertia = [1, 1, 1]\n'
    pair = "".join(f'[[link]]\nname = "{name}"\nparent = "ball"\nmass = 1\ninertia = [1, 1, 1]\n' for name in "ab")
    (folder / "m.toml").write_text(f'name = "m"\n{head}{pair}[[coupling]]\nname = "gear"\njoints = ["a", "b"]\nratios = [1, 2]\n')
    drawing = describe(folder / "m.toml").drawing
    assert [drawing["links"][i]["name"] for i in drawing["couplings"][0]["links"]] == ["a", "b"]
    assert "loop" in title_of("gap") and "coupling" in title_of("gap")


@pytest.fixture
def folder(tmp_path):
    path = tmp_path / "ü %20 space"
    path.mkdir()
    return path


def test_the_whole_way(folder):
    assert run_program("build", PENDULUM, cwd=folder).returncode == 0
    (folder / "a.csv").write_text("time,rod.q\n0,0\n")  # an older record, which may go
    done = run_program("simulate", "pendulum.fmu", "--stop", 0.5, "--csv", "a.csv", "--plot", "a.png", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    rows = list(csv.reader((folder / "a.csv").open()))
    assert rows[0][0] == "time" and float(rows[-1][0]) == 0.5
    assert sorted(p.name for p in folder.iterdir()) == ["a.csv", "a.png", "pendulum.fmu"]


@pytest.fixture(scope="module")
def other_process():
    """A process with another hash seed; one line of input is one model and FMU to be built, one line of output an exit code."""
    program = """
import contextlib, sys
from build_fmu.cli import main
for line in sys.stdin:
    model, target = line.rstrip("\\n").split("\\t")
    with contextlib.redirect_stdout(sys.stderr):
        code = main(["build", model, "-o", target])
    print(code, flush=True)
"""
    environment = {**ENVIRONMENT, "PYTHONHASHSEED": "7"}
    with subprocess.Popen(
        [sys.executable, "-c", program], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        yield child
        child.stdin.close()


@pytest.mark.parametrize("model", sorted((ROOT / "models").glob("*.toml")), ids=lambda path: path.stem)
def test_every_model_is_valid_and_the_same_in_every_process(model, folder, other_process):
    from fmpy.validation import validate_fmu

    done = run("build", model, "-o", "a.fmu", cwd=folder)
    assert done.returncode == 0, done.stderr
    print(model, folder / "b.fmu", sep="\t", file=other_process.stdin, flush=True)
    assert other_process.stdout.readline() == "0\n"
    assert (folder / "a.fmu").read_bytes() == (folder / "b.fmu").read_bytes()
    assert validate_fmu(str(folder / "a.fmu")) == []


def test_a_model_runs_without_leaving_anything(folder):
    done = run("simulate", PENDULUM, "--stop", 0.1, cwd=folder)
    assert done.returncode == 0 and "energy.total" in done.stdout
    assert list(folder.iterdir()) == []


def test_the_functions_of_fmpy_accept_the_fmu(folder):
    from fmpy import simulate_fmu

    assert run("build", PENDULUM, cwd=folder).returncode == 0
    result = simulate_fmu(str(folder / "pendulum.fmu"), stop_time=0.2)
    assert result["time"][-1] == pytest.approx(0.2)


def test_a_wrong_name_gets_a_suggestion(folder):
    run("build", PENDULUM, cwd=folder)
    with zipfile.ZipFile(folder / "pendulum.fmu") as file:
        assert b".tau" in file.read("modelDescription.xml")
    done = run("simulate", "pendulum.fmu", "--start", "solver.rtool=1e-9", cwd=folder)
    assert done.returncode == 1 and "did you mean 'solver.rtol'" in done.stderr


def test_a_refused_value_gives_the_fmus_own_sentence(folder):
    done = run("simulate", PENDULUM, "--start", "solver.rtol=-1", cwd=folder)
    assert done.returncode == 1 and "Traceback" not in done.stderr
    assert "solver.rtol" in done.stderr and len(done.stderr.strip().splitlines()) == 1


def links(count, trees=1):
    each = "[[link]]\nname = 'l{0}'\njoint_name = 'j{0}'\nparent = '{1}'\nmass = 1\ncom = [0.1, 0, 0]\na = 0.2\n"
    return "name = 'many'\n" + "".join(each.format(i, f"l{i - trees}" if i >= trees else "ground") for i in range(count))


def rows_of(text, tmp_path, group):
    """Returns the description of a model text and a row of its structure by the name of the unknown."""
    from xml.etree import ElementTree as xml

    from build_fmu.fmu.description import model_description
    from build_fmu.model.describe import describe

    (tmp_path / "many.toml").write_text(text)
    content = model_description(describe(tmp_path / "many.toml"))
    root = xml.fromstring(content)
    names = [scalar.get("name") for scalar in root.iter("ScalarVariable")]
    return content, {names[int(row.get("index")) - 1]: row for row in root.find(f"ModelStructure/{group}")}


def test_a_description_grows_with_the_joints_and_not_with_their_square(tmp_path):
    content, rows = rows_of(links(1000), tmp_path, "InitialUnknowns")
    assert len(content) < 3_000_000
    assert "dependencies" not in rows["j999.qdd"].attrib and len(rows["j999.q"].get("dependencies").split()) == 1
    # too many to list, though not all
    content, rows = rows_of(links(1200, trees=2), tmp_path, "Outputs")
    assert len(content) < 3_600_000
    assert "dependencies" not in rows["j999.qdd"].attrib and len(rows["j999.q"].get("dependencies").split()) == 1


def test_what_does_not_depend_on_all_is_listed(tmp_path):
    _, rows = rows_of(links(4, trees=2), tmp_path, "Outputs")
    # torques, positions and velocities of the own tree
    assert rows["j0.qdd"].get("dependencies") == "1 3 5 7 9 11" and rows["j1.qdd"].get("dependencies") == "2 4 6 8 10 12"


def test_many_links_are_listed_as_lines(tmp_path):
    (tmp_path / "many.toml").write_text(links(300))
    checked = run("check", "many.toml", cwd=tmp_path)
    assert checked.returncode == 0 and "  l299  l298    revolute  1          60  0  0\n" in checked.stdout


def last_row(file):
    return [float(x) for x in list(csv.reader(file.open()))[-1]]


def test_fast_switching_inputs_do_not_depend_on_the_step(folder):
    wave = "20*sign(sin(2*pi*1000*t))"
    exact = ["--stop", 0.1, "--start", "solver.rtol=1e-11", "solver.atol=1e-13", "--output", "*.q"]
    model = ROOT / "models" / "kuka_kr5.toml"
    done = run(
        "simulate", model, *exact, "--step", 0.05, "--input", f"joint1.tau={wave}", f"joint2.tau={wave}", "--csv", "a.csv", cwd=folder
    )
    assert done.returncode == 0 and "approximated exactly by cubic polynomials over 200 intervals" in done.stderr
    # the same torques, held over the half waves themselves
    held = wave.replace("*t", "*(t + 1e-6)")
    run(
        "simulate",
        model,
        *exact,
        "--step",
        0.0005,
        "--interpolate",
        "none",
        "--input",
        f"joint1.tau={held}",
        f"joint2.tau={held}",
        "--csv",
        "b.csv",
        cwd=folder,
    )
    assert last_row(folder / "a.csv") == pytest.approx(last_row(folder / "b.csv"), abs=1e-11)


def test_a_motion_given_by_its_position_takes_the_torques_of_the_whole_motion(folder):
    model = ROOT / "models" / "kuka_kr5.toml"
    run("build", "--inverse", model, "-o", "arm.fmu", cwd=folder)
    simulate = ["simulate", "arm.fmu", "--stop", 0.3, "--step", 0.1, "--output", "*.tau"]
    run(*simulate, "--input", "joint2.q=0.3*sin(4*t)", "--csv", "a.csv", cwd=folder)
    parts = ["joint2.q=0.3*sin(4*t)", "joint2.qd=1.2*cos(4*t)", "joint2.qdd=-4.8*sin(4*t)"]
    run(*simulate, "--interpolate", "none", "--input", *parts, "--csv", "b.csv", cwd=folder)
    assert last_row(folder / "a.csv") == pytest.approx(last_row(folder / "b.csv"), rel=1e-10, abs=1e-10)


DRIVEN = """
name = "driven"
[[link]]
name = "drive"
drive = "motion"
mass = 1
com = [0.3, 0, 0]
alpha = 1.5707963267948966
[[link]]
name = "rod"
a = 0.5
mass = 1
com = [0.4, 0, 0]
[solver]
rtol = 1e-10
"""


def test_a_held_motion_given_by_its_position_is_of_second_order(folder):
    (folder / "m.toml").write_text(DRIVEN)
    motion = ["--stop", 1, "--output", "rod.q", "drive.tau", "--csv", "a.csv", "--input", "drive.q=0.5*sin(3*t)"]

    def end(step, version, *options):
        run("build", "m.toml", "--fmi", version, "-o", "m.fmu", cwd=folder)
        assert run("simulate", "m.fmu", "--step", step, *motion, *options, cwd=folder).returncode == 0
        return np.array(last_row(folder / "a.csv"))

    exact, held = end(0.05, "2"), [end(step, "3") for step in (0.05, 0.025)]
    assert held[0] == pytest.approx(end(0.05, "2", "--interpolate", "none"), rel=1e-12)
    assert held[0] == pytest.approx(exact, abs=0.01)
    assert (held[0] - exact)[1:] / (held[1] - exact)[1:] == pytest.approx([4, 4], rel=0.1)


@pytest.mark.parametrize("version", ["2", "3"])
def test_inputs_of_a_motion_that_were_never_set_are_named_once(folder, version):
    (folder / "m.toml").write_text(DRIVEN)
    run("build", "m.toml", "--fmi", version, "-o", "m.fmu", cwd=folder)
    said = run("simulate", "m.fmu", "--stop", 0.1, "--json", "--input", "drive.qd=t", cwd=folder)
    named = [text for text in json.loads(said.stdout)["warnings"] if "never set" in text]
    assert len(named) == 1 and named[0].startswith("inputs of prescribed motions that were never set: drive.q;")
    assert said.stderr.count("never set") == 1


@pytest.mark.parametrize(
    "inputs",
    [[], ["drive.qd=-1"], ["drive.qd=cos(9*t)"], ["drive.qdd=2"], ["drive.q=0.5*sin(3*t)"], ["motion.csv"], ["drive.q=0.2"],
     ["drive.qd=cos(9*t)", "--interpolate", "none"]],
    ids=" ".join,
)  # fmt: skip
def test_the_position_of_a_motion_is_that_of_its_link_in_every_row(folder, inputs):
    """Also of a position that was never set, and of one that is set to the same value again, which has no effect."""
    text = DRIVEN.replace('drive = "motion"', 'drive = "motion"\nq = 0.2\nqd = 1.5')
    (folder / "m.toml").write_text(text + "[[frame]]\nname = 'f'\nlink = 'drive'\nposition = [1, 0, 0]\noutputs = ['pose']\n")
    (folder / "motion.csv").write_text("time,drive.q,drive.qd\n0,0.1,2\n0.25,0.1,2\n0.5,0.4,2\n1,0.3,1\n")
    given = ["--input", *inputs] if inputs else []
    outputs = ["--output", "drive.q", "f.position[1]", "f.position[3]"]
    done = run("simulate", "m.toml", "--stop", 1, "--step", 0.1, "--csv", "a.csv", *outputs, *given, cwd=folder)
    assert done.returncode == 0, done.stderr
    q, x, z = np.loadtxt(folder / "a.csv", delimiter=",", skiprows=1)[:, 1:].T
    assert np.unwrap(np.arctan2(z, x)) == pytest.approx(q, abs=1e-12)


BASE = "name = 'm'\n[[link]]\nname = 'base'\njoint = 'free'\nTHE_MASS[[link]]\nname = 'arm'\nalpha = 0.7\nmass = 1\ncom = [0.1, 0.2, 0.3]\ninertia = [1, 1.1, 1.2]\n"


def test_a_motion_of_one_joint_does_not_shift_the_rows_of_another(tmp_path):
    """A held force that jumps at a communication point: the row shows the acceleration before the jump."""
    slides = "".join(
        f'[[link]]\nname = "{name}"\nparent = "ground"\njoint = "prismatic"\nmass = 1\n{drive}\n'
        for name, drive in (("a", ""), ("b", 'drive = "motion"'))
    )
    (tmp_path / "m.toml").write_text(f'name = "m"\ngravity = [0, 0, 0]\n{slides}[fmu]\noutputs = ["acceleration"]\n')
    (tmp_path / "force.csv").write_text("time,a.tau\n0,1\n0.1,2\n0.2,4\n0.3,8\n")
    for motion in ([], ["b.qd=0.1"]):
        done = run("simulate", "m.toml", "--stop", 0.3, "--step", 0.1, "--csv", "a.csv", "--input", "force.csv", *motion, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        with (tmp_path / "a.csv").open() as file:
            rows = list(csv.DictReader(file))
        assert [float(row["a.qdd"]) for row in rows] == pytest.approx([1, 1, 2, 4])


@pytest.mark.parametrize("version", ["2", "3"])
def test_a_start_with_a_deep_contact_is_warned(folder, version):
    assert run("build", "--fmi", version, ROOT / "models" / "bouncing_ball.toml", cwd=folder).returncode == 0
    for height, warned in (("0.5", False), ("-0.5", True)):
        said = run("simulate", "bouncing_ball.fmu", "--stop", "0.01", "--start", f"ball.q0={height}", cwd=folder)
        assert said.returncode == 0
        assert (" m deep, with a force of " in said.stderr) is warned


def test_check_and_simulate_warn_of_a_deep_contact_once_with_its_place(folder):
    text = (ROOT / "models" / "bouncing_ball.toml").read_text().replace("q = 1.0335", "q = -0.5")
    (folder / "deep.toml").write_text(text)
    line = text[: text.index("[[contact]]")].count("\n") + 1
    for verb in (("check",), ("simulate", "--stop", "0.01")):
        said = run(*verb, "deep.toml", cwd=folder).stderr
        assert said.count(" m deep, with a force of ") == 1 and f"deep.toml:{line}:1: warning: contact 'floor' starts 0.5335 m deep" in said


def test_check_refuses_what_moves_nothing_with_its_place(tmp_path):
    (tmp_path / "m.toml").write_text(BASE.replace("THE_MASS", ""))
    refused = run("check", "m.toml", cwd=tmp_path)
    assert refused.returncode == 1 and refused.stderr.startswith("m.toml:2:1: joint 'base'"), refused.stderr
    assert "the mass matrix is singular" in refused.stderr and refused.stderr.count("\n") == 1


def test_check_warns_of_an_angle_in_the_wrong_unit(tmp_path):
    (tmp_path / "m.toml").write_text("name = 'm'\n[[link]]\nname = 'arm'\nalpha = 90\nmass = 1\ncom = [0.1, 0, 0]\n")
    checked = run("check", "m.toml", cwd=tmp_path)
    assert checked.returncode == 0
    assert (
        "m.toml:4:9: warning: link 'arm': alpha = 90 rad is more than a full turn; for degrees set angle_unit = \"deg\"" in checked.stderr
    )


def test_a_mass_that_is_tuned_away_is_refused_with_the_joint(tmp_path):
    from tests.fmi.raw import ERROR, OK, Slave, Unpacked

    mass = "mass = 1\ncom = [0.3, 0.2, 0.1]\n"
    (tmp_path / "m.toml").write_text(BASE.replace("THE_MASS", mass) + "[fmu]\ntunable = ['base.mass']\n")
    built = run("build", "--no-show", "m.toml", cwd=tmp_path)
    assert built.returncode == 0, built.stderr
    fmu = Unpacked(tmp_path / "m.fmu", tmp_path / "fmu")
    for during in (False, True):
        with Slave(fmu) as slave:
            assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
            if during:
                assert slave.call("ExitInitializationMode") == OK, slave.errors
            assert slave.set("base.mass", 0.0) == OK
            assert (slave.step(0.0, 0.01) if during else slave.call("ExitInitializationMode")) == ERROR
            assert "joint 'base': the mass matrix is singular" in slave.errors[0]
