"""Converts lines `scene.metric value` to the tables of docs/performance.md."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

SIZES = (1, 2, 6, 7, 30, 100, 1000)
PART_WORDS = {
    "loops": "closed loops",
    "forces_between_bodies": "springs, bushings, contact, forces at frames",
    "drives": "friction and stops, actuators, prescribed motion, controllers",
    "spherical": "spherical joints",
    "energies": "energies and work",
    "other_methods": "all methods except `erk`",
    "all_these": "all of these",
}

LINE_WORDS = {
    "kuka_kr5": "kuka_kr5, last link tunable",
    "any_angle_chain_6": "6 joints of any geometry",
    "any_angle_chain_9": "9 joints of any geometry",
    "any_angle_chain_12": "12 joints of any geometry",
    "right_angle_chain_12": "12 joints, right angles",
    "right_angle_chain_24": "24 joints, right angles",
    "humanoid": "humanoid, 24 joints",
    "four_bar": "four-bar",
    "slider_crank": "slider-crank",
    "three_rrr": "3-RRR",
    "three_four_bars": "three coupled four-bars",
    "iftomm_squeezer": "Andrews' squeezer",
    "cognate": "four-bar with its cognates, 4 loops",
}


def figures(text: str) -> dict[str, float]:
    """Returns the lines' values by name."""
    return {name: float(value) for name, value in (line.split() for line in text.splitlines() if line and not line.startswith("#"))}


def recursions(core: str) -> str:
    """The table of forward and inverse dynamics in ns, with Pinocchio's if it was measured."""
    found = figures(core)

    def cell(name: str) -> str:
        return f"{found[name]:,.0f}" if name in found else "–"

    def ratio(name: str) -> str:
        return f"{found[name]:.1f}×" if name in found else "–"

    lines = [
        "| joints | angles | forward dynamics, ns | Pinocchio `aba`, ratio | inverse dynamics, ns | Pinocchio `rnea`, ratio |",
        "| --- " * 6 + "|",
    ]
    for kind, words in (("right_angle", "right"), ("any_angle", "any")):
        for n in SIZES:
            scene = f"{kind}_chain_{n}"
            cells = [str(n), words]
            for what in ("forward_dynamics", "inverse_dynamics"):
                cells += [cell(f"{scene}.{what}_ns"), ratio(f"{scene}.{what}_times_faster_than_pinocchio")]
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def right_hand_sides(core: str) -> str:
    """The table of right-hand sides of complete models, including springs, loops, friction and work."""
    rows = [
        (name.removesuffix(".right_hand_side_ns"), value) for name, value in figures(core).items() if name.endswith(".right_hand_side_ns")
    ]
    return (
        "\n".join(["| scene | one right-hand side, ns |", "| --- | --- |", *(f"| `{name}` | {value:,.0f} |" for name, value in rows)])
        + "\n"
    )


def steps(text: str) -> str:
    """The table of names and values, unchanged."""
    return (
        "\n".join(["| metric | value |", "| --- | --- |", *(f"| `{name}` | {value:g} |" for name, value in figures(text).items())]) + "\n"
    )


