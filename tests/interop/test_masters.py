"""The KR5 and the four-bar in the masters that PyPI and Maven Central offer: the same numbers as in our own loop."""

from __future__ import annotations

import csv
import json
import re
import subprocess
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

from tests.fmi.exchange import Exchange
from tests.fmi.raw import Unpacked
from tests.interop.conftest import CLIENTS, ROOT

JOINTS = {"kuka_kr5": [f"joint{i + 1}" for i in range(6)], "four_bar": ["crank_joint", "joint2", "joint3"]}
STEP, STEPS = 0.01, 100
EULER = 1e-3  # the step size of this method; it is unstable with STEP
TIGHT = {"solver.rtol": 1e-11, "solver.atol": 1e-12}  # model exchange: two solvers
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


def agree(rows, reference, bound: float = 1e-9) -> None:
    told = [k for k, row in enumerate(rows) if row is not None]
    assert len(rows) == len(reference) and len(told) >= len(rows) - 1
    rows, reference = (np.array([table[k] for k in told]) for table in (rows, reference))
    assert rows.shape == reference.shape and np.isfinite(rows).all()
    assert np.ptp(reference, axis=0).max() > 0.1, "a scene that does not move shows nothing"
    difference = np.abs(rows - reference).max()
    print(f"largest difference {difference:.1e}")
    assert difference < bound


@pytest.mark.parametrize(("client", "fmi"), [("ecos", 2), ("ecos", 3), ("cosim", 2), ("container", 2), ("container", 3)])
def test_python_masters(client, fmi, model, archive, ask, expected):
    names = outputs_of(model)
    version, rows = ask(client, {"plant": archive(model, "--fmi", str(fmi))}, [["plant", name] for name in names], STEP, STEPS)
    print(f"{client} {version}")
    agree(rows, expected(model, names, STEP, STEPS))


@pytest.mark.parametrize("fmi", [2, 3])
def test_casadi_integrates(fmi, model, archive, ask, expected):
    """The states: of the four-bar those of its independent joint, the crank."""
    states = {name: name for name in outputs_of(model)}
    if model == "four_bar":
        states = {"crank_joint.q": "independent.q[1]", "crank_joint.qd": "independent.qd[1]"}
    reference = expected(model, list(states), STEP, STEPS, **TIGHT)
    fmus, start = {"plant": archive(model, "--fmi", str(fmi))}, dict(zip(states.values(), reference[0], strict=True))
    version, rows = ask("daebuilder", fmus, [["plant", state] for state in states.values()], STEP, STEPS, start=start)
    print(f"casadi {version}")
    agree(rows, reference, 1e-6)


@pytest.mark.parametrize(("kind", "fmi"), [("cs", 2), ("cs", 3), ("me", 2), ("me", 3)])
def test_omsimulator(kind, fmi, model, archive, place, expected, tmp_path):
    """Model exchange by its CVODE, 12 digits in its file."""
    program = [place / "bin" / "python", "-m", "OMSimulator"]
    if subprocess.run([*program, "--help"], capture_output=True, timeout=60).returncode != 0:
        pytest.skip("no OMSimulator in build/interop: its package downloads the program from a site of its own")
    names, out = outputs_of(model), tmp_path / "rows.csv"
    file = archive(model, "--fmi", str(fmi))
    # a tolerance above that of the model has no effect
    tolerance = "1e-11" if kind == "me" else "1e-3"
    options = [f"--mode={kind}", f"--result-file={out}", f"--stop-time={STEP * STEPS}", f"--step-size={STEP}", f"--tolerance={tolerance}"]
    subprocess.run([*program, file, *options, "--stripRoot"], check=True, capture_output=True, timeout=100, cwd=tmp_path)
    with out.open() as rows:
        table = {round(float(row["time"]) / STEP): [float(row[name]) for name in names] for row in csv.DictReader(rows)}
    assert set(table) == set(range(STEPS + 1))
    agree(
        [table[k] for k in range(STEPS + 1)],
        expected(model, names, STEP, STEPS, **(TIGHT if kind == "me" else {})),
        1e-6 if kind == "me" else 1e-9,
    )


def euler(file, names: list[str], folder) -> list[list[float]]:
    """Our own forward Euler method of model exchange, in steps of EULER."""
    with Exchange(Unpacked(file, folder)) as tool:
        tool.begin()
        rows, states = [tool.reals(names)], tool.get_states()
        for k in range(STEPS):
            states = states + EULER * tool.derivatives()
            assert tool.set_time((k + 1) * EULER) == 0 and tool.set_states(states) == 0
            if tool.completed_step():
                assert tool.call("EnterEventMode") == 0
                tool.event()
                assert tool.call("EnterContinuousTimeMode") == 0
                states = tool.get_states()
            rows.append(tool.reals(names))
        return rows


