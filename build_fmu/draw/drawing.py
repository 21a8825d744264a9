"""Draws a mechanism in its initial configuration: model.png of an FMU, with reproducible bytes.

Planar mechanisms are drawn in their plane, others in three dimensions. Lengths in m, ground frame.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from build_fmu.draw.contacts import TERRAINS, outlines, points_of, terrain
from build_fmu.draw.figure import INK, METADATA, new_figure
from build_fmu.draw.skeleton import Skeleton
from build_fmu.model.planar import free_joints, joint_counts, planar_axes

PLAIN_TEXT = {"text.parse_math": False}  # names may contain dollar signs
GROUND, COM, LOOP, COUPLING, SPRING, FORCE = "#7d8792", "#c0392b", "#8e44ad", "#f2a900", "#2e8b57", "#d7263d"
AXIS_COLOURS = ("#d1495b", "#3a9d5d", "#2f6fb5")
ELEVATION, AZIMUTH = 22, -58  # degrees, view of a spatial mechanism
VIEW = np.array([f(np.radians(AZIMUTH)) * np.cos(np.radians(ELEVATION)) for f in (np.cos, np.sin)] + [np.sin(np.radians(ELEVATION))])
NAMES_END = (0.9, 0.68)  # fractions of the width of a planar and a spatial picture: names of points further right are placed to their left
NAMED_LINKS = 12  # no names for more links, because they would overlap
ROOM = ((0.01, 0.012), (0.99, 0.93))  # corners of the axes and their labels, as fractions of the picture
ZOOMS = (0.86, 0.8, 0.74, 0.68, 0.6)
ARROW = 0.2  # length of a force arrow, as a fraction of the picture
SHAPED_LINKS = 40  # more links are drawn as thin lines without joints and centers of mass


def draw(drawing: dict[str, Any], title: str, caption: str | None = None) -> bytes:
    """Returns a PNG of the drawing table (see `describe`); the caption counts joints and mass unless it is given."""
    with new_figure(6.4, 5.6, 110, PLAIN_TEXT, facecolor="white") as figure:
        mechanism(figure, drawing, title, _caption(drawing) if caption is None else caption)
        content = io.BytesIO()
        figure.savefig(content, format="png", metadata=METADATA[".png"])
        return content.getvalue()


def mechanism(figure, drawing: dict[str, Any], title: str, caption: str, bounds: np.ndarray | None = None, traces: Sequence = ()) -> None:
    """Draws into an empty figure. `bounds` (minimum, maximum point) fixes the view of a film; `traces` are paths of tips."""
    size = _size(drawing) if bounds is None else float(np.ptp(bounds, axis=0).max())
    scene = _Scene(figure, planar_axes(drawing["links"]), size, vertical_axis(drawing))
    # outside the axes of a film that follows the mechanism there are no lines
    inside = lambda point: bounds is None or np.all((bounds[0] - 0.1 * size <= point) & (point <= bounds[1] + 0.1 * size))
    if inside(np.zeros(3)):
        _ground(scene)
    for path in ([point for point in path if inside(point)] for path in traces):
        scene.line(path, color=LOOP, lw=1.2, alpha=0.5, zorder=3)
    shaped, many = _shaped(drawing), len(drawing["links"]) > SHAPED_LINKS and not drawing.get("solids")
    parts = [(placed(solid, drawing["links"])[solid.triangles], solid.colour or solid.link) for solid in drawing.get("solids", [])]
    if many:
        _thin_links(scene, drawing["links"])
    else:
        parts += Skeleton(drawing, shaped, scene.size).parts
        for i, link in enumerate(drawing["links"]):
            _link(scene, drawing["links"], i, link, shaped)
    _solids(scene, drawing["links"], parts)
    for loop in drawing.get("loops", []):
        _loop(scene, drawing["links"] if many else [], loop)
    for coupling in drawing.get("couplings", []):
        joints = [drawing["links"][i]["origin"] for i in coupling["links"]]
        scene.line(joints, color=COUPLING, lw=1.8, ls="--", zorder=13)
    for spring in drawing.get("springs", []):
        scene.line(_zigzag(spring["point_a"], spring["point_b"], scene), color=SPRING, lw=1.4)
    for bushing in drawing.get("bushings", []):
        scene.line([bushing["point_a"], bushing["point_b"]], color=SPRING, lw=3, marker="s", markersize=6)
    _contacts(scene, drawing, bounds)
    scene.finish(title, caption, bounds)


def vertical_axis(drawing: dict[str, Any]) -> int:
    """Returns the ground axis (0, 1, 2) nearest to the direction of gravity; z without gravity."""
    gravity = np.abs(drawing.get("gravity", [0, 0, 0]))
    return int(np.argmax(gravity)) if gravity.any() else 2


class _Scene:
    """A planar or spatial plot for points in the ground frame."""

    def __init__(self, figure, plane: tuple[int, int] | None, size: float, vertical: int) -> None:
        self.plane, self.size, self.points, self.names = plane, size, [np.zeros(3)], []
        # a cyclic permutation of the axes makes z vertical
        self.view = np.roll(VIEW, vertical - 2)
        if plane is None:
            from mpl_toolkits.mplot3d import Axes3D  # noqa: F401  registers the projection

            # explicit drawing order: links, joints, names
            self.axes = figure.add_axes((-0.04, -0.02, 1.04, 0.98), projection="3d", computed_zorder=False)
            self.axes.view_init(elev=ELEVATION, azim=AZIMUTH, vertical_axis="xyz"[vertical])
        else:
            self.axes = figure.add_axes((0.12, 0.1, 0.84, 0.8))

    def project(self, points) -> list[np.ndarray]:
        points = np.atleast_2d(np.asarray(points, float))
        return [points[:, i] for i in (self.plane or (0, 1, 2))]

    def line(self, points, **style) -> None:
        self.points += [np.asarray(p, float) for p in points]
        self.axes.plot(*self.project(points), solid_capstyle="round", **style)

    def lines(self, points: np.ndarray, colours: np.ndarray, width: float, alpha: float, zorder: int) -> None:
        """Draws several lines; `points` by line, point and coordinate."""
        from matplotlib.collections import LineCollection
        from mpl_toolkits.mplot3d.art3d import Line3DCollection

        self.points += list(points.reshape(-1, 3))
        style = {"colors": colours, "linewidths": width, "alpha": alpha, "zorder": zorder, "capstyle": "round"}
        if self.plane is None:
            self.axes.add_collection3d(Line3DCollection(points, **style))
        else:
            self.axes.add_collection(LineCollection(points[:, :, list(self.plane)], **style))

    def mark(self, point, **style) -> None:
        self.points.append(np.asarray(point, float))
        self.axes.plot(*self.project(point), ls="none", **style)

    def text(self, point, text: str) -> None:
        from matplotlib.patheffects import withStroke

        where = [float(x[0]) for x in self.project(point)]
        where[-1] += 0.02 * self.size
        halo = [withStroke(linewidth=2.5, foreground="white")]  # readable on top of a link
        shown = self.axes.text(*where, f"  {text}", fontsize=8.5, color=INK, zorder=30, ha="left", va="bottom", path_effects=halo)
        self.names.append((where, shown))

    def finish(self, title: str, caption: str, bounds: np.ndarray | None) -> None:
        points = np.array(self.points) if bounds is None else np.array(bounds)
        low, high = points.min(axis=0), points.max(axis=0)
        # a minimum depth, so that the box does not degenerate
        thin = 0.3 * max(high - low)
        middle, half = (low + high) / 2, np.maximum((high - low) / 2 + 0.08 * self.size, thin / 2)
        names = [f"{axis} [m]" for axis in "xyz"]
        axes, limits = self.axes, np.stack([middle - half, middle + half], axis=1)
        if self.plane is None:
            axes.set(xlim=limits[0], ylim=limits[1], zlim=limits[2], xlabel=names[0], ylabel=names[1], zlabel=names[2])
            axes.set_box_aspect(2 * half, zoom=0.92)
            for axis, share in zip((axes.xaxis, axes.yaxis, axes.zaxis), half / half.max(), strict=True):
                axis.set_major_locator(_ticks(share))
                axis.set_pane_color((0.965, 0.97, 0.975, 1))
                axis._axinfo["grid"].update(color="#dfe3e7", linewidth=0.7)
        else:
            i, j = self.plane
            axes.set(xlim=limits[i], ylim=limits[j], xlabel=names[i], ylabel=names[j], facecolor="#f7f8f9")
            axes.set_aspect("equal", adjustable="box")
            axes.grid(color="#dfe3e7", lw=0.7)
            axes.set_axisbelow(True)
            for side in axes.spines.values():
                side.set_color("#c9cfd5")
        axes.tick_params(labelsize=8, colors="#56616b")
        if self.plane is None:
            self._keep_labels_inside(2 * half)
        self._keep_names_inside()
        axes.figure.text(0.04, 0.955, title, fontsize=13, color=INK, weight="bold", va="center")
        axes.figure.text(0.96, 0.955, caption, fontsize=8.5, color="#56616b", va="center", ha="right")

    def _keep_labels_inside(self, sides: np.ndarray) -> None:
        """Scales and moves a spatial plot so that its axis labels are inside the picture, below the title."""
        axes, figure = self.axes, self.axes.figure
        room = figure.transFigure.transform(ROOM)
        for zoom in (None, *ZOOMS):
            if zoom:
                axes.set_box_aspect(sides, zoom=zoom)
            axes.apply_aspect()
            boxes = [axis.get_tightbbox(figure.canvas.get_renderer()) for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
            low, high = np.min([box.min for box in boxes], axis=0), np.max([box.max for box in boxes], axis=0)
            if np.all(high - low <= room[1] - room[0]):
                break
        shift = np.maximum(room[0] - low, 0) + np.minimum(room[1] - high, 0)
        x, y, width, height = axes.get_position(original=True).bounds
        axes.set_position((*(np.array([x, y]) + shift / figure.bbox.size), width, height))

    def _keep_names_inside(self) -> None:
        """Places names near the right edge to the left of their points."""
        from mpl_toolkits.mplot3d.proj3d import proj_transform

        self.axes.apply_aspect()
        for where, shown in self.names:
            flat = where if self.plane else proj_transform(*where, self.axes.get_proj())[:2]
            x = self.axes.figure.transFigure.inverted().transform(self.axes.transData.transform(flat))[0]
            if x > NAMES_END[self.plane is None]:
                shown.set(text=shown.get_text().strip() + "  ", ha="right")


def _shaped(drawing: dict[str, Any]) -> set[int]:
    """Returns the links that need no rods and joints beside the shapes: those with shapes, parts fixed to them, frames without mass."""
    if not drawing.get("solids"):
        return set()
    shaped = {-1, *(solid.link for solid in drawing["solids"])}
    for i, link in enumerate(drawing["links"]):
        if not link["mass"] or (link["type"] == "fixed" and link["parent"] in shaped):
            shaped.add(i)
    return shaped


def _solids(scene: _Scene, links: list[dict[str, Any]], parts: list[tuple[np.ndarray, int | str]]) -> None:
    """Draws triangles in the color of a link, or in a given one, all in one collection, which sorts them by depth."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    corners, colours = [triangles for triangles, _ in parts], []
    for triangles, owner in parts:
        colour = owner if isinstance(owner, str) else GROUND if owner < 0 else _colour(links, owner)
        colours.append(np.tile(to_rgb(colour), (len(triangles), 1)))
    if not corners:
        return
    triangles = np.concatenate(corners)
    scene.points += [triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))]
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    sight = np.eye(3)[3 - sum(scene.plane)] if scene.plane else scene.view
    light = np.asarray(sight) + np.array([0.2, -0.3, 0.6])
    tone = 0.55 + 0.45 * np.abs(normal @ (light / np.linalg.norm(light)))
    shown = np.concatenate(colours) * tone[:, None]
    style = {"linewidths": 0.2, "zorder": 9}
    if scene.plane is None:
        scene.axes.add_collection3d(Poly3DCollection(triangles, facecolors=shown, edgecolors=shown, **style))
        return
    order = np.argsort(triangles.mean(axis=1) @ sight)
    scene.axes.add_collection(
        PolyCollection(triangles[order][:, :, list(scene.plane)], facecolors=shown[order], edgecolors=shown[order], **style)
    )


