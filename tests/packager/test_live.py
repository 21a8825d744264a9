"""The live page: its library against the one for this machine, by Node; the page in Chromium. `make wasm` builds what is needed."""

from __future__ import annotations

import base64
import json
import random
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from build_fmu import native
from build_fmu.cli import main
from build_fmu.errors import UserError
from build_fmu.fmu.build import build_for_run
from build_fmu.model.describe import Description, describe
from build_fmu.run.session import Session
from build_fmu.show.live import with_ports
from tests.packager.test_show import data_of, needs_browser, needs_library

ROOT = Path(__file__).parents[2]
MODELS = sorted((ROOT / "models").glob("*.toml"))
NODE = shutil.which("node")
PLAYER = Path(__file__).with_name("run_core.mjs")
# a rod whose start is level
ARM = """
name = "arm"
gravity = [0, 0, -9.81]
[[link]]
name = "arm"
alpha = 1.5707963267948966
mass = 2
com = [0.5, 0, 0]
inertia = [0, 0.1, 0.1]
damping = 0.1
"""
needs_node = pytest.mark.skipif(NODE is None, reason="there is no node")


@pytest.fixture
def web_library(built_library):
    """Skips a test if the library for web pages is not built."""
    try:
        return native.web_library()
    except UserError as error:
        pytest.skip(str(error))


def starts_of(model: Description, count: int) -> list[dict[str, float]]:
    """Returns the start of the model with a tight tolerance, and random ones near it with random inputs.

    The motion amplifies errors: the falling redysim_small_biped by 500 in 1 s, where rounding may decide on another method.
    """
    chance, found = random.Random(model.model_name), [{"solver.rtol": 1e-9, "solver.atol": 1e-11}]
    for _ in range(count):
        values = {}
        for variable in model.variables:
            if variable.causality in ("input", "parameter") and re.search(r"\.(q0|qd0|tau)$|\.omega0\[", variable.name):
                values[variable.name] = float(variable.start or 0) + chance.uniform(-0.1, 0.1)
        found.append(values)
    return found


def here(model: Description, file: Path, folder: Path, names: list[str], starts: list[dict[str, float]], steps: int, size: float) -> list:
    """Returns the values at the start and after some steps of the library for this machine; None for a start that fails."""
    fmu, found = folder / f"{file.stem}.fmu", []
    build_for_run(model, file, fmu)
    for start in starts:
        with Session(fmu) as session:
            try:
                session.initialise(0, 1e6, None, start)
                rows = [session.read(names)]
                for k in range(steps):
                    session.step(k * size, size)
                found.append(np.array([*rows, session.read(names)], float))
            except UserError:
                found.append(None)
    return found


