"""The KR5 and the four-bar in the masters that PyPI and Maven Central offer: the same numbers as in our own loop."""

from __future__ import annotations

import csv
import json
import subprocess

import numpy as np
import pytest

from tests.interop.conftest import CLIENTS, ROOT

JOINTS = {"kuka_kr5": [f"joint{i + 1}" for i in range(6)], "four_bar": ["crank_joint", "joint2", "joint3"]}
STEP, STEPS = 0.01, 100
PREFERENCES = ("--add-opens", "java.prefs/java.util.prefs=ALL-UNNAMED")  # JavaFMI sets file modes through it


@pytest.fixture(params=JOINTS)
def model(request):
    return request.param


@pytest.fixture
def archive(tmp_path_factory):
    """Builds a model's FMU as a file."""

    def build(name: str, *options: str):
        from build_fmu.cli import main

        file = tmp_path_factory.mktemp("fmu") / f"{name}{''.join(options)}.fmu"
        assert main(["build", str(ROOT / "models" / f"{name}.toml"), "-o", str(file), *options]) == 0
        return file

    return build


def outputs_of(model: str) -> list[str]:
    return [f"{joint}.{ending}" for ending in ("q", "qd") for joint in JOINTS[model]]


def agree(rows, reference) -> None:
    told = [k for k, row in enumerate(rows) if row is not None]
    assert len(rows) == len(reference) and len(told) >= len(rows) - 1
    rows, reference = (np.array([table[k] for k in told]) for table in (rows, reference))
    assert rows.shape == reference.shape and np.isfinite(rows).all()
    assert np.ptp(reference, axis=0).max() > 0.1, "a scene that does not move shows nothing"
    difference = np.abs(rows - reference).max()
    print(f"largest difference {difference:.1e}")
    assert difference < 1e-9


@pytest.mark.parametrize(("client", "fmi"), [("ecos", 2), ("ecos", 3), ("cosim", 2), ("container", 2), ("container", 3)])
def test_python_masters(client, fmi, model, archive, ask, expected):
    names = outputs_of(model)
    version, rows = ask(client, {"plant": archive(model, "--fmi", str(fmi))}, [["plant", name] for name in names], STEP, STEPS)
    print(f"{client} {version}")
    agree(rows, expected(model, names, STEP, STEPS))


@pytest.mark.parametrize("program, folder, options", [("Fmi4j", "fmi4j", ()), ("JavaFmi", "javafmi", PREFERENCES)])
def test_java_masters(program, folder, options, model, archive, java, place, expected, tmp_path):
    names, out = outputs_of(model), tmp_path / "rows.csv"
    file = CLIENTS.parent / "java" / f"{program}.java"
    java(folder, "-cp", f"{place / folder}/*", file, archive(model), STEP, STEPS, out, *names, options=options)
    with out.open() as rows:
        agree([[float(row[name]) for name in names] for row in csv.DictReader(rows)], expected(model, names, STEP, STEPS))


@pytest.mark.parametrize("fmi", [2, 3])
def test_fmi_sim(fmi, model, archive, place, expected, tmp_path):
    program, names, out = place / "cargo" / "bin" / "fmi-sim", outputs_of(model), tmp_path / "rows.csv"
    if not program.exists():
        pytest.skip("no fmi-sim in build/interop: cargo or the network is missing")
    subprocess.run(
        [
            program,
            "--model",
            archive(model, "--fmi", str(fmi)),
            "-o",
            out,
            "co-simulation",
            "-f",
            str(STEP * STEPS),
            "--output-interval",
            str(STEP),
        ],
        check=True,
        capture_output=True,
        timeout=60,
    )
    with out.open() as rows:
        agree([[float(row[name]) for name in names] for row in csv.DictReader(rows)], expected(model, names, STEP, STEPS))


