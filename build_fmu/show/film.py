"""Writes a run as a film for reports: a GIF by Pillow, which comes with matplotlib, or an MP4 by ffmpeg."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from build_fmu.draw.contacts import TERRAINS, points_of
from build_fmu.draw.drawing import PLAIN_TEXT, mechanism, placed, vertical_axis
from build_fmu.draw.figure import new_figure
from build_fmu.errors import UserError
from build_fmu.files import whole_file
from build_fmu.model.describe import Description
from build_fmu.model.planar import free_joints
from build_fmu.show.motion import Motion
from build_fmu.show.page import Run

FORMATS = (".gif", ".mp4")
MOST_PICTURES = 400
PATH_POINTS = 1000
FOLLOWED = 1.5  # ratio of the extents of the run and of the mechanism from which the view follows
TRACE = 0.25  # fraction of the run for which the path of a tip is shown


def film(target: Path, title: str, run: Run, model: Description, speed: float, pictures_per_second: float) -> int:
    """Writes the film and returns the number of its frames; raises UserError."""
    rows = pictures(run.time, speed, pictures_per_second)
    motion = Motion(model.drawing, run.columns)
    if target.suffix.lower() == ".mp4":
        program = encoder()
        whole_file(target, lambda path: _mp4(program, path, frames(motion, run, rows, title), pictures_per_second))
    else:
        whole_file(target, lambda path: _gif(path, frames(motion, run, rows, title), pictures_per_second))
    return len(rows)


def encoder() -> str:
    """Returns the program ffmpeg of the system or of the package imageio-ffmpeg; raises UserError if there is none."""
    program = shutil.which("ffmpeg")
    if program is not None:
        return program
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        raise UserError("MP4 requires the program ffmpeg: install it or the package imageio-ffmpeg, or use --gif") from None


def pictures(time: np.ndarray, speed: float, per_second: float) -> np.ndarray:
    """Returns the rows nearest to the times of the frames; raises UserError for too many frames."""
    span = time[-1] - time[0]
    count = max(2, round(span / speed * per_second) + 1)
    if count > MOST_PICTURES:
        raise UserError(
            f"the film would have {count} frames, more than {MOST_PICTURES}: use a higher --speed, a lower --rate or an earlier --stop"
        )
    return np.array([int(np.argmin(np.abs(time - t))) for t in np.linspace(time[0], time[-1], count)])


def frames(motion: Motion, run: Run, rows: np.ndarray, title: str) -> Iterator[np.ndarray]:
    """Yields the frames, height x width x RGB."""
    drawings = [motion.at(int(row)) for row in rows]
    bounds = views(drawings)
    tips = [i for i, _ in enumerate(drawings[0]["links"]) if all(link["parent"] != i for link in drawings[0]["links"])][:4]
    # paths use more rows than there are frames, so that they are smooth
    path_rows = np.unique(np.linspace(rows[0], rows[-1], min(rows[-1] - rows[0] + 1, PATH_POINTS)).astype(int))
    paths = np.array([[_tip(links[i]) for i in tips] for links in (motion.at(int(row))["links"] for row in path_rows)])
    path_time, kept = run.time[path_rows], TRACE * (run.time[rows[-1]] - run.time[rows[0]])
    for row, drawing, view in zip(rows, drawings, bounds, strict=True):
        with new_figure(6.4, 5.6, 80, PLAIN_TEXT, facecolor="white") as figure:
            now = run.time[row]
            behind = paths[(path_time <= now) & (path_time >= now - kept)]
            traces = [[*behind[:, k], _tip(drawing["links"][i])] for k, i in enumerate(tips)]
            mechanism(figure, drawing, title, f"t = {run.time[row]:.2f} s", view, traces)
            figure.canvas.draw()
            yield np.asarray(figure.canvas.buffer_rgba())[..., :3].copy()


def views(drawings: list[dict]) -> np.ndarray:
    """Returns minimum and maximum point of the view of each frame, of equal size; the view follows a mechanism that leaves its place."""
    travel = np.array([_center(drawing) for drawing in drawings])
    travel -= travel[0]
    if _has_ground(drawings[0]):
        travel[:, vertical_axis(drawings[0])] = 0
    outer, inner = [], []
    for drawing, moved in zip(drawings, travel, strict=True):
        points = np.array(_points(drawing))
        outer += [*points, np.zeros(3)]
        inner.append(points - moved)
    run, robot = (np.array([np.min(points, axis=0), np.max(points, axis=0)]) for points in (outer, np.concatenate(inner)))
    if not _held(drawings) and np.linalg.norm(run[1] - run[0]) > FOLLOWED * np.linalg.norm(robot[1] - robot[0]):
        return robot + travel[:, None]
    return np.broadcast_to(run, (len(drawings), 2, 3))


def _held(drawings: list[dict]) -> bool:
    """Returns whether a moving joint stays in its place."""
    links = drawings[0]["links"]
    floating = set().union(*free_joints(links))
    places = np.array([[link["origin"] for link in drawing["links"]] for drawing in drawings])
    return any(link["type"] != "fixed" and i not in floating and np.ptp(places[:, i], axis=0).max() < 1e-9 for i, link in enumerate(links))


def _center(drawing: dict) -> np.ndarray:
    masses = np.array([link["mass"] for link in drawing["links"]])
    return np.average([link["com"] for link in drawing["links"]], axis=0, weights=masses if masses.any() else None)


def _has_ground(drawing: dict) -> bool:
    shapes = [shape for contact in drawing["contacts"] for shape in (contact["a"], contact["b"])]
    return any(shape["link"] == "ground" and shape["kind"] in TERRAINS for shape in shapes)


def _tip(link: dict) -> np.ndarray:
    return np.asarray(link["com"] if link["mass"] > 0 else link["origin"], float)


def _points(drawing: dict) -> list[np.ndarray]:
    free, translations = free_joints(drawing["links"])
    points = [] if free else [np.zeros(3)]
    for link in (link for i, link in enumerate(drawing["links"]) if i not in translations):
        points += [np.asarray(link["origin"], float), np.asarray(link["com"] if link["mass"] > 0 else link["origin"], float)]
    for tie in (*drawing["loops"], *drawing["springs"], *drawing.get("bushings", [])):
        points += [np.asarray(tie["point_a"], float), np.asarray(tie["point_b"], float)]
    for contact in drawing["contacts"]:
        points += points_of(contact["a"]) + points_of(contact["b"])
    for solid in drawing.get("solids", []):
        points += list(placed(solid, drawing["links"])[:: len(solid.points) // 50 + 1])
    return points


def _gif(path: Path, images: Iterator[np.ndarray], per_second: float) -> None:
    from PIL import Image

    # one palette for all frames avoids flicker
    coloured = [Image.fromarray(image) for image in images]
    palette = coloured[len(coloured) // 2].quantize(128)
    flat = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in coloured]
    flat[0].save(path, format="GIF", save_all=True, append_images=flat[1:], duration=round(1000 / per_second), loop=0, optimize=True)


def _mp4(program: str, path: Path, images: Iterator[np.ndarray], per_second: float) -> None:
    first = next(images)
    height, width = (first.shape[0] // 2 * 2, first.shape[1] // 2 * 2)  # the encoder requires even sizes
    command = [
        program,
        "-loglevel",
        "error",
        "-y",
        "-f",
        "rawvideo",
        "-pix_fmt",
        "rgb24",
        "-s",
        f"{width}x{height}",
        "-r",
        f"{per_second:g}",
        "-i",
        "-",
        "-pix_fmt",
        "yuv420p",
        "-movflags",
        "+faststart",
        "-f",
        "mp4",
        str(path),
    ]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as run:
        try:
            for image in (first, *images):
                run.stdin.write(image[:height, :width].tobytes())
        except BrokenPipeError:
            pass  # its output gives the reason
        run.stdin.close()
        words = run.stderr.read().decode("utf-8", "replace").strip()
    if run.returncode != 0:
        raise UserError(f"ffmpeg failed: {words.splitlines()[-1] if words else f'exit code {run.returncode}'}")
