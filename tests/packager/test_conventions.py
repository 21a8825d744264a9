"""Conventions of a command line: one-line errors, --json, --quiet, standard streams, folders, separators of tables."""

import io
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.errors import UserError, did_you_mean
from build_fmu.run.signals import read_table
from tests.command_line import command

ROOT = Path(__file__).parents[2]
PENDULUM = ROOT / "models" / "pendulum.toml"
ARM = "type,alpha [deg],a,theta [deg],d,mass,Ixx,Iyy,Izz\nR,0,0,q1,0.4,1,1,1,1\nR,90,0.3,q2,0,1,1,1,1\n"


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def piped(*arguments, data: bytes, cwd: Path) -> subprocess.CompletedProcess:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    words = [sys.executable, "-m", "build_fmu", *map(str, arguments)]
    return subprocess.run(words, input=data, capture_output=True, cwd=cwd, env=environment, check=False)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["simulate", "x.fmu", "--stop", "abc"], "build-fmu simulate: --stop: 'abc' is not a number"),
        (["simulate", "x.fmu", "--stop", "inf"], "--stop: must be finite, got inf"),
        (["simulate", "x.fmu", "--step", "0"], "--step: must be a positive number, got 0"),
        (["simulate", "x.fmu", "--tolerance", "5"], "--tolerance: tolerances must be between 0 and 1, got 5"),
        (["simulate", "x.fmu", "--interpolate", "expression"], "unknown value 'expression'; did you mean 'expressions'?"),
        (["simulate", "x.fmu", "--outputs", "a"], "unknown option '--outputs'; did you mean '--output'?"),
        (["check", "x.toml", "y.toml"], "unexpected argument 'y.toml'"),
        (["build", "x.toml", "--fmi", "4"], "--fmi: unknown value '4'; available: 2, 3"),
        (["build"], "the following arguments are required: MODEL"),
        (["bild"], "COMMAND: unknown value 'bild'; did you mean 'build'?"),
        (["report", "x.fmu", "--rtol", "0"], "tolerances must be between 0 and 1, got 0"),
        (["stress", "x.toml", "--jobs", "0"], "--jobs: must be a positive number, got 0"),
        (["stress", "x.toml", "--jobs", "1.5"], "--jobs: must be a whole number, got 1.5"),
        (["import", "x.urdf", "--stops", "soft"], "--stops: 'soft' is not a number"),
        (["show", "x.fmu", "--gif", "a.gif", "--rate", "nan"], "--rate: must be finite, got nan"),
        (["show", "x.fmu", "--speed", "0"], "--speed: must be a positive number, got 0"),
    ],
)
def test_a_wrong_argument_is_one_line(capsys, arguments, sentence):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    said = capsys.readouterr()
    assert end.value.code == 2 and said.out == ""
    assert sentence in said.err and len(said.err.splitlines()) == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ["build", PENDULUM, "-o", "no/x.fmu"],
        ["build", PENDULUM, "-o", "no/such"],
        ["simulate", PENDULUM, "--csv", "no/x.csv"],
        ["simulate", PENDULUM, "--plot", "no/x.png"],
        ["show", PENDULUM, "-o", "no/x.html"],
        ["show", PENDULUM, "--gif", "no/x.gif"],
        ["import", "arm.csv", "--dh", "modified", "-o", "no/x.toml"],
    ],
)
def test_no_folder_is_created(built_library, here, arguments):
    (here / "arm.csv").write_text(ARM)
    done = command(*arguments)
    assert done.returncode in (1, 2) and len(done.stderr.splitlines()) == 1
    assert "the folder 'no' does not exist" in done.stderr or "must end in .fmu; to write into a folder, create it first" in done.stderr
    assert [path.name for path in here.iterdir()] == ["arm.csv"]


def test_import_and_check_count_the_same_joints(built_library, here):
    done = command("import", ROOT / "examples" / "dog.urdf", "--floating", "--name", "dog")
    assert "9 links, 9 moving joints" in done.stdout
    assert "9 moving, 0 fixed" in command("check", "dog.toml").stdout