@pytest.mark.parametrize("client", ["ecos", "cosim"])
def test_a_controller_of_pythonfmu_closes_the_loop(client, archive, ask, place, expected, tmp_path):
    program = place / "bin" / "pythonfmu"
    subprocess.run([program, "build", "-f", CLIENTS / "crank_controller.py", "-d", tmp_path], check=True, capture_output=True)
    fmus = {"plant": archive("four_bar"), "controller": tmp_path / "CrankController.fmu"}
    wires = [
        [["plant", "crank_joint.q"], ["controller", "q"]],
        [["plant", "crank_joint.qd"], ["controller", "qd"]],
        [["controller", "tau"], ["plant", "crank_joint.tau"]],
    ]
    names = outputs_of("four_bar")
    _, rows = ask(client, fmus, [["plant", name] for name in names], STEP, STEPS, wires)

    def law(get):
        return {"crank_joint.tau": 4.0 * (0.5 - get("crank_joint.q")) - 0.2 * get("crank_joint.qd")}

    reference = expected("four_bar", names, STEP, STEPS, law)
    free = expected("four_bar", names, STEP, STEPS)
    assert np.abs(np.array(reference) - np.array(free)).max() > 0.1, "the controller does nothing"
    agree(rows, reference)


def test_maestro_runs_the_plant_beside_its_inverse(model, archive, java, place, expected, tmp_path):
    """Maestro wants a connection and compares units: what the plant does goes to its inverse."""
    drives = {"kuka_kr5": JOINTS["kuka_kr5"], "four_bar": ["crank_joint"]}[model]
    parts = {"{plant}.p": outputs_of(model), "{inverse}.i": [f"{joint}.tau" for joint in drives]}
    (tmp_path / "system.json").write_text(
        json.dumps(
            {
                "fmus": {"{plant}": archive(model).as_uri(), "{inverse}": archive(model, "--inverse").as_uri()},
                "parameters": {},
                "connections": {
                    f"{{plant}}.p.{joint}.{part}": [f"{{inverse}}.i.{joint}.{part}"] for joint in drives for part in ("q", "qd", "qdd")
                },
                "logVariables": parts,
                "algorithm": {"type": "fixed-step", "size": STEP},
            }
        )
    )
    (tmp_path / "run.json").write_text(
        json.dumps({"startTime": 0, "endTime": STEP * STEPS, "reportProgress": False, "liveLogInterval": 0, "logLevels": {}})
    )
    jars = list((place / "maestro").glob("*.jar"))
    java("maestro", "-jar", *jars, "import", "Sg1", "system.json", "run.json", "-output=out", "-i", cwd=tmp_path)
    with (tmp_path / "out" / "outputs.csv").open() as file:
        told = list(csv.DictReader(file))
    rows = [[float(row[f"{{plant}}.p.{name}"]) for name in outputs_of(model)] for row in told]
    # its clock adds up, so the last row may be missing
    agree(rows, expected(model, outputs_of(model), STEP, len(rows) - 1))
    assert len(rows) >= STEPS
    # the inverse sees the motion at points only; at the start it is exact: nothing drives the plant
    assert all(abs(float(told[0][f"{{inverse}}.i.{name}"])) < 1e-9 for name in parts["{inverse}.i"])


@pytest.mark.parametrize("any_model", sorted(file.stem for file in (ROOT / "models").glob("*.toml")))
def test_vdmcheck_finds_nothing(any_model, archive, java, place):
    folder = place / "vdmcheck"
    said = java("vdmcheck", "-jar", folder / "vdmcheck2.jar", archive(any_model), cwd=folder if folder.is_dir() else None)
    assert "No errors found." in said, said


def test_vdmcheck_sees_a_mistake(archive, java, place, tmp_path):
    from zipfile import ZipFile

    with ZipFile(archive("four_bar")) as opened:
        text = opened.read("modelDescription.xml").decode()
    wrong = tmp_path / "modelDescription.xml"
    # an output without its entry in ModelStructure
    at = text.index("<Unknown", text.index("<Outputs>"))
    wrong.write_text(text[:at] + text[text.index("/>", at) + 2 :])
    folder = place / "vdmcheck"
    said = java("vdmcheck", "-jar", folder / "vdmcheck2.jar", wrong, cwd=folder if folder.is_dir() else None, good=None)
    assert "No errors found." not in said