def latencies(text: str) -> str:
    """The table of latencies: start-up, steps and many instances, one row per scene."""
    found = figures(text)
    many = max((int(match[1]) for name in found if (match := re.search(r"of_(\d+)_instances_step_ns", name))), default=1)
    columns = [
        ("instantiate", "instantiate_ns", 1e-6, " ms"),
        ("initialize", "initialise_ns", 1e-6, " ms"),
        ("memory", "bytes", 1e-3, " kB"),
        ("step, constant inputs: median", "constant_median_ns", 1e-3, " µs"),
        ("99 %", "constant_p99_ns", 1e-3, " µs"),
        ("changing inputs: median", "changing_median_ns", 1e-3, " µs"),
        ("99 %", "changing_p99_ns", 1e-3, " µs"),
        ("99 %, fastest repetitions", "changing_fastest_p99_ns", 1e-3, " µs"),
        ("allocations", "changing_allocations", 1, ""),
        (f"step of each of {many:,}", f"of_{many}_instances_step_ns", 1e-3, " µs"),
    ]
    lines = ["| scene | " + " | ".join(head for head, *_ in columns) + " |", "| --- " * (len(columns) + 1) + "|"]
    for scene in dict.fromkeys(name.split(".")[0] for name in found):
        cells = [
            f"{found[name] * factor:.3g}{unit}" if (name := f"{scene}.{metric}") in found else "–" for _, metric, factor, unit in columns
        ]
        lines.append(f"| {scene} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def parts(text: str) -> str:
    """The table of unused parts: cost of the general library relative to one without the part, one row per part."""
    found = figures(text)
    scenes = list(dict.fromkeys(name.split(".")[0] for name in found))
    heads = [f"{scene}: {metric}" for scene in scenes for metric in ("instructions", "time")]
    lines = [
        "| omitted part | " + " | ".join(heads) + " | memory per instance | variables that differ |",
        "| --- " * (len(heads) + 3) + "|",
    ]
    for part in dict.fromkeys(name.split(".")[1].removeprefix("without_") for name in found):
        cells = [
            f"{found[name]:.3f}" if (name := f"{scene}.without_{part}.{metric}") in found else "–"
            for scene in scenes
            for metric in ("instructions", "time")
        ]
        sizes = [found[name] for scene in scenes if (name := f"{scene}.without_{part}.bytes") in found]
        others = [found[name] for scene in scenes if (name := f"{scene}.without_{part}.variables") in found]
        same = "equal" if all(size == 1 for size in sizes) else f"{max(sizes):.4f}"
        lines.append(
            f"| {PART_WORDS.get(part, part)} | " + " | ".join(cells) + f" | {same} | {'none' if not any(others) else int(max(others))} |"
        )
    return "\n".join(lines) + "\n"


def straight_lines(text: str) -> str:
    """The table of forward dynamics by the recursion and as straight-line code, then the speed-up of the KR5's specialised library."""
    found = figures(text)
    lines = ["| scene | operations | recursion | straight line | ratio |", "| --- " * 5 + "|"]
    for name in (name for name in found if name.endswith(".straight_line_operations")):
        scene = name.split(".")[0]
        recursion, line = found[f"{scene}.recursion_ns"], found[f"{scene}.straight_line_ns"]
        ratio = f"{recursion / line:.1f}" + ("" if found[name] <= found[f"{scene}.longest_straight_line"] else ", not used")
        lines.append(f"| {LINE_WORDS.get(scene, scene)} | {found[name]:.0f} | {recursion:.0f} ns | {line:.0f} ns | {ratio} |")
    notes = " ".join(line[2:] for line in text.splitlines() if line.startswith("# "))
    text = "One evaluation of forward dynamics, medians within one process. With loops, the operations include those that close them."
    below = [f"{text} {notes}"]
    if "kuka_kr5.specialised_library_bytes" in found:
        own, general = (found[f"kuka_kr5.{kind}_library_bytes"] / 1e6 for kind in ("specialised", "general"))
        faster = found["kuka_kr5.specialised_run_times_faster"]
        below.append(f"The KR5's library is {own:.2f} MB instead of {general:.2f} MB, and a run {faster:.2f} times as fast.")
    return "\n".join([*lines, "", *below]) + "\n"


@dataclass(frozen=True)
class Target:
    """A target value; the worst of the matching metrics counts."""

    words: str
    metric: str  # regular expression
    bound: float
    at_least: bool = False
    show: Callable[[float], str] = "{:.3g}".format

    def row(self, found: dict[str, float]) -> str:
        """Returns the table's row."""
        worst, target = self.worst(found), f"| {self.words} | {'≥' if self.at_least else '≤'} {self.show(self.bound)} "
        if not worst:
            return f"{target}| not measured | |"
        name, value = worst
        good = value >= self.bound if self.at_least else value <= self.bound
        return f"{target}| {self.show(value)}{'' if good else ', **missed**'} | `{name}` |"

    def worst(self, found: dict[str, float]) -> tuple[str, float] | None:
        """Returns the worst of the matching metrics and its value."""
        values = {name: value for name, value in found.items() if re.fullmatch(self.metric, name)}
        return (min if self.at_least else max)(values.items(), key=lambda item: item[1], default=None)


TARGETS = (
    Target(
        "forward dynamics, 6 and 30 joints, Pinocchio's CPU time relative to ours",
        r"(right|any)_angle_chain_(6|30)\.forward_dynamics_times_faster_than_pinocchio",
        4,
        True,
    ),
    Target("cost per joint at 1000 joints relative to 10 joints", r"\w+_angle_chain\.forward_dynamics_cost_each_at_1000_against_10", 1.3),
    Target(
        "step of 1 ms relative to the right-hand sides of its stages, KR5, changing torques",
        r"kuka_kr5\.do_step_1ms_over_right_hand_sides",
        1.4,
    ),
    Target("allocations in a step, up to 128 states", r"(?!iftomm)\w+\.(constant|changing)_allocations", 0),
    Target("99th percentile relative to median, KR5, changing torques", r"kuka_kr5\.changing_p99_over_median", 1.5),
    Target(
        "CPU time of the fastest other simulator relative to ours, errors of 1e-3 to 1e-9",
        r"\w+\.nearest_peer_times_slower_at_1e-0[3-9]",
        1,
        True,
    ),
    Target("accelerations and torques at random states, relative error", r"\w+\.random_states_[fi]d_error", 1e-12),
    Target(
        "trajectories, error relative to rtol times the amplification of the scene",
        r"\w+\.trajectory_error_in_rtol_times_amplification",
        100,
    ),
    Target("constraint violation of loops, m or rad", r"\w+\.loop_gap_in_\d+_s", 1e-10),
    Target("shared library, MB", r"library_megabytes", 1.3),
    Target("instantiate up to ten four-bars, ms", r"(?!iftomm)\w+\.instantiate_ms", 1),
    Target("initialize 40 coupled four-bars, ms", r"iftomm_four_bars\.initialise_ms", 1),
    Target("memory of an instance of the KR5, kB", r"kuka_kr5\.kilobytes", 64),
    Target("an unused part of the library: instructions with it relative to without", r"\w+\.without_(?!all_these)\w+\.instructions", 1.02),
)


def targets(text: str) -> str:
    """The table of targets and results."""
    found = figures(text)
    lines = ["| quantity | target | worst result | metric |", "| --- | --- | --- | --- |"]
    return "\n".join(lines + [target.row(found) for target in TARGETS]) + "\n"


def derived(found: dict[str, float]) -> dict[str, float]:
    """Figures that are derived from others, for the targets."""
    more = {}
    for name, value in found.items():
        scene, _, metric = name.rpartition(".")
        if metric in ("constant_p99_ns", "changing_p99_ns"):
            kind = metric.split("_")[0]
            more[f"{scene}.{kind}_p99_over_median"] = value / found[f"{scene}.{kind}_median_ns"]
        elif metric in ("instantiate_ns", "initialise_ns"):
            more[f"{scene}.{metric.removesuffix('_ns')}_ms"] = value / 1e6
        elif metric == "bytes" and "without" not in scene and "instances" not in metric:
            more[f"{scene}.kilobytes"] = value / 1e3
        elif metric == "library_bytes":
            more["library_megabytes"] = value / 1e6
        elif metric == "do_step_1ms_share_of_right_hand_sides":
            more[f"{scene}.do_step_1ms_over_right_hand_sides"] = 1 / value
    return more