def test_json_holds_what_a_command_reports(built_library, here):
    (here / "arm.csv").write_text(ARM)
    done = command("import", "arm.csv", "--dh", "modified", "--json")
    facts = json.loads(done.stdout)
    assert (facts["model"], facts["links"], facts["moving_joints"], facts["mass"]) == ("arm.toml", 2, 2, 2.0)
    assert [f"check: {line}" for line in facts["check"]] + [f"omitted: {line}" for line in facts["omitted"]] == done.stderr.splitlines()
    facts = json.loads(command("check", "arm.toml", "--json").stdout)
    assert [(link["name"], link["parent"]) for link in facts["links"]] == [("link1", "ground"), ("link2", "link1")]
    assert facts["inputs"] == ["link1.tau", "link2.tau"] and facts["total_mass"] == 2.0
    facts = json.loads(command("build", "arm.toml", "--no-show", "--json").stdout)
    assert (
        facts["fmu"] == "arm.fmu" and facts["bytes"] == (here / "arm.fmu").stat().st_size and facts["inputs"] == ["link1.tau", "link2.tau"]
    )
    facts = json.loads(command("simulate", "arm.fmu", "--stop", "0.5", "--start", "link1.q0=pi/2", "--json").stdout)
    assert facts["time"] == [0.0, 0.5]
    assert facts["outputs"]["link1.q"] | {"max": 0, "min": 0, "end": 0} == {"start": np.pi / 2, "end": 0, "min": 0, "max": 0, "unit": "rad"}


def test_json_of_an_error(here):
    done = command("check", "missing.toml", "--json")
    assert done.returncode == 1 and json.loads(done.stdout) == {"errors": [done.stderr.strip()]}
    assert "model file 'missing.toml' does not exist" in done.stderr


def test_json_of_sweeps(built_library, here):
    done = command("report", PENDULUM, "--method", "erk", "adams", "--rtol", "1e-6", "--step", "0.1", "--stop", "0.2", "--json")
    if "fmu_driver" in done.stderr:
        pytest.skip(done.stderr)
    (report,) = json.loads(done.stdout)["reports"]
    assert {run["method"] for run in report["runs"]} == {"erk", "adams"} and Path(report["files"][2]).is_file()
    done = command("stress", PENDULUM, "--only", "singular", "--seconds", "0.3", "--json")
    facts = json.loads(done.stdout)
    assert sum(facts["counts"].values()) == len(facts["cases"]) > 0


def test_quiet_prints_errors_only(built_library, here):
    (here / "arm.csv").write_text("type,alpha [deg],a,theta [deg],d\nR,0,0,q1,0.4\n")
    done = command("simulate", PENDULUM, "--stop", "0.1", "--quiet", "--csv", "x.csv")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "") and (here / "x.csv").is_file()
    done = command("import", "arm.csv", "--dh", "modified", "-q")
    assert done.returncode == 1 and "no link has mass" in done.stderr and "omitted:" not in done.stderr


def test_results_go_to_stdout_and_messages_to_stderr(built_library, here):
    done = command("simulate", PENDULUM, "--stop", "0.1", "--step", "0.05", "--output", "pivot.q", "--csv", "-")
    assert done.stdout.splitlines()[0] == "time,pivot.q" and len(done.stdout.splitlines()) == 4
    assert done.stderr == "<stdout>  3 rows, 1 outputs\n"
    done = command("show", PENDULUM, "--stop", "0.1", "--input", "pivot.tau=1e200*(t>0.05)", "-o", "-")
    assert done.returncode == 1 and done.stdout.endswith("</html>") and 'id="failure"' in done.stdout
    assert "--json and an output file `-` both" in command("simulate", PENDULUM, "--csv", "-", "--json").stderr
    assert "report writes several files: -o requires the name of a folder" in command("report", PENDULUM, "-o", "-").stderr
    assert list(here.iterdir()) == []