def placed(solid, links: list[dict[str, Any]]) -> np.ndarray:
    """Returns the corners of a solid in the ground frame."""
    if solid.link < 0:
        return solid.points
    link = links[solid.link]
    return solid.points @ np.asarray(link["rotation"], float).T + np.asarray(link["origin"], float)


def _link(scene: _Scene, links: list[dict[str, Any]], index: int, link: dict[str, Any], shaped: set[int]) -> None:
    """Marks the center of mass of a link and names it."""
    if index in shaped:
        return
    origin, com = np.asarray(link["origin"], float), np.asarray(link["com"], float)
    if link["mass"] > 0:
        scene.mark(com, marker="P", ms=6, mfc=COM, mec="white", mew=0.6, zorder=16)
    # joints at the same point, such as a wrist, share one label; the translations of a free joint have none
    _, silent = free_joints(links)
    near = [np.linalg.norm(np.asarray(other["origin"], float) - origin) < 0.03 * scene.size for other in links]
    here = [i for i in range(len(links)) if near[i] and i not in silent]
    if len(links) - len(silent) <= NAMED_LINKS and here and here[0] == index:
        # joints with several DOF, hand[1] and hand[2], have the name of their link
        scene.text(origin, ", ".join(dict.fromkeys(links[i]["name"].partition("[")[0] for i in here)))


