"""The view by WebGL: the same picture as that of the canvas, with depth and shadows, and the canvas where there is no WebGL."""

import numpy as np
import pytest

from build_fmu.cli import main
from tests.packager.test_show import attribute, browse, needs_browser, needs_library

# a red ball in front of a blue plate through which a green rod passes
MODEL = """
name = "depth"
gravity = [0, 0, -9.81]
[[link]]
name = "arm"
alpha = 0.3
mass = 1
inertia = [1, 1, 1]
[[shape]]
link = "arm"
kind = "box"
size = [1, 0.1, 0.6]
color = [0, 0, 1]
[[shape]]
link = "arm"
kind = "sphere"
size = [0.2]
position = [0.1, -0.4, 0.2]
color = [1, 0, 0]
[[shape]]
link = "arm"
kind = "cylinder"
size = [0.06, 1.5]
rpy = [1.2, 0, 0]
color = [0, 1, 0]
[fmu]
stop_time = 0.1
step_size = 0.01
"""
SOFTWARE = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")


def pixels(page, folder, *options):
    from PIL import Image

    browse(page, folder, f"--screenshot={folder / 'view.png'}", "--hide-scrollbars", *options)
    with Image.open(folder / "view.png") as picture:
        return np.asarray(picture.convert("RGB"), int)[100:640, 20:680]


def areas(picture):
    """Returns the masks of the red, green and blue solids."""
    return [picture[..., k] > 1.8 * np.maximum(picture[..., k - 1], picture[..., k - 2]) + 20 for k in range(3)]


@needs_library
@needs_browser
def test_webgl_draws_the_picture_of_the_canvas(tmp_path):
    (tmp_path / "depth.toml").write_text(MODEL, encoding="utf-8")
    page = tmp_path / "page.html"
    assert main(["show", str(tmp_path / "depth.toml"), "-o", str(page)]) == 0
    dom = browse(f"{page.as_uri()}#t=0&shadows", tmp_path, "--dump-dom", *SOFTWARE)
    assert attribute(dom, "trouble") is None
    if attribute(dom, "drawn") != "WebGL":
        pytest.skip("this browser has no WebGL")
    webgl = pixels(f"{page.as_uri()}#t=0&shadows", tmp_path, *SOFTWARE)
    canvas = pixels(f"{page.as_uri()}#t=0", tmp_path)
    (red, green, blue), (red2, green2, blue2) = areas(webgl), areas(canvas)
    for ours, other in ((red, red2), (red | green | blue, red2 | green2 | blue2)):
        assert other.sum() > 3000 and (ours & other).sum() > 0.95 * (ours | other).sum()
    # the plate hides the rod, which sorting by distance cannot do
    assert 1000 < green.sum() < 0.9 * green2.sum()
    # a shadow on the ground
    grey = np.ptp(webgl, axis=2) < 20
    assert (grey & (webgl.mean(axis=2) < 205)).sum() > 3000


@needs_library
@needs_browser
def test_without_webgl_the_canvas_draws(tmp_path):
    (tmp_path / "depth.toml").write_text(MODEL, encoding="utf-8")
    assert main(["show", str(tmp_path / "depth.toml"), "-o", str(tmp_path / "page.html")]) == 0
    dom = browse(f"{(tmp_path / 'page.html').as_uri()}#t=0&shadows", tmp_path, "--dump-dom", "--disable-3d-apis")
    assert attribute(dom, "trouble") is None and attribute(dom, "drawn") == "canvas" and int(attribute(dom, "faces")) > 100
