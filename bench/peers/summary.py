"""Results of a comparison: one plot and one table per scene."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "redysim"})
import matplotlib.pyplot as plt

SMALLEST = 1e-12  # rad or m: below, the result is limited by the reference and by rounding
TARGETS = (1e-2, 1e-3, 1e-6, 1e-9)
COLOURS = {"ReDySim-FMU": "#c1121f", "Pinocchio": "#1d4e89", "MuJoCo": "#2a9d5c", "Drake": "#8a5a00", "Exudyn": "#7b3fa0"}
STYLES = (("-", "o"), ("--", "s"), (":", "^"), ("-.", "D"), ("--", "v"))
OURS = {"erk": 0, "dirk": 1, "bdf": 3, "adams": 4, "auto": 2}


def front(points) -> list:
    """The runs of a curve that no faster one beats, by error."""
    return sorted((p for p in points if not any(o.median < p.median and o.error <= p.error for o in points)), key=lambda p: p.error)


def plot(axes, scene, points, quantity: str) -> None:
    """Draws a work-precision diagram: error to the left is smaller, time upwards is longer. Errors below SMALLEST are drawn there."""
    used: dict[str, int] = {}
    for curve in dict.fromkeys(point.curve for point in points):
        mine = [point for point in points if point.curve == curve and point.error > 0]
        ours = curve.peer == "ReDySim-FMU"
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


def cheapest(points, peer: str, target: float):
    """The fastest run of a simulator that meets the target."""
    good = [point for point in points if point.curve.peer == peer and point.error <= target]
    return min(good, key=lambda point: point.median, default=None)


def table(scene, points) -> str:
    """Markdown table: CPU time of each simulator per target, and its ratio to ours."""
    peers = [peer for peer in COLOURS if any(point.curve.peer == peer for point in points)]
    lines = [
        f"**{scene.title}**, CPU time in ms per simulated second (ratio to ours)",
        "",
        "| error ≤ | " + " | ".join(peers) + " |",
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
            name = best.curve.label.removeprefix(peer).strip(" ,+")
            ratio = f" ({best.median / ours.median:.1f}×)" if ours and peer != "ReDySim-FMU" else ""
            cells.append(f"{1e3 * best.median / scene.end:.3g}{ratio}, {name}")
        lines.append(f"| {target:.0e} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def lines(scene, points) -> list[tuple[str, float]]:
    """(scene.metric, value): CPU time of each simulator, and of the fastest one, relative to ours at equal error."""
    found = []
    for power in range(2, 11):
        ours = cheapest(points, "ReDySim-FMU", 10.0**-power)
        if not ours:
            continue
        found.append((f"{scene.name}.us_a_ms_at_1e-{power:02d}", 1e3 * ours.median / scene.end))
        ratios = {
            peer: best.median / ours.median for peer in COLOURS if peer != "ReDySim-FMU" and (best := cheapest(points, peer, 10.0**-power))
        }
        found += [(f"{scene.name}.{peer.lower()}_times_slower_at_1e-{power:02d}", ratio) for peer, ratio in ratios.items()]
        if ratios:
            found.append((f"{scene.name}.nearest_peer_times_slower_at_1e-{power:02d}", min(ratios.values())))
    return found


def losses(scene, points) -> str:
    """A line of Markdown: the error bounds from 0.3 to 1e-11 at which a run of another simulator is cheaper than ours."""
    ahead: dict[str, list[tuple[float, float]]] = {}
    for fourth in range(2, 45):
        bound = 10.0 ** (-fourth / 4)
        ours = cheapest(points, "ReDySim-FMU", bound)
        for peer in COLOURS:
            best = cheapest(points, peer, bound)
            if peer != "ReDySim-FMU" and best and (not ours or best.median < ours.median):
                ahead.setdefault(best.curve.label, []).append((bound, ours.median / best.median if ours else float("inf")))
    if not ahead:
        return f"* **{scene.title}**: nowhere.\n"
    words = []
    for label, cases in ahead.items():
        largest, smallest, most = max(b for b, _ in cases), min(b for b, _ in cases), max(r for _, r in cases)
        where = f"at {largest:.1g} rad" if largest == smallest else f"between {largest:.1g} and {smallest:.1g} rad"
        words.append(f"{label} {where}, {'where no run of ours is as accurate' if most == float('inf') else f'by up to {most:.2f}×'}")
    return f"* **{scene.title}**: {'; '.join(words)}.\n"