def there(jobs: list[dict], folder: Path, library: Path) -> list:
    """Returns the same of the library for web pages."""
    job = {"core": str(ROOT / "build_fmu" / "show" / "core.js"), "library": str(library), "models": jobs}
    (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")
    done = subprocess.run([NODE, str(PLAYER), str(folder / "job.json")], capture_output=True, text=True, check=False, timeout=500)
    assert done.returncode == 0, done.stderr
    return [[None if "error" in run else np.array(run["rows"], float) for run in runs] for runs in json.loads(done.stdout)]


@needs_library
@needs_node
@pytest.mark.slow
@pytest.mark.parametrize("file", MODELS, ids=lambda path: path.stem)
def test_accelerations_are_those_of_the_library_for_this_machine(web_library, tmp_path, file):
    model, steps = describe(file), 20
    size = model.default_experiment["step_size"]
    outputs = [v for v in model.select("output") if v.type == "Real" and not v.name.startswith("solver.")]
    names, starts = [v.name for v in outputs], starts_of(model, 5)
    references = {v.name: v.value_reference for v in model.variables}
    files = {"model.toml": str(file)} | {name: str(file.parent / name) for name in model.resources}
    job = {"guid": model.guid, "files": files, "read": [v.value_reference for v in outputs], "steps": steps, "size": size} | {
        "starts": [{"references": [references[name] for name in start], "values": list(start.values())} for start in starts]
    }
    ours, theirs = here(model, file, tmp_path, names, starts, steps, size), there([job], tmp_path, web_library)[0]
    assert [run is None for run in theirs] == [run is None for run in ours] and ours[0] is not None
    accelerated = np.array([bool(re.search(r"\.qdd$|\.alpha\[", name)) for name in names])
    state = np.array([bool(re.search(r"\.(q|qd|omega|quaternion|kinetic|potential)(\[\d\])?$", name)) for name in names])
    errors, drifts = [], []
    for mine, other in zip(ours, theirs, strict=True):
        if mine is not None:
            difference = np.abs(other - mine)
            largest = np.abs(mine[0][accelerated]).max(initial=1)
            errors.append(float(difference[0][accelerated].max(initial=0) / largest))
            drifts.append(float((difference[1] / np.maximum(1, np.abs(mine).max(axis=0)))[state].max(initial=0)))
    print(f"{file.stem}: {errors[0]:.1e}, {len(errors) - 1} random starts {max(errors):.1e}; after {steps} steps {drifts[0]:.1e}")
    # random starts may be near singular configurations of their loops
    assert errors[0] < 1e-12 and max(errors) < 1e-11 and drifts[0] < 1e-4


@needs_library
@needs_browser
@pytest.mark.slow
@pytest.mark.parametrize("name", ["kuka_kr5", "four_bar"])
def test_a_page_computes_in_real_time_without_a_word(web_library, tmp_path, name):
    """Energy balance and speed of the page are its own; the first second is that of the library for this machine."""
    from tests.packager.chromium import Page

    page = tmp_path / "page.html"
    assert main(["show", "--live", str(ROOT / "models" / f"{name}.toml"), "-o", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    assert len(text.encode()) < 3e6 and not re.search(r"https?://|src=|@import|url\(", text.replace("<p id=", ""))
    data = data_of(text)
    times = np.frombuffer(base64.b64decode(data["time"]))
    values = np.frombuffer(base64.b64decode(data["values"]), np.float32).reshape(len(data["names"]), len(times))
    with Page(page.as_uri(), tmp_path) as shown:
        shown.wait("document.documentElement.dataset.live")
        shown.wait("now > 4")
        rate, load = (float(shown.value(f"document.documentElement.dataset.{name}")) for name in ("rate", "load"))
        print(f"{name}: {rate:.2f} times real time, {rate / load:.1f} times with all time for the computation")
        assert rate / load > 1
        assert abs(shown.value("valueAt(columns.get('energy.balance'), last())")) < 1e-4
        joints = [name for name in data["names"] if name.endswith(".q")]
        at, *positions = shown.value(f"[time, ...{json.dumps(joints)}.map((name) => columns.get(name))].map((column) => column[40])")
        ours = [np.interp(at, times, values[data["names"].index(joint)]) for joint in joints]
        assert 0.3 < at < 1 and positions == pytest.approx(ours, abs=1e-3)
        assert shown.value("restart(), now") == 0 and shown.trouble == []


@needs_library
@needs_browser
@pytest.mark.slow
def test_sliders_and_the_mouse_act_on_the_model(web_library, tmp_path):
    """A torque that carries the weight holds the arm; the mouse pulls the arm up; the start pose comes from its slider."""
    from tests.packager.chromium import Page

    (tmp_path / "arm.toml").write_text(ARM, encoding="utf-8")
    assert main(["show", "--live", str(tmp_path / "arm.toml"), "-o", str(tmp_path / "page.html")]) == 0
    with Page((tmp_path / "page.html").as_uri() + "#paused", tmp_path) as shown:
        shown.wait("document.documentElement.dataset.live")
        field = "document.querySelector('.controls input[aria-label=\"arm.tau\"]')"
        # 2 kg at 0.5 m
        shown.value(f"{field}.value = 9.81; {field}.onchange(); computation.restart(); play(true)")
        shown.wait("now > 1")
        assert abs(shown.value("valueAt(columns.get('arm.q'), last())")) < 1e-6
        x, y = shown.tip()
        shown.mouse("pressed", x, y)
        shown.mouse("moved", x, y - 80)
        shown.wait("valueAt(columns.get('arm.q'), last()) > 0.1")
        assert shown.value("long(grip.force)") > 0 and abs(shown.value("valueAt(columns.get('energy.balance'), last())")) < 1e-4
        shown.mouse("released", x, y - 80)
        assert shown.value("grip === null && view") == "home"
        shown.value("movePose(0, 0.7)")
        assert shown.value("columns.get('arm.q')[0]") == pytest.approx(0.7) and shown.value("playing") is False and shown.trouble == []


@needs_library
@needs_browser
@pytest.mark.slow
def test_a_prescribed_joint_moves_with_the_speed_that_is_set(web_library, tmp_path):
    from tests.packager.chromium import Page

    frame = '[[frame]]\nname = "tip"\nlink = "arm"\nposition = [1, 0, 0]\noutputs = ["pose"]\n'
    (tmp_path / "arm.toml").write_text(ARM + 'drive = "motion"\nqd = 0.5\n' + frame, encoding="utf-8")
    assert main(["show", "--live", str(tmp_path / "arm.toml"), "-o", str(tmp_path / "page.html")]) == 0
    angle, heights = "valueAt(columns.get('arm.q'), last())", "valueAt(columns.get('tip.position[3]'), last())"
    with Page((tmp_path / "page.html").as_uri(), tmp_path) as shown:
        shown.wait("document.documentElement.dataset.live")
        shown.wait("now > 0.5")
        at, q = shown.value(f"[now, {angle}]")
        assert q == pytest.approx(0.5 * at, abs=1e-6)
        shown.value("computation.change(live.references['arm.qd'], -1)")
        shown.wait(f"{angle} < -0.3")
        q, z = shown.value(f"[{angle}, {heights}]")
        assert z == pytest.approx(np.sin(q), abs=1e-6) and shown.trouble == []


@needs_library
def test_without_the_library_one_sentence_says_how_to_get_it(tmp_path, capsys, monkeypatch):
    (tmp_path / "arm.toml").write_text(ARM, encoding="utf-8")
    (tmp_path / "run.csv").write_text("time,arm.q\n0,0\n1,1\n", encoding="utf-8")
    monkeypatch.delenv("REDYSIM_FMU_LIBRARY_WASM", raising=False)
    monkeypatch.setattr(native, "SOURCE_TREE", tmp_path)
    monkeypatch.setattr(native, "PACKAGE", tmp_path)
    for words, sentence, code in (
        (["arm.toml"], "'libredysim_fmu.wasm': build it with `make wasm`", 1),
        (["run.csv"], "--live requires a model file or an FMU", 1),
        (["arm.toml", "--input", "arm.tau=1"], "sliders set the inputs", 2),
    ):
        assert main(["show", "--live", *(str(tmp_path / w) if "." in w and "=" not in w else w for w in words)]) == code
        said = capsys.readouterr().err
        assert sentence in said and len(said.strip().splitlines()) == 1


@needs_library
def test_each_link_that_moves_has_a_port(tmp_path):
    """Also where the model has frames in line, and names like those of the ports."""
    text = ARM.replace("gravity", 'frame = [{name = "port1", link = "arm"}]\ngravity') + '[[link]]\nname = "hand"\njoint = "fixed"\na = 1\n'
    text += '[[link]]\nname = "plate"\nparent = "ground"\njoint = "fixed"\n'
    file = tmp_path / "arm.toml"
    file.write_text(text, encoding="utf-8")
    with with_ports(describe(file), file) as (ported, copy, frames):
        inputs = {variable.name for variable in ported.select("input")}
        assert copy.is_file() and sorted(frames) == ["arm", "hand", "plate"] and "port1" not in frames.values()
        assert [f"{frames[link]}.force[1]" in inputs for link in ("arm", "hand", "plate")] == [True, True, False]
