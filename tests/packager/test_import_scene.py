"""Scenes in JSON become model files whose FMU reproduces the stored references."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from build_fmu.cli import main
from build_fmu.errors import UserError
from build_fmu.importers import scene_json
from build_fmu.importers.toml_writer import model_text

SCENES = Path(__file__).resolve().parents[1] / "scenes"


needs_library = pytest.mark.usefixtures("built_library")


@pytest.fixture
def scene():
    return json.loads((SCENES / "fourbar_forced.json").read_text(encoding="utf-8"))


def imported(tmp_path, scene):
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(scene), encoding="utf-8")
    return scene_json.read(path)


@needs_library
@pytest.mark.parametrize("path", sorted(SCENES.glob("*.json")), ids=lambda path: path.stem)
def test_every_scene_is_a_sound_model(path, tmp_path, capsys):
    assert main(["import", str(path), "-o", str(tmp_path)]) == 0
    said = capsys.readouterr()
    assert " kg" in said.out and "error" not in said.err
    assert main(["check", str(next(tmp_path.glob("*.toml")))]) == 0


@needs_library
@pytest.mark.parametrize("name", ["double_pendulum", "fourbar_forced", "kr5_freefall", "stiff_strut"])
def test_the_fmu_reproduces_the_reference(name, tmp_path):
    model, out = tmp_path / f"{name}.toml", tmp_path / "out.csv"
    assert main(["import", str(SCENES / f"{name}.json"), "-o", str(model)]) == 0
    inputs = ["--input", "crank.tau=2"] if name == "fourbar_forced" else []
    start = ["--start", "solver.rtol=1e-11", "solver.atol=1e-13"]
    assert main(["simulate", str(model), "--stop", "0.5", *inputs, *start, "--output", "*.q,*.qd", "--csv", str(out)]) == 0
    run = np.genfromtxt(out, delimiter=",", skip_header=1)
    reference = np.genfromtxt(SCENES / f"{name}.csv", delimiter=",", skip_header=1)[: len(run)]
    assert np.allclose(run[:, 0], reference[:, 0], atol=1e-12)
    joints = (run.shape[1] - 1) // 2
    assert np.abs(run[:, 1:] - reference[:, 1 : 1 + 2 * joints]).max() < 1e-7


def test_numbers_read_back_exactly(tmp_path, scene):
    text = model_text(imported(tmp_path, scene))
    assert "q = 2.278380763520252\n" in text and "inertia = [4.1666666666666665e-05, 0.00704166666666667, 0.00704166666666667]" in text
    assert "crank.tau=2" in text and "stop_time = 1\n" in text


def test_sine_and_square_inputs_become_expressions(tmp_path, scene):
    from build_fmu.run.expressions import compile_expression

    scene["inputs"] = [
        {"joint": 0, "type": "sine", "amplitude": 3, "frequency": 0.5, "phase": 0.25},
        {"joint": 1, "type": "bangbang", "amplitude": -2, "frequency": 4},
    ]
    sine, square = (part.partition("=")[2] for part in imported(tmp_path, scene).inputs)
    assert compile_expression(sine)(0.3) == pytest.approx(3 * np.sin(np.pi * 0.3 + 0.25))
    assert [compile_expression(square)(t) for t in (0.0, 0.1, 0.13, 0.26)] == [-2, -2, 2, -2]


def pasted(model, folder):
    """Runs the command on top of a model file by a shell in the file's folder and returns its record."""
    (line,) = (line for line in model.read_text().splitlines() if line.startswith("# build-fmu "))
    (folder / "build-fmu").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m build_fmu "$@"\n')
    (folder / "build-fmu").chmod(0o755)
    environment = {**os.environ, "PYTHONPATH": str(SCENES.parents[1]), "PATH": f"{folder}:{os.environ['PATH']}"}
    subprocess.run(
        ["sh", "-c", f"{line[2:]} --output '*.q' --csv pasted.csv"], cwd=model.parent, env=environment, check=True, capture_output=True
    )
    return np.genfromtxt(model.parent / "pasted.csv", delimiter=",", skip_header=1)


@needs_library
def test_the_command_on_top_reproduces_the_scene(tmp_path):
    model = tmp_path / "it's a bar.toml"
    assert main(["import", str(SCENES / "fourbar_forced.json"), "-o", str(model)]) == 0
    reference = np.genfromtxt(SCENES / "fourbar_forced.csv", delimiter=",", skip_header=1)
    assert np.abs(pasted(model, tmp_path) - reference[:, :4]).max() < 1e-8


