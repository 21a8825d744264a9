"""Results of a comparison: one plot and one table per scene."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "redysim"})
import matplotlib.pyplot as plt

SMALLEST = 1e-12  # rad or m: below, the result is limited by the reference and by rounding
TARGETS = (1e-2, 1e-3, 1e-6, 1e-9)
OWN = {"ReDySim-FMU": "ReDySim-FMU", "specialised": "`--specialise`"}  # the general library, and one compiled for the scene
COLOURS = {
    "ReDySim-FMU": "#c1121f",
    "specialised": "#e5798a",
    "Pinocchio": "#1d4e89",
    "MuJoCo": "#2a9d5c",
    "Drake": "#8a5a00",
    "Exudyn": "#7b3fa0",
    "CasADi": "#555555",
    "heyoka": "#e07a00",
}
OTHERS = [peer for peer in COLOURS if peer not in OWN]
STYLES = (("-", "o"), ("--", "s"), (":", "^"), ("-.", "D"), ("--", "v"))
OURS = {"erk": 0, "dirk": 1, "taylor": 1, "bdf": 3, "adams": 4, "auto": 2}


def front(points) -> list:
    """The runs of a curve that no faster one beats, by error."""
    return sorted((p for p in points if not any(o.median < p.median and o.error <= p.error for o in points)), key=lambda p: p.error)


def plot(axes, scene, points, quantity: str) -> None:
    """Draws a work-precision diagram: error to the left is smaller, time upwards is longer. Errors below SMALLEST are drawn there."""
    used: dict[str, int] = {}
    for curve in dict.fromkeys(point.curve for point in points):
        mine = [point for point in points if point.curve == curve and point.error > 0]
        ours = curve.peer in OWN
        line, marker = STYLES[OURS[curve.method] if ours else used.get(curve.peer, 0) % len(STYLES)]
        used[curve.peer] = used.get(curve.peer, 0) + 1
        axes.loglog(
            [max(point.error, SMALLEST) for point in mine],
            [1e3 * point.median / scene.end for point in mine],
            linestyle=line,
            marker=marker,
            markersize=4,
            linewidth=2.4 if ours else 1.2,
            color=COLOURS[curve.peer],
            label=curve.label,
            zorder=3 if ours else 2,
        )
    axes.set_xlim(SMALLEST / 2, 1)
    axes.set_xlabel(quantity)
    axes.set_ylabel("CPU time, ms per simulated second")
    axes.set_title(scene.title)
    axes.grid(True, which="major", alpha=0.3)


def write(figure, folder: Path, name: str) -> None:
    for ending in ("svg", "png"):
        # no date in the file, so that equal figures give equal bytes
        figure.savefig(folder / f"{name}.{ending}", dpi=110, metadata={"Date": None} if ending == "svg" else {"Software": None})
    plt.close(figure)


def draw(scene, points, folder: Path) -> None:
    figure, axes = plt.subplots(figsize=(8, 5.2), layout="constrained")
    plot(axes, scene, points, "maximum error of a joint position, rad")
    axes.legend(fontsize=7.5, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
    write(figure, folder, f"peers_{scene.name}")


@dataclass(frozen=True)
class Best:
    """A curve and its CPU time in s at an error."""

    curve: object
    seconds: float


def seconds_at(points: list, target: float) -> float | None:
    """CPU time of a curve at an error: its fastest accurate run, or less between it and a faster, coarser one (log-log)."""
    edge = front(points)
    good = [point for point in edge if point.error <= target]
    if not good:
        return None
    fine = good[-1]
    coarse = next((point for point in edge if point.error > target), None)
    if coarse is None:
        return fine.median
    least = max(fine.error, SMALLEST)
    share = math.log(target / least) / math.log(coarse.error / least) if target > least else 0.0
    return fine.median * (coarse.median / fine.median) ** share


def cheapest(points, peer: str, target: float) -> Best | None:
    """The fastest curve of a simulator at an error."""
    found = []
    for curve in dict.fromkeys(point.curve for point in points if point.curve.peer == peer):
        seconds = seconds_at([point for point in points if point.curve == curve], target)
        if seconds is not None:
            found.append(Best(curve, seconds))
    return min(found, key=lambda best: best.seconds, default=None)


def two_digits(ratio: float) -> str:
    """Two significant digits without an exponent, all digits before the point: "0.21", "5.4", "131"."""
    return f"{ratio:.2g}" if ratio < 100 else f"{ratio:.0f}"


def table(scene, points) -> str:
    """Markdown table: CPU time of each simulator per target, and its ratio to ours."""
    peers = [peer for peer in COLOURS if any(point.curve.peer == peer for point in points)]
    lines = [
        f"**{scene.title}**, CPU time in ms per simulated second (ratio to ours)",
        "",
        "| error | " + " | ".join(OWN.get(peer, peer) for peer in peers) + " |",
        "| --- " * (len(peers) + 1) + "|",
    ]
    for target in TARGETS:
        ours = cheapest(points, "ReDySim-FMU", target)
        cells = []
        for peer in peers:
            best = cheapest(points, peer, target)
            if best is None:
                cells.append("not reached")
                continue
            name = best.curve.label.removeprefix(peer).removeprefix("ReDySim-FMU --specialise").strip(" ,+")
            ratio = f" ({two_digits(best.seconds / ours.seconds)}×)" if ours and peer != "ReDySim-FMU" else ""
            cells.append(f"{1e3 * best.seconds / scene.end:.3g}{ratio}, {name}")
        lines.append(f"| {target:.0e} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def lines(scene, points) -> list[tuple[str, float]]:
    """(scene.metric, value): CPU time of each simulator, and of the fastest other one, relative to ours at equal error."""
    found = []
    for power in range(2, 11):
        ours = cheapest(points, "ReDySim-FMU", 10.0**-power)
        if not ours:
            continue
        found.append((f"{scene.name}.us_a_ms_at_1e-{power:02d}", 1e3 * ours.seconds / scene.end))
        best = {peer: cheapest(points, peer, 10.0**-power) for peer in COLOURS if peer != "ReDySim-FMU"}
        ratios = {peer: run.seconds / ours.seconds for peer, run in best.items() if run}
        found += [(f"{scene.name}.{peer.lower()}_times_slower_at_1e-{power:02d}", ratio) for peer, ratio in ratios.items()]
        others = [ratio for peer, ratio in ratios.items() if peer in OTHERS]
        if others:
            found.append((f"{scene.name}.nearest_peer_times_slower_at_1e-{power:02d}", min(others)))
    return found


def losses(scene, points) -> str:
    """Lines of Markdown: the errors from 0.3 to 1e-11 at which another simulator is cheaper than each of our libraries."""
    return "".join(_losses(scene, points, own) for own in OWN if any(point.curve.peer == own for point in points))


def _losses(scene, points, own: str) -> str:
    ahead: dict[str, list[tuple[float, float]]] = {}
    for fourth in range(2, 45):
        bound = 10.0 ** (-fourth / 4)
        ours = cheapest(points, own, bound)
        for peer in OTHERS:
            best = cheapest(points, peer, bound)
            if best and (not ours or best.seconds < ours.seconds):
                ahead.setdefault(best.curve.label, []).append((bound, ours.seconds / best.seconds if ours else float("inf")))
    title = f"* **{scene.title}**" + (", `--specialise`" if own == "specialised" else "")
    if not ahead:
        return f"{title}: nowhere.\n"
    return f"{title}: {'; '.join(_lead(label, cases) for label, cases in ahead.items())}.\n"


def _lead(label: str, cases: list[tuple[float, float]]) -> str:
    """Where a simulator leads; infinite: no run of ours has this error."""
    compared = [bound for bound, ratio in cases if ratio < float("inf")]
    words = []
    if compared:
        most = max(ratio for _, ratio in cases if ratio < float("inf"))
        words.append(f"{_range(compared)}, by up to {most:.2f}×")
    if len(compared) < len(cases):
        words.append(f"{_range([bound for bound, ratio in cases if ratio == float('inf')])}, where no run of ours is as accurate")
    return f"{label} {' and '.join(words)}"


def _range(bounds: list[float]) -> str:
    largest, smallest = max(bounds), min(bounds)
    return f"at {largest:.1g} rad" if largest == smallest else f"between {largest:.1g} and {smallest:.1g} rad"