def _thin_links(scene: _Scene, links: list[dict[str, Any]]) -> None:
    """Draws links as _link does, without joints, centers of mass and names."""
    origin, com = (np.array([link[key] for link in links], float) for key in ("origin", "com"))
    parent, mass = np.array([link["parent"] for link in links]), np.array([link["mass"] for link in links])
    colours = _colours(len(links))
    base = np.where(parent[:, None] < 0, 0, origin[parent])
    is_tip = ~np.isin(np.arange(len(links)), parent)
    long, out = np.linalg.norm(origin - base, axis=1) > 1e-9, (mass > 0) & (np.linalg.norm(com - origin, axis=1) > 1e-9)
    if (foot := long & (parent < 0)).any():
        scene.lines(np.stack([base, origin], 1)[foot], np.full(foot.sum(), GROUND), 1.2, 0.85, 5)
    for chosen, ends, colour, width, alpha, zorder in (
        (long & (parent >= 0), base, colours[parent], 2.0, 0.85, 5),
        (out & is_tip, com, colours, 2.0, 0.85, 5),
        (out & ~is_tip, com, colours, 1.0, 0.6, 6),
    ):
        if chosen.any():
            scene.lines(np.stack([ends, origin], 1)[chosen], colour[chosen], width, alpha, zorder)


