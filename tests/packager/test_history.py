"""The history of figures: the line of a run, and the courses over the commits."""

import json
import math
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CORE = "# machine Some processor, 2 processors, load 0.1\n# commit abc1234 with changes, median of 15 repetitions\n"
FIGURES = "kuka_kr5.kilobytes 51\nlibrary_megabytes 1.2\na.instantiate_ms 1.5\nb.instantiate_ms 2.5\nother.metric 3\n"


@pytest.fixture
def history(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "bench"))
    import history

    return history


def test_a_line_holds_the_worst_result_of_each_target(history):
    assert history.entry(FIGURES, CORE) == {
        "commit": "abc1234 with changes",
        "machine": "Some processor, 2 processors, load 0.1",
        "figures": {"kuka_kr5.kilobytes": 51, "library_megabytes": 1.2, "b.instantiate_ms": 2.5},
    }
    assert history.entry(FIGURES, "") is None


def test_a_second_run_of_a_commit_replaces_the_first(history, tmp_path):
    old = '{"commit": "1", "figures": {"library_megabytes": 2}}\n'
    text = history.with_entry(old, {"commit": "2", "figures": {"kuka_kr5.kilobytes": 50}})
    text = history.with_entry(text, {"commit": "2", "figures": {"kuka_kr5.kilobytes": 60}})
    lines = [json.loads(line) for line in text.splitlines()]
    (library, sizes), (memory, kilobytes) = history.courses(lines)
    assert [line["commit"] for line in lines] == ["1", "2"] and (library.bound, memory.bound) == (1.3, 64)
    assert sizes[0] == 2 and math.isnan(sizes[1]) and math.isnan(kilobytes[0]) and kilobytes[1] == 60
    history.draw(text, tmp_path / "history.svg")
    assert "memory of an instance" in (tmp_path / "history.svg").read_text(encoding="utf-8")


def test_the_last_line_is_that_of_the_page(history):
    """The size of the library is updated by hand in between."""
    line = json.loads((ROOT / "docs" / history.FILE).read_text(encoding="utf-8").splitlines()[-1])
    page = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8")
    assert f"* commit {line['commit']}," in page
    shown = {metric: value for metric, value in line["figures"].items() if metric != "library_megabytes"}
    assert len(shown) + page.count("| not measured |") == len(history.tables.TARGETS) - 1
    for metric, value in shown.items():
        assert f"| {value:.3g} | `{metric}` |" in page.replace(", **missed**", "")