@needs_library
def test_the_command_on_top_follows_inputs_faster_than_the_output(tmp_path):
    body = {"mass": 2.0, "joint": {"type": "prismatic", "mdh": {}}}
    scene = {
        "format": "mbs-scene/1",
        "gravity": [0, 0, 0],
        "time": {"t_end": 1, "dt_out": 0.25},
        "bodies": [{"name": "a", "parent": -1, **body}, {"name": "b", "parent": -1, **body}],
        "inputs": [
            {"joint": 0, "type": "sine", "amplitude": 6.0, "frequency": 9.3, "phase": 0.4},
            {"joint": 1, "type": "bangbang", "amplitude": 5.0, "frequency": 40.5},
        ],
    }
    (tmp_path / "fast.json").write_text(json.dumps(scene))
    assert main(["import", str(tmp_path / "fast.json"), "-o", str(tmp_path)]) == 0
    run = pasted(tmp_path / "fast.toml", tmp_path)
    t, omega = run[:, 0], 2 * np.pi * 9.3
    sine = 3 / omega**2 * (np.sin(0.4) + omega * t * np.cos(0.4) - np.sin(omega * t + 0.4))
    half = 0.5 / 40.5
    # of each wave the speed is a triangle, so the mean speed of whole waves is half its height
    waves, rest = np.divmod(t, 2 * half)
    down = np.maximum(rest - half, 0)
    square = 2.5 * (waves * half**2 + rest**2 / 2 - down**2)
    assert np.abs(run[:, 1] - sine).max() < 1e-9 and np.abs(run[:, 2] - square).max() < 1e-9


def test_other_parts(tmp_path, scene):
    scene["bodies"][0]["joint"] |= {"armature": 0.1, "stiffness": 2, "damping": 0.3, "rest": -0.5}
    scene["loops"].append(
        {
            "type": "revolute",
            "body_a": -1,
            "body_b": 2,
            "point_a": [1, 0, 0],
            "point_b": [0, 0, 0],
            "perp1_a": [1, 0, 0],
            "perp2_a": [0, 1, 0],
            "axis_b": [0, 0, 1],
        }
    )
    scene["forces"] = [
        {"type": "spring_damper", "body_a": -1, "body_b": 1, "point_a": [0, 1, 0], "point_b": [0, 0, 0], "k": 5, "c": 1, "rest_length": 0.2}
    ]
    text = model_text(imported(tmp_path, scene))
    for line in (
        "armature = 0.1",
        "rest = -0.5",
        'type = "revolute"',
        "axis_a = [0, 0, 1]",
        'link_a = "ground"',
        "stiffness = 5",
        "rest_length = 0.2",
    ):
        assert line in text


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda s: s.update(format="mbs-scene/2"), "'format' must be"),
        (lambda s: s.pop("gravity"), "'gravity' is missing"),
        (lambda s: s.update(bodies=[]), "'bodies' is missing or empty"),
        (lambda s: s["bodies"][1].update(parent=7), "'bodies[1].parent': must be an integer from -1 to 0, got 7"),
        (lambda s: s["bodies"][1].update(mass="5"), "'bodies[1].mass': must be a number, got a string"),
        (lambda s: s["bodies"][1].update(mas=5), "'bodies[1].mas': unknown field; did you mean 'mass'?"),
        (lambda s: s["bodies"][0]["joint"].update(type="ball"), "'bodies[0].joint.type': must be one of revolute, prismatic, got 'ball'"),
        (lambda s: s["bodies"][0]["joint"]["mdh"].update(a=0.1), "'bodies[0].joint.placement': differs from 'mdh' by 0.1"),
        (lambda s: s["bodies"][0].update(com=[0, float("nan"), 0]), "'bodies[0].com[1]': must be a finite number"),
        (lambda s: s["initial"].update(q=[0]), "'initial.q': must be 3 numbers"),
        (lambda s: s["time"].update(dt_out=0), "'time.dt_out': must be a positive time"),
        (lambda s: s["loops"][0].update(directions=[[1, 0]]), "must be 3 numbers, got [1, 0]"),
        (lambda s: s["inputs"][0].update(type="noise"), "'inputs[0].type': must be one of"),
    ],
)
def test_mistakes(tmp_path, scene, change, sentence):
    change(scene)
    with pytest.raises(UserError) as error:
        imported(tmp_path, scene)
    assert sentence in str(error.value) and "scene.json" in str(error.value) and "\n" not in str(error.value)


def test_files_that_are_no_scene(tmp_path, capsys):
    for name, text, sentence in (
        ("a.json", "{", "a.json:1:2: invalid JSON"),
        ("b.json", "[]", "must be an object"),
        ("c.xyz", "", "unsupported file type"),
        ("d.toml", "", "is already a model file"),
    ):
        (tmp_path / name).write_text(text)
        assert main(["import", str(tmp_path / name), "-o", str(tmp_path / "x.toml")]) == 1
        assert sentence in capsys.readouterr().err
    assert not (tmp_path / "x.toml").exists()
    assert main(["import", "missing.json"]) == 1 and "does not exist" in capsys.readouterr().err


@needs_library
def test_an_existing_model_is_not_lost(tmp_path, capsys):
    target = tmp_path / "mine.toml"
    target.write_text("precious")
    source = str(SCENES / "simple_pendulum.json")
    assert main(["import", source, "-o", str(target)]) == 1
    assert "already exists" in capsys.readouterr().err and target.read_text() == "precious"
    assert main(["import", source, "-o", str(target), "--force", "--name", "swing"]) == 0
    assert 'name = "swing"' in target.read_text()