def _loop(scene: _Scene, links: list[dict[str, Any]], loop: dict[str, Any]) -> None:
    """Draws a loop: thin links extend to their points, a ring marks the joint, dots a constraint violation."""
    for side in ("a", "b"):
        point = np.asarray(loop[f"point_{side}"], float)
        # the ground is not a link
        for index in (i for i, link in enumerate(links) if link["name"] == loop[f"link_{side}"]):
            origin = np.asarray(links[index]["origin"], float)
            scene.line([origin, point], color=_colour(links, index), lw=2.0, alpha=0.85, zorder=5)
    scene.line([loop["point_a"], loop["point_b"]], color=LOOP, lw=1.2, ls=":", zorder=13)
    scene.mark(loop["point_a"], marker="o", ms=11, mfc="none", mec=LOOP, mew=1.8, zorder=15)


def _contacts(scene: _Scene, drawing: dict[str, Any], bounds: np.ndarray | None) -> None:
    """Draws contact shapes in the colours of their links, planes and height maps, and the forces of a film."""
    links, numbers = drawing["links"], {link["name"]: i for i, link in enumerate(drawing["links"])}
    contacts = drawing.get("contacts", [])
    shapes = [shape for contact in contacts for shape in (contact["a"], contact["b"])]
    for shape in (shape for shape in shapes if shape["kind"] not in TERRAINS):
        colour = _colour(links, numbers[shape["link"]]) if shape["link"] in numbers else GROUND
        for line in outlines(shape):
            scene.line(line, color=colour, lw=1.1, alpha=0.8, zorder=7)
        for point in points_of(shape) if shape["kind"] == "points" else ():
            scene.mark(point, marker=".", ms=5, mfc=colour, mec=colour, zorder=7)
    seen = np.array(scene.points) if bounds is None else np.asarray(bounds)
    drawn = []
    for shape in (shape for shape in shapes if shape["kind"] in TERRAINS):
        if shape not in drawn:
            drawn.append(shape)
            for line in terrain(shape, seen.min(axis=0), seen.max(axis=0)):
                scene.line(line, color=GROUND, lw=0.6, alpha=0.5, zorder=2)
    for contact in contacts:
        if "arrow" in contact:
            start, share = contact["arrow"]
            scene.line([start, start + share * ARROW * np.ptp(seen, axis=0).max()], color=FORCE, lw=2.0, zorder=17)
            scene.mark(start, marker="o", ms=4, mfc=FORCE, mec="white", mew=0.5, zorder=18)