def test_a_model_and_a_table_come_from_stdin(built_library, here):
    model = b'name = "rod"\n[[link]]\nname = "rod"\nmass = 1\ncom = [1, 0, 0]\nalpha = 1.5\n'
    done = piped("check", "-", data=model, cwd=here)
    assert done.returncode == 0 and b"rod (<stdin>)" in done.stdout
    done = piped("check", "-", data=model + b"mas = 2\n", cwd=here)
    assert done.stderr.decode().startswith("<stdin>:7:1: ") and "did you mean 'mass'?" in done.stderr.decode()
    done = piped("build", "-", "-o", "-", "--no-show", data=model, cwd=here)
    assert "modelDescription.xml" in zipfile.ZipFile(io.BytesIO(done.stdout)).namelist()
    assert done.stderr.startswith(b"<stdout>  ")
    done = piped("import", "-", "-o", "-", "--dh", "modified", data=ARM.encode(), cwd=here)
    assert b'name = "link2"' in done.stdout
    done = piped("simulate", PENDULUM, "--input", "-", "--stop", "0.1", "--csv", "-", data=b"t;pivot.tau\n0;1,5\n", cwd=here)
    assert done.returncode == 0, done.stderr
    rows = np.genfromtxt(io.BytesIO(done.stdout), delimiter=",", names=True)
    assert rows["energywork"][-1] > 0
    assert list(here.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full")
@pytest.mark.parametrize("arguments", [["check", PENDULUM], ["check", PENDULUM, "--json"], ["simulate", PENDULUM, "--csv", "-"]])
def test_a_full_disk_behind_stdout_is_one_sentence(built_library, arguments):
    with open("/dev/full", "wb") as full:
        done = subprocess.run([sys.executable, "-m", "build_fmu", *map(str, arguments)], stdout=full, stderr=subprocess.PIPE, check=False)
    assert done.returncode == 1 and done.stderr.decode().splitlines() == ["standard output: No space left on device"]


def test_files_beside_a_model_from_stdin_are_found(built_library, here):
    (here / "hills.csv").write_text("0,0,0\n0,0,0\n0,0,0\n")
    model = (
        b'name = "ball"\n[[link]]\nname = "ball"\njoint = "free"\nmass = 1\ninertia = [1, 1, 1]\n[[contact]]\nname = "floor"\nlink_a = "ball"\n'
        b'shape_a = "sphere"\nradius_a = 0.1\nshape_b = "heightmap"\nfile = "hills.csv"\nspacing = 1\nstiffness = 1e4\n'
    )
    done = piped("check", "-", data=model, cwd=here)
    assert done.returncode == 0, done.stderr.decode()
    below = here / "a" / "b"
    below.mkdir(parents=True)
    (here / "block.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    block = (
        '<robot name="block"><link name="block"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
        '<visual><geometry><mesh filename="FILE"/></geometry></visual></link></robot>'
    )
    done = piped("import", "-", "-o", "-", "--floating", data=block.replace("FILE", "../../block.obj").encode(), cwd=below)
    assert b'file = "../../block.obj"' in done.stdout and done.returncode == 0


@pytest.mark.skipif(os.name == "nt", reason="a POSIX shell")
def test_closed_streams_are_empty(built_library, here):
    program = f"'{sys.executable}' -m build_fmu"
    for arguments, code in (
        (f"check '{PENDULUM}' >&-", 0),
        (f"check '{PENDULUM}' >&- 2>&-", 0),
        ("check - <&-", 1),
        ("check - <&- >&- 2>&-", 1),
    ):
        done = subprocess.run(["sh", "-c", f"{program} {arguments}"], capture_output=True, text=True, check=False, cwd=here)
        assert done.returncode == code and "Traceback" not in done.stderr, done.stderr


@pytest.mark.parametrize(
    "text",
    ["t,tau\n0,1.5\n0.5,-2e-1\n", "time;tau\n0;1,5\n0,5;-2e-1\n", "t\ttau\r\n0\t1,5\r\n0,5\t-0,2\r\n", '"t";"tau"\n0;1.5\n0.5;-0.2\n'],
)
def test_separators_and_decimal_commas(tmp_path, text):
    (tmp_path / "x.csv").write_text(text)
    assert read_table(tmp_path / "x.csv") == {"time": [0.0, 0.5], "tau": [1.5, -0.2]}


def test_suggestions_are_of_the_kind_that_is_meant(built_library, here):
    # the input is more similar to each name than any output or parameter
    for arguments, sentence in (
        (["--output", "pivot.tua"], "unknown output 'pivot.tua'; available: pivot.q, pivot.qd, pivot.qdd, energy.kinetic and 9 more"),
        (["--output", "rod.q"], "unknown output 'rod.q'; did you mean 'pivot.q'?"),
        (["--input", "rod.tau=1"], "unknown input 'rod.tau'; did you mean 'pivot.tau'?"),
    ):
        done = command("simulate", PENDULUM, *arguments)
        assert done.returncode == 1 and done.stderr.strip() == sentence
    done = command("simulate", PENDULUM, "--start", "pivot.tauu=1")
    assert "unknown parameter" in done.stderr and "tau'?" not in done.stderr


def test_no_suggestion_of_another_kind(built_library, here, capsys):
    """Neither a torque for a position, nor an option that shares only its dashes and two letters."""
    assert did_you_mean("pivot.q", ["pivot.tau"]) == "" and did_you_mean("pivot.tua", ["pivot.tau"]) == "; did you mean 'pivot.tau'?"
    for words, sentence in (
        (["show", "x.fmu", "--json"], "unknown option '--json'; `build-fmu"),
        (["build", "x.toml", "--jsn"], "unknown option '--jsn'; did you mean '--json'?"),
    ):
        with pytest.raises(SystemExit):
            main(words)
        assert sentence in capsys.readouterr().err
    for words, sentence in (
        (["--start", "pivot.q=1"], "'pivot.q' is an output, not a parameter; did you mean 'pivot.q0'?"),
        (["--input", "pivot.q=1"], "'pivot.q' is an output, not an input"),
        (["--start", "pivot.q0=x"], "start value of 'pivot.q0': 'x': unknown name 'x'"),
    ):
        assert sentence in command("simulate", PENDULUM, *words).stderr.splitlines()[0]


@pytest.mark.parametrize("ending", [".urdf", ".xml", ".sdf", ".xacro", ".xlsx"])
def test_a_robot_file_in_place_of_a_model_is_sent_to_import(here, capsys, ending):
    (here / f"arm{ending}").touch()
    for verb in ("build", "show"):
        assert main([verb, f"arm{ending}"]) == 1
        assert "convert it with `build-fmu import`" in capsys.readouterr().err


def test_json_of_a_wrong_argument(capsys):
    with pytest.raises(SystemExit) as left:
        main(["build", "arm.toml", "--fmi", "4", "--json"])
    printed = capsys.readouterr()
    assert left.value.code == 2 and json.loads(printed.out)["errors"] == [printed.err.strip()]
    assert "--fmi: unknown value '4'" in printed.err


def test_a_table_without_time_shows_its_columns(tmp_path):
    (tmp_path / "units.csv").write_text("T [s],pivot.tau\n0,1\n")
    with pytest.raises(UserError, match=r"no column 'time' or 't' in the first line; available: T, pivot.tau"):
        read_table(tmp_path / "units.csv")


@pytest.mark.parametrize(("time", "torque"), [("t [s]", "pivot.tau [N m]"), ("time (s)", "pivot.tau [N·m]"), ("t", "pivot.tau (N.m)")])
def test_units_in_the_first_line_of_a_table(tmp_path, time, torque):
    (tmp_path / "units.csv").write_text(f"{time},{torque},ball.tau[1]\n0,1,2\n", encoding="utf-8")
    assert read_table(tmp_path / "units.csv") == {"time": [0], "pivot.tau": [1], "ball.tau[1]": [2]}


@pytest.mark.parametrize("column", ["t [ms]", "pivot.q (deg)"])
def test_other_units_are_refused(tmp_path, column):
    (tmp_path / "units.csv").write_text(f"time,{column}\n0,1\n")
    with pytest.raises(UserError, match=r"values must be in SI units and rad"):
        read_table(tmp_path / "units.csv")


def test_another_owner_of_the_same_variable_must_be_unique():
    assert did_you_mean("rod.q", ["shoulder.q", "shoulder.qd"]) == "; did you mean 'shoulder.q'?"
    assert did_you_mean("rod.q", ["shoulder.q", "finger.q"]) == ""


def test_the_table_of_simulate_has_the_units_of_its_help(built_library, here, capsys):
    with pytest.raises(SystemExit):
        main(["simulate", "--help"])
    assert "angles in deg" in " ".join(capsys.readouterr().out.split())
    done = command("simulate", PENDULUM, "--stop", "0.1", "--start", "pivot.q0=pi/2", "--output", "pivot.q")
    row = next(line.split() for line in done.stdout.splitlines() if "pivot.q" in line)
    assert row[1] == "90" and row[-1] == "deg"
