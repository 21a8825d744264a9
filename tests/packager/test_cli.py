"""The command line as a user sees it: exit codes, sentences, files, and never a traceback."""

import importlib
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import build_fmu
from build_fmu import native
from build_fmu.cli import main

ROOT = Path(__file__).parents[2]


def run(*arguments, cwd):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    # the stand-in for the library cannot run, so there is nothing to play
    unplayed = ["--no-show"] if arguments[:1] == ("build",) else []
    command = [sys.executable, "-m", "build_fmu", *map(str, arguments), *unplayed]
    return subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False)


def test_build_writes_here_under_the_model_files_name(compiled, model, tmp_path):
    # the file is called other than the model in it, which names the library
    done = run("build", model.rename(model.with_name("harbour crane.toml")), cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert "harbour crane.fmu" in done.stdout and "3 inputs" in done.stdout
    with zipfile.ZipFile(tmp_path / "harbour crane.fmu") as archive:
        assert "binaries/linux64/crane.so" in archive.namelist()


def test_build_into_an_existing_folder(compiled, model, tmp_path, capsys):
    (tmp_path / "new").mkdir()
    assert main(["build", str(model), "-o", str(tmp_path / "new" / "x.fmu")]) == 0
    assert main(["build", str(model), "-o", str(tmp_path / "new")]) == 0
    assert sorted(p.name for p in (tmp_path / "new").iterdir()) == ["crane.fmu", "x.fmu"]


def test_reader_errors_come_as_they_are(compiled, model, tmp_path):
    model.write_text("# error: link 'elbow': mass must be >= 0, got -1\n# error: unknown key 'mas'; did you mean 'mass'?\n")
    for command in ("build", "check", "simulate"):
        done = run(command, model, cwd=tmp_path)
        assert done.returncode == 1 and done.stdout == ""
        assert done.stderr.splitlines() == [
            f"{model}:1:1: link 'elbow': mass must be >= 0, got -1",
            f"{model}:1:1: unknown key 'mas'; did you mean 'mass'?",
        ]
    assert not (tmp_path / "crane.fmu").exists()


def test_warnings_are_passed_on(compiled, model, tmp_path):
    model.write_text("# warning: warning: link 'a': the inertia breaks the triangle inequality\n")
    for command in ("build", "check"):
        done = run(command, model, cwd=tmp_path)
        assert done.returncode == 0 and done.stderr == f"{model}:1:1: warning: link 'a': the inertia breaks the triangle inequality\n"


def test_check_summary(compiled, model, tmp_path):
    done = run("check", model, cwd=tmp_path)
    assert done.returncode == 0
    for text in ("tower", "prismatic", "3 moving, 1 fixed", "slew.tau", "erk, rtol 1e-08", "49.5 kg"):
        assert text in done.stdout
    assert list(tmp_path.glob("*.fmu")) == []


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["build", "missing.toml"], "model file 'missing.toml' does not exist"),
        (["check", "."], "'.' is a folder"),
        (["simulate", "missing.fmu"], "FMU 'missing.fmu' does not exist"),
        (["simulate", "--input", "a=1", "missing.fmu"], "FMU 'missing.fmu' does not exist"),
        (["simulate", "broken.fmu"], "is not a readable FMU"),
    ],
)
def test_sentences(compiled, tmp_path, arguments, sentence):
    (tmp_path / "broken.fmu").write_bytes(b"PK nonsense")
    done = run(*arguments, cwd=tmp_path)
    assert done.returncode == 1
    assert sentence in done.stderr and "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["simulate"], "requires an FMU or a model file"),
        (["simulate", "{fmu}", "--csv", "out.txt"], "'out.txt' must end in .csv"),
        (["simulate", "{fmu}", "--plot", "out.doc"], "'out.doc' must end in .png or .svg or .pdf"),
        (["simulate", "{fmu}", "--input", "pivot.tau"], "'pivot.tau' is not an input: write NAME=EXPRESSION"),
        (["simulate", "{fmu}", "--input", "pivot.tau=2*"], "cannot read the expression '2*'"),
        (["simulate", "{fmu}", "--start", "pivot.q0=1", "pivot.q0=2"], "duplicate start value of 'pivot.q0'"),
        (["simulate", "{fmu}", "--start", "pivot.q0=cot(1)"], "start value of 'pivot.q0': 'cot(1)': unknown function 'cot'"),
        (["simulate", "{fmu}", "--start", "pivot.q0=1+t"], "start value of 'pivot.q0': '1+t' depends on t, but must be constant"),
        (["modes", "{model}", "--start", "pivot.q0=t"], "parameter 'pivot.q0': 't' depends on t, but must be constant"),
        (["equilibrium", "{model}", "--input", "pivot.tau=t"], "input 'pivot.tau': 't' depends on t, but must be constant"),
        (["linearise", "{model}", "--input", "i.csv"], "'i.csv' is not a constant input: write NAME=VALUE"),
        (["simulate", "{fmu}", "--csv", "-", "--json"], "both write to stdout"),
        (["show"], "show requires an FMU, a model file or a CSV with results"),
        (["show", "{fmu}", "{fmu}"], "too many targets: give one FMU or model file"),
        (["show", "run.csv", "--stop", "1"], "--stop applies to a simulation"),
        (["show", "{fmu}", "-o", "page.pdf"], "'page.pdf' must end in .html or .htm"),
        (["show", "{fmu}", "--still", "x.doc"], "'x.doc' must end in .png"),
        (["show", "{fmu}", "--gif", "x.mp4"], "'x.mp4' must end in .gif"),
        (["show", "{fmu}", "--mp4", "x.gif"], "'x.gif' must end in .mp4"),
        (["show", "{fmu}", "--at", "1"], "--at is the time of a picture"),
        (["show", "{fmu}", "--still", "x.png", "--speed", "2"], "--speed applies to a film: add --gif FILM.gif or --mp4 FILM.mp4"),
        (["show", "{fmu}", "--rate", "5"], "--rate applies to a film"),
        (["show", "{model}", "--live", "--gif", "x.gif"], "--gif applies to a recorded run: remove --live"),
        (["show", "{model}", "--live", "--still", "x.png"], "--still applies to a recorded run: remove --live"),
        (["build", "{model}", "-o", "pendulum.zip"], "'pendulum.zip' must end in .fmu"),
        (["build", "{model}", "--arrays"], "add --fmi 3"),
        (["import", "arm.csv", "--dh", "modified", "-o", "x.urdf"], "'x.urdf' must end in .toml"),
        (["import", "arm.urdf", "--dh", "standard"], "--dh has no effect on 'arm.urdf'"),
        (["import", "arm.urdf", "--arg", "a=1"], "--arg has no effect on 'arm.urdf': it contains no xacro macros"),
        (["import", "arm.csv", "--no-shapes"], "--no-shapes has no effect on 'arm.csv': it applies to URDF, MJCF and SDF files"),
        (["import", "arm.urdf", "--pose", "j=1", "--pose", "j=2"], "--pose: 'j' is given twice, as 1 and 2"),
        (["identify", "{model}"], "identify requires a measured run, or --design"),
        (["identify", "{model}", "run.csv", "--design"], "--design takes no measured run"),
        (["identify", "{model}", "run.csv", "--range", "*=-1:1"], "--range applies to --design, not to a measured run"),
        (["identify", "{model}", "run.csv", "--duration", "10"], "--duration applies to --design"),
        (["identify", "{model}", "--design", "--cutoff", "3"], "--cutoff applies to a measured run, not to --design"),
        (["linearise", "{model}", "--at", "held", "--input", "pivot.tau=1"], "--at held finds the inputs"),
        (["report", "{fmu}", "-o", "-"], "-o requires the name of a folder"),
        (["report", "{fmu}", "--method", "erk", "rk4"], "unknown method 'rk4'; available: auto, "),
        (["report", "{fmu}", "--input", "pivot.tau"], "'pivot.tau' is not an input"),
        (["stress", "{model}", "--method", "foo"], "unknown method 'foo'; available: auto, "),
    ],
)
def test_wrong_arguments(built_library, tmp_path, monkeypatch, capsys, arguments, sentence):
    """They end a command with code 2 and one sentence, although each of its files is right."""
    monkeypatch.chdir(tmp_path)
    files = {"model": ROOT / "models" / "pendulum.toml", "fmu": tmp_path / "pendulum.fmu"}
    joint = '<joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint>'
    (tmp_path / "arm.urdf").write_text(f'<robot name="arm"><link name="base"/><link name="arm"/>{joint}</robot>')
    (tmp_path / "arm.csv").write_text("name, a [m], mass [kg]\nrod, 0, 1\n")
    if "{fmu}" in arguments:
        assert main(["build", str(files["model"]), "--no-show"]) == 0
    capsys.readouterr()
    assert main([word.format(**files) for word in arguments]) == 2
    text = capsys.readouterr().err
    assert text.startswith(f"build-fmu {arguments[0]}: ") and sentence in text and len(text.splitlines()) == 1