def _ground(scene: _Scene) -> None:
    """Draws the ground frame as three coloured lines."""
    scene.mark(np.zeros(3), marker="D", ms=9, mfc=GROUND, mec="white", zorder=8)
    for i in scene.plane or (0, 1, 2):
        tip = np.zeros(3)
        tip[i] = 0.16 * scene.size
        scene.line([np.zeros(3), tip], color=AXIS_COLOURS[i], lw=1.8, zorder=4)
        where = [float(x[0]) for x in scene.project(tip * 1.25)]
        scene.axes.text(*where, "xyz"[i], color=AXIS_COLOURS[i], fontsize=8, ha="center", va="center", zorder=30)


def _colours(count: int) -> np.ndarray:
    from matplotlib import colormaps

    return colormaps["viridis"](0.12 + 0.75 * np.arange(count) / max(1, count - 1))


def _colour(links: list[dict[str, Any]], index: int):
    return tuple(_colours(len(links))[index])


def _ticks(share: float):
    """Returns the tick locator; a short side of the box gets fewer ticks."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(nbins=max(2, round(5 * share)))


def _size(drawing: dict[str, Any]) -> float:
    links, (free, translations) = drawing["links"], free_joints(drawing["links"])
    points = [np.asarray(link[key], float) for i, link in enumerate(links) if i not in translations for key in ("origin", "com")]
    points += [] if free else [np.zeros(3)]
    points += [point for contact in drawing.get("contacts", []) for side in "ab" for point in points_of(contact[side])]
    points += [corner for solid in drawing.get("solids", []) for corner in placed(solid, links)]
    return float(max(np.ptp(np.array(points), axis=0).max(), 1e-6))


def _caption(drawing: dict[str, Any]) -> str:
    return f"{', '.join(joint_counts(drawing))} · {sum(link['mass'] for link in drawing['links']):.4g} kg · initial configuration"


def _zigzag(start, end, scene: _Scene) -> list[np.ndarray]:
    """Returns the points of a spring: straight ends and a zigzag between them."""
    start, end = np.asarray(start, float), np.asarray(end, float)
    along = end - start
    # perpendicular to the line of sight
    sight = np.eye(3)[3 - sum(scene.plane)] if scene.plane else scene.view
    across = np.cross(along, sight)
    across *= 0.025 * scene.size / max(float(np.linalg.norm(across)), 1e-12)
    turns = [start + along * (0.2 + 0.6 * k / 12) + across * (0 if k in (0, 12) else (-1) ** k) for k in range(13)]
    return [start, *turns, end]
