"""The catalogue of extreme cases: what is changed, what is judged, what the page says. Nothing is run."""

import math
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from lxml import html

from build_fmu.run.driver import Outcome
from build_fmu.stress import run, variants
from build_fmu.stress.cases import GROUPS, Case, catalogue
from build_fmu.stress.html import write_html
from build_fmu.stress.pages import (
    not_finished,
    summary,
    write_csv,
    write_page,
    write_pictures,
)
from build_fmu.stress.run import Verdict, _judge

MODELS = sorted((Path(__file__).parents[2] / "models").glob("*.toml"))
OF_CONTACT = ("contact stiffness", "contact friction", "drop", "many contacts", "contact at rest")


def read(path):
    return tomllib.loads(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_every_model_has_every_group(path):
    model = read(path)
    cases = catalogue(model, 1.0, 0.01)
    missing = set(GROUPS) - {case.group for case in cases}
    assert missing <= {"switching torques", *(() if "contact" in model else OF_CONTACT)} and len(cases) >= 30
    # the model itself is left alone
    assert model == read(path)


CRANE = """
angle_unit = "deg"
[[link]]
name = "post"
mass = 2
inertia = [1, 2, 3]
q = 90
[[link]]
name = "arm"
mass = 3
[[link]]
name = "twin"
parent = "post"
joint = "prismatic"
mass = 4
[[loop]]
link_a = "ground"
link_b = "arm"
point_a = [1, 2, 3]
point_b = [4, 5, 6]
"""


@pytest.fixture
def crane():
    return tomllib.loads(CRANE)


def test_tips_get_heavy_and_roots_do_not(crane):
    variants.heavy_tips(crane, 10)
    assert [link["mass"] for link in crane["link"]] == [2, 30, 40]
    variants.heavy_roots(crane, 100)
    assert [link["mass"] for link in crane["link"]] == [200, 30, 40]
    assert crane["link"][0]["inertia"] == [100, 200, 300]


def test_the_ground_moves_along_when_the_mechanism_does(crane):
    variants.far_away(crane, 1000)
    assert [link.get("b", 0) for link in crane["link"]] == [1000, 0, 0]
    assert (crane["loop"][0]["point_a"], crane["loop"][0]["point_b"]) == ([1, 2, 1003], [4, 5, 6])


def test_masses_are_summed_outboard(crane):
    assert variants.outboard_masses(crane) == {"post": 9, "arm": 3, "twin": 4}


def test_springs_rest_at_the_start_and_angles_have_the_files_unit(crane):
    variants.stiff_joints(crane, 1e6, 1e3)
    assert [(link["stiffness"], link["damping"], link["rest"]) for link in crane["link"]] == [(1e6, 1e3, 90), (1e6, 1e3, 0), (1e6, 1e3, 0)]
    variants.start_at(crane, math.pi)
    assert [link["q"] for link in crane["link"]] == [180, 180, 0]
    variants.fast(crane, crane["link"][0], math.pi)
    assert crane["link"][0]["qd"] == 180


BALL = """
gravity = [0, -5, 0]
[[link]]
name = "ball"
joint = "free"
mass = 1
[[contact]]
name = "floor"
link_a = "ball"
shape_a = "sphere"
radius_a = 0.1
stiffness = 1e4
friction = 0.3
static_friction = 0.5
outputs = ["force"]
[[contact]]
name = "rod"
link_a = "ground"
shape_a = "capsule"
point_a = [0, 0, 1]
point_a2 = [0, 0, 2]
radius_a = 0.1
link_b = "ball"
shape_b = "sphere"
radius_b = 0.1
stiffness = 1e4
"""


@pytest.fixture
def ball():
    return tomllib.loads(BALL)


def test_bodies_on_the_ground_come_to_rest_without_driven_motion():
    model = {
        "trajectory": [{"joint": "hip", "type": "table"}],
        "link": [{"name": "trunk", "joint": "planar", "qd": [1, 0, 0]}, {"name": "leg", "drive": "motion", "qd": 2}],
        "contact": [{"name": "heel", "damping": 1}, {"name": "toe", "law": "redysim"}],
    }
    variants.come_to_rest(model)
    assert model == {
        "link": [{"name": "trunk", "joint": "planar"}, {"name": "leg", "drive": "locked"}],
        "contact": [{"name": "heel", "damping": 10, "rolling": 0.01}, {"name": "toe", "law": "redysim"}],
    }


def test_the_surfaces_of_the_ground_move_and_those_of_links_do_not(ball):
    variants.drop(ball, 10)
    floor, rod = ball["contact"]
    assert floor["point_b"] == [0, -10, 0] and "point_a" not in floor
    assert (rod["point_a"], rod["point_a2"]) == ([0, -10, 1], [0, -10, 2]) and "point_b" not in rod
    variants.far_away(ball, 1000)
    assert floor["point_b"] == [0, -10, 1000] and rod["point_a2"] == [0, -10, 1002] and ball["link"][0]["b"] == 1000


def test_points_of_the_ground_move(ball):
    ball["contact"] = [{"link_a": "ground", "shape_a": "points", "points_a": [[1, 0, 0], [2, 0, 0]], "link_b": "ball", "shape_b": "plane"}]
    variants.drop(ball, 10)
    (contact,) = ball["contact"]
    # shape 'points' has no field point_a
    assert contact["points_a"] == [[1, -10, 0], [2, -10, 0]] and not {"point_a", "point_b"} & contact.keys()


def test_divided_contacts_share_the_force(ball):
    variants.split_contacts(ball, 100)
    contacts = ball["contact"]
    assert len(contacts) == len({contact["name"] for contact in contacts}) == 100
    assert sum(contact["stiffness"] for contact in contacts) == pytest.approx(2e4)
    variants.contact_friction(ball, 2.0)
    assert {(contact["friction"], "static_friction" in contact) for contact in contacts} == {(2.0, False)}


CASE = Case("tolerance", "rtol 1e-03", {}, 1.0, 0.01)
GOOD = {"balance": 1e-9, "gap": 1e-15, "energy": 1.0, "moved": 1.0}


@pytest.mark.parametrize(
    "outcome, facts, case, kind",
    [
        (Outcome("ok"), GOOD, CASE, "finished"),
        (Outcome("ok"), dict.fromkeys(GOOD, math.nan), CASE, "finished"),
        (Outcome("ok"), GOOD | {"balance": 2e-3, "moved": 1e-10}, CASE, "finished"),
        (Outcome("ok"), GOOD | {"gap": 1e-7, "moved": 1e-10}, CASE, "doubtful"),
        (Outcome("refused"), GOOD, CASE, "refused"),
        (Outcome("ok"), GOOD | {"balance": 2e-3}, CASE, "doubtful"),
        (Outcome("ok"), GOOD | {"gap": 1e-7}, CASE, "doubtful"),
        (Outcome("budget", reached=0.5), GOOD, CASE, "slow"),
        (Outcome("budget", reached=0.5), GOOD, replace(CASE, open_end=True), "finished"),
        (Outcome("budget", reached=0.5), GOOD | {"gap": 1e-7}, replace(CASE, open_end=True), "doubtful"),
        *((Outcome(status), GOOD, CASE, "failed") for status in ("error", "not finite", "hang", "crash", "other status", "not loaded")),
    ],
)
def test_judgements(outcome, facts, case, kind):
    assert _judge(case, outcome, facts, 1e-6)[0] == kind


@pytest.mark.parametrize("reached, remedy", [(0.4, ""), (0.5, "finishes with erk"), (1.0, "finishes with erk")])
def test_a_remedy_reaches_as_far_as_the_first_run(monkeypatch, reached, remedy):
    class Unstaged:
        def names(self, causality):
            return []

        def reals(self):
            return []

        def solver(self, method):
            return {}

    monkeypatch.setattr(run, "drive", lambda fmu, task: Outcome("budget", reached=reached))
    monkeypatch.setattr(run, "_facts", lambda task, outcome, where: GOOD)
    first = Outcome("budget", reached=0.5, method="auto")
    assert run._remedy(Unstaged(), replace(CASE, open_end=True), {}, first, 2.0, 1e-6, None) == remedy


def test_the_page_groups_alike_failures(tmp_path):
    failed = Verdict("arm", CASE, "failed", "error: a | b", "erk", "bdf finishes it", after="usable")
    verdicts = [failed, replace(failed, model="leg"), Verdict("arm", CASE, "finished", balance=1e-5, gap=1e-12)]
    rows = not_finished(verdicts)
    assert rows[2:] == ["| failed | tolerance, rtol 1e-03 | arm, leg | error: a \\| b | bdf finishes it |"]
    assert summary(verdicts)[2] == "| tolerance | 1 |  |  |  | 2 | 1e-05 | 1e-12 |"
    write_page(tmp_path / "a.md", verdicts, "a.svg", 2.0, 3.0)
    write_csv(tmp_path / "a.csv", verdicts)
    write_pictures([tmp_path / "a.svg", tmp_path / "a.png"], verdicts)
    assert (tmp_path / "a.csv").read_text().count("\n") == 4 and "## leg" in (tmp_path / "a.md").read_text()


def test_the_html_page_has_a_row_and_a_square_for_each_case(tmp_path):
    failed = Verdict("arm", CASE, "failed", "error: a < b", "erk", "finishes with bdf")
    write_html(tmp_path / "a.html", [failed, Verdict("leg", CASE, "finished", balance=1e-5, error=2e-4, unit="rad", steps=12345)], 2.0, 3.0)
    page = html.parse(tmp_path / "a.html")
    assert "2 cases of 2 models in 3 s" in page.getroot().text_content()
    write_html(tmp_path / "one.html", [failed], 2.0, 3.0)
    assert "1 case of 1 model in 3 s" in (tmp_path / "one.html").read_text()
    names = ["arm-tolerance-rtol-1e-03", "leg-tolerance-rtol-1e-03"]
    assert page.xpath("//tr/@id") == names
    assert page.xpath("//table[@class='map']//a/@href") == [f"#{name}" for name in names]
    cells = [cell.text_content() for cell in page.xpath("//tr[@id]")[1]]
    assert cells == ["tolerance, rtol 1e-03", "finished", "", "1e-05", "", "2e-04 rad", "12\u2009345", "", "", ""]
    assert "error: a < b; finishes with bdf" in page.xpath("//tr[@id]")[0].text_content()