def test_a_library_that_cannot_be_loaded(compiled, model, tmp_path):
    done = run("simulate", model, cwd=tmp_path)
    assert done.returncode == 1 and "'crane' cannot be loaded" in done.stderr and "Traceback" not in done.stderr


def test_a_describe_that_crashes_or_talks_nonsense(compiled, model, tmp_path):
    program = compiled / "describe"
    for script, sentence in (
        ("kill -SEGV $$", "was terminated by signal 11"),
        ("echo hello", "not valid JSON"),
        ("echo '{\"format\": 99}'", "has format 99"),
        ("exit 3", "failed with exit code 3"),
    ):
        program.write_text(f"#!/bin/sh\n{script}\n")
        done = run("build", model, cwd=tmp_path)
        assert done.returncode == 1 and sentence in done.stderr and "Traceback" not in done.stderr


def test_what_to_run_when_nothing_is_built(model, tmp_path, monkeypatch, capsys):
    for variable in ("REDYSIM_FMU_DESCRIBE", "REDYSIM_FMU_LIBRARY"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr(native, "PACKAGE", tmp_path)
    monkeypatch.setattr(native, "BUILT", tmp_path)
    assert main(["build", str(model)]) == 1
    assert "run `make build`" in capsys.readouterr().err
    monkeypatch.setenv("REDYSIM_FMU_DESCRIBE", str(tmp_path / "no"))
    assert main(["build", str(model)]) == 1
    assert "REDYSIM_FMU_DESCRIBE: file" in capsys.readouterr().err


def test_an_empty_library_of_an_interrupted_build_is_refused(compiled, model, tmp_path, monkeypatch, capsys):
    (tmp_path / "empty.so").touch()
    monkeypatch.setenv("REDYSIM_FMU_LIBRARY", str(tmp_path / "empty.so"))
    assert main(["build", str(model), "-o", str(tmp_path / "model.fmu")]) == 1
    assert "empty.so' does not exist or is empty" in capsys.readouterr().err
    assert not (tmp_path / "model.fmu").exists()


def test_platforms(compiled, model, tmp_path, monkeypatch, capsys):
    monkeypatch.delenv("REDYSIM_FMU_LIBRARY_WIN64", raising=False)
    monkeypatch.setattr(native, "SOURCE_TREE", tmp_path)
    monkeypatch.setattr(native, "PACKAGE", tmp_path / "build_fmu")
    target = tmp_path / "crane.fmu"
    assert main(["build", str(model), "-o", str(target), "--platforms", "linux64,win64"]) == 1
    assert "this package does not contain 'libredysim_fmu.dll': build it with `make win64`" in capsys.readouterr().err
    (tmp_path / "CMakeLists.txt").touch()
    assert main(["build", str(model), "-o", str(target), "--platforms", "linux64,win64"]) == 1
    assert "'libredysim_fmu.dll' is not built: run `make win64`" in capsys.readouterr().err and not target.exists()
    assert main(["build", str(model), "-o", str(target), "--platforms", "linux64,win64", "--specialise"]) == 2
    assert "--specialise supports linux64 only" in capsys.readouterr().err
    monkeypatch.setattr(native, "HOST", "win64")
    assert main(["build", str(model), "-o", str(target), "--specialise"]) == 2
    assert "--specialise requires Linux on x86-64" in capsys.readouterr().err
    monkeypatch.undo()
    with pytest.raises(SystemExit):
        main(["build", str(model), "--platforms", "win32"])
    assert "unknown platform 'win32'; available: linux64, win64" in capsys.readouterr().err


def test_usage_errors_and_help(capsys):
    for arguments, code in ((["--help"], 0), (["--version"], 0), ([], 2), (["bild"], 2), (["simulate", "a.fmu", "--stop", "x"], 2)):
        with pytest.raises(SystemExit) as end:
            main(arguments)
        assert end.value.code == code


@pytest.mark.parametrize(("name", "sentence"), [("arm.urdf", "convert it with `build-fmu import`"), ("arm.fmu", "it is already an FMU")])
def test_files_of_other_kinds_are_told_apart(tmp_path, capsys, name, sentence):
    (tmp_path / name).write_text("x")
    for command in ("build", "check"):
        assert main([command, str(tmp_path / name)]) == 1
        said = capsys.readouterr().err
        assert sentence in said and len(said.splitlines()) == 1


@pytest.mark.parametrize("arguments", [["simulate", "--redysim-layout"], ["report", "-o"], ["stress", "-o"]])
def test_output_of_several_files_needs_a_folder(tmp_path, capsys, arguments):
    command, option = arguments
    (tmp_path / "file").write_text("x")
    assert main([command, str(ROOT / "models" / "pendulum.toml"), option, str(tmp_path / "file")]) == 1
    assert f"file' is a file: {option} requires the name of a folder" in capsys.readouterr().err
    assert (tmp_path / "file").read_text() == "x"


@pytest.mark.parametrize(
    ("arguments", "name"),
    [(["import", ""], "FILE"), (["import", "a.urdf", "-o", ""], "-o/--output"), (["simulate", "a.toml", "--output", ""], "--output")],
)
def test_empty_names_are_refused(capsys, arguments, name):
    with pytest.raises(SystemExit) as end:
        main(arguments)
    assert end.value.code == 2
    assert capsys.readouterr().err.startswith(f"build-fmu {arguments[0]}: {name}: the value must not be empty; ")


@pytest.mark.parametrize(
    ("name", "content", "words", "sentence"),
    [
        ("arm.csv", "joint,alpha,a,theta,d\n", "simulate rod.toml --csv arm.csv", "does not contain simulation results"),
        ("wind.csv", "time,pivot.tau\n0,0\n1,1\n", "simulate rod.toml --csv wind.csv --input wind.csv", "is an input of this run"),
        (
            "wind.csv",
            "time,pivot.tau\n0,0\n1,1\n",
            "simulate rod.toml --csv wind.csv --input pivot.tau=wind.csv",
            "is an input of this run",
        ),
        ("rod_report.csv", "time,pivot.q\n0,0\n1,1\n", "report rod.toml --reference rod_report.csv", "is an input of this run"),
    ],
)
def test_a_record_takes_the_place_of_records_alone(compiled, tmp_path, name, content, words, sentence):
    (tmp_path / "rod.toml").write_text((ROOT / "models" / "pendulum.toml").read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / name).write_text(content)
    done = run(*words.split(), "--stop", "0.01", cwd=tmp_path)
    assert done.returncode == 1
    assert sentence in done.stderr
    assert (tmp_path / name).read_text() == content


def test_the_names_for_scripts():
    assert all(callable(getattr(build_fmu, name)) for name in build_fmu.__all__)
    assert build_fmu.build is importlib.import_module("build_fmu.fmu.build").build
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = build_fmu.nothing