JAVA = [("Fmi4j", "fmi4j", ()), ("Fmi4jExchange", "fmi4j", ()), ("JavaFmi", "javafmi", PREFERENCES)]


@pytest.mark.parametrize("program, folder, options", JAVA)
def test_java_masters(program, folder, options, model, archive, java, place, expected, tmp_path):
    names, out, fmu_file = outputs_of(model), tmp_path / "rows.csv", archive(model)
    file, step = CLIENTS.parent / "java" / f"{program}.java", EULER if program == "Fmi4jExchange" else STEP
    java(folder, "-cp", f"{place / folder}/*", file, fmu_file, step, STEPS, out, *names, options=options)
    reference = euler(fmu_file, names, tmp_path / "unpacked") if step == EULER else expected(model, names, STEP, STEPS)
    with out.open() as rows:
        agree([[float(row[name]) for name in names] for row in csv.DictReader(rows)], reference)


def without_units(file: Path, folder: Path) -> Path:
    """Returns the FMU without units and quantities of its variables."""
    target = folder / "without_units.fmu"
    with ZipFile(file) as source, ZipFile(target, "w") as copy:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                content = re.sub(rb' (unit|displayUnit|quantity)="[^"]*"', b"", content)
            copy.writestr(name, content)
    return target


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("kind", ["co-simulation", "model-exchange"])
def test_fmi_sim(kind, fmi, model, archive, place, expected, tmp_path):
    """Version 0.7.0 refuses units and quantities of variables of FMI 3.0."""
    program, names, out = place / "cargo" / "bin" / "fmi-sim", outputs_of(model), tmp_path / "rows.csv"
    if not program.exists():
        pytest.skip("no fmi-sim in build/interop: cargo or the network is missing")
    file = archive(model)
    run = without_units(archive(model, "--fmi", "3"), tmp_path) if fmi == 3 else file
    step = EULER if kind == "model-exchange" else STEP
    options = ["-f", str(step * STEPS), "--output-interval", str(step)]
    subprocess.run([program, "--model", run, "-o", out, kind, *options], check=True, capture_output=True, timeout=60)
    with out.open() as rows:
        # after an event there are two rows
        told = {round(float(row["time"]) / step): [float(row[name]) for name in names] for row in csv.DictReader(rows)}
    agree(
        list(told.values()), euler(file, names, tmp_path / "unpacked") if kind == "model-exchange" else expected(model, names, STEP, STEPS)
    )


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
    """Maestro wants a connection and compares units: the accelerations go to the inverse. It cannot connect an output of which another one
    is the derivative: it asks for output derivatives in initialization mode."""
    drives = {"kuka_kr5": JOINTS["kuka_kr5"], "four_bar": ["crank_joint"]}[model]
    parts = {"{plant}.p": outputs_of(model), "{inverse}.i": [f"{joint}.tau" for joint in drives]}
    (tmp_path / "system.json").write_text(
        json.dumps(
            {
                "fmus": {"{plant}": archive(model).as_uri(), "{inverse}": archive(model, "--inverse").as_uri()},
                "parameters": {},
                "connections": {f"{{plant}}.p.{joint}.qdd": [f"{{inverse}}.i.{joint}.qdd"] for joint in drives},
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
    # the inverse stays at the start pose, where it is exact: nothing drives the plant
    assert all(abs(float(told[0][f"{{inverse}}.i.{name}"])) < 1e-9 for name in parts["{inverse}.i"])


@pytest.mark.parametrize("any_model", sorted(file.stem for file in (ROOT / "models").glob("*.toml")))
def test_vdmcheck_finds_nothing(any_model, archive, java, place):
    folder = place / "vdmcheck"
    said = java("vdmcheck", "-jar", folder / "vdmcheck2.jar", archive(any_model), cwd=folder if folder.is_dir() else None)
    assert "No errors found." in said, said


def test_vdmcheck_sees_a_mistake(archive, java, place, tmp_path):
    with ZipFile(archive("four_bar")) as opened:
        text = opened.read("modelDescription.xml").decode()
    wrong = tmp_path / "modelDescription.xml"
    # an output without its entry in ModelStructure
    at = text.index("<Unknown", text.index("<Outputs>"))
    wrong.write_text(text[:at] + text[text.index("/>", at) + 2 :])
    folder = place / "vdmcheck"
    said = java("vdmcheck", "-jar", folder / "vdmcheck2.jar", wrong, cwd=folder if folder.is_dir() else None, good=None)
    assert "No errors found." not in said
