"""A built gearbox in Exudyn's renderer: by its raytracer without a screen, and in its window on a (virtual) screen."""

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from elastic_boxes import elastic_box
from matplotlib.image import imread, imsave
from paper_gears import paper_pair
from planetary_boxes import GEAR, PIN, SUN_PAIR, planar_box, planetary_box
from scenes import smooth_box

import exugear

TURNED = 0.3
SCRIPT = """
import sys
sys.path.insert(0, sys.argv[1])
from test_viewer import show
show(sys.argv[2])
"""


@pytest.fixture
def display():
    """Name of a screen: the one in use, or a virtual one for the test."""
    if os.environ.get("DISPLAY"):
        yield os.environ["DISPLAY"]
    elif shutil.which("Xvfb"):
        with subprocess.Popen(
            ["Xvfb", "-displayfd", "1"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        ) as server:
            yield f":{server.stdout.readline().strip()}"
            server.terminate()
    else:
        pytest.skip("needs a screen: set DISPLAY, or install Xvfb")


def show(path: str, window: bool = True, box: exugear.Gearbox | None = None) -> None:
    """Turn the gears, in Exudyn's window or before its raytracer, and save the picture at the end."""
    built = exugear.build(box or smooth_box())
    exugear.draw(built)
    settings, renderer = built.container.visualizationSettings, built.container.renderer
    settings.view0.window.renderWindowSize = [1200, 700]
    settings.view0.scene.drawCoordinateSystem = settings.loads.show = settings.raytracer.advanced.showText = False
    settings.view0.window.showComputationInfo = settings.general.showSolverInformation = False
    if window and not renderer.Start():
        raise RuntimeError("no window")
    exugear.run_up(built, speed=TURNED / 0.1, duration=0.1, load=10.0, sample=1e-3)
    renderer.ZoomAll()
    if window:
        renderer.DoIdleTasks(0.5)
    imsave(path, renderer.RedrawAndGetImage(useRaytracer=not window))
    if window:
        renderer.Stop()


def tooth_angle(dark: np.ndarray, centre: complex, r: float, z: int) -> float:
    """Angle of a tooth [rad] from the z-th harmonic of what is dark on a circle; pixels, y upwards."""
    around = np.linspace(0, 2 * np.pi, 7200, endpoint=False)
    points = centre + r * np.exp(1j * around)
    on = dark[np.round(points.imag).astype(int), np.round(points.real).astype(int)]
    return float(np.angle((on * np.exp(1j * z * around)).sum())) / z


def check_teeth(path: Path) -> None:
    """Outline and angles of both gears of the paper in a picture: in mesh, and turned."""
    dark = imread(path)[::-1, :, :3].mean(axis=2) < 0.9
    rows, columns = np.flatnonzero(dark.any(axis=1)), np.flatnonzero(dark.any(axis=0))
    pair = paper_pair()
    pinion, wheel = pair.pinion, pair.wheel
    pixels = np.ptp(columns) / (pair.a + pinion.r_a + wheel.r_a)
    assert np.ptp(rows) == pytest.approx(2 * pinion.r_a * pixels, rel=0.01)
    left = columns[0] + pinion.r_a * pixels + 1j * (rows[0] + rows[-1]) / 2
    centres, turns = (left, left + pair.a * pixels), (TURNED, -TURNED)
    for gear, centre, angle, turn in zip(
        (pinion, wheel), centres, exugear.graphics.meshing_angles(pair), turns, strict=True
    ):
        measured = tooth_angle(dark, centre, (gear.r_a + 3 * gear.r_f) / 4 * pixels, gear.z)
        off = (measured - angle - turn) * gear.z / (2 * np.pi)
        assert off - round(off) == pytest.approx(0, abs=0.05)


@pytest.mark.parametrize("box_of", [smooth_box, elastic_box], ids=["rigid", "elastic"])
def test_teeth_mesh_before_the_raytracer(tmp_path, box_of):
    show(str(tmp_path / "picture.png"), window=False, box=box_of())
    check_teeth(tmp_path / "picture.png")


def test_a_drawn_model_runs_as_before():
    """What carries the graphics of elastic shafts has no mass, and is no object of the user's."""
    plain, drawn = (exugear.build(elastic_box()) for _ in range(2))
    exugear.draw(drawn)
    runs = [
        exugear.run_up(model, speed=100.0, load=50.0, duration=4e-3, progress=False, checks=0).data["dte"].values
        for model in (plain, drawn)
    ]
    np.testing.assert_allclose(*runs, rtol=1e-9)
    with ThreadPoolExecutor(1) as executor:
        parts = {"speed": 100.0, "load": 50.0, "duration": 4e-3, "executor": executor}
        np.testing.assert_allclose(
            exugear.run_up(drawn, **parts, progress=False, checks=0).data["dte"].values, runs[0], rtol=1e-6
        )


def test_teeth_mesh_in_the_window(display, tmp_path):
    path, folder = tmp_path / "picture.png", Path(__file__).parent
    call = [sys.executable, "-c", SCRIPT, str(folder), str(path)]
    subprocess.run(call, env=os.environ | {"DISPLAY": display}, check=True, cwd=folder.parent, timeout=120)
    check_teeth(path)


@pytest.mark.parametrize("on_pins", [False, True])
def test_planets_orbit_with_their_carrier_in_mesh(on_pins):
    """On ideal pins the planets are spins, which the graphics move; on elastic ones bodies that orbit."""
    box = planar_box(bearings=PIN) if on_pins else planetary_box()
    built = exugear.build(box)
    exugear.draw(built)
    exugear.run_up(built, speed=1.2 / 0.005, duration=0.005, load=100.0, progress=False, checks=0)
    seen = exugear.picture(built, rotation=(0.0, 0.0, 0.0), size=(600, 600))
    picture = np.asarray(seen, float) / max(1.0, float(np.max(seen)))
    dark = picture[::-1, :, :3].mean(axis=2) < 0.97
    rows, columns = np.flatnonzero(dark.any(axis=1)), np.flatnonzero(dark.any(axis=0))
    pixels = np.ptp(columns) / (2 * (135 + 9) * 1e-3)
    middle = (columns[0] + columns[-1]) / 2 + 1j * (rows[0] + rows[-1]) / 2
    phase = exugear.graphics.meshing_angles(SUN_PAIR, 0.0, box.flank_senses[0], phase=box.phases[0])[1]
    centre = middle + pixels * SUN_PAIR.a * np.exp(1.2j * box.ratios["carrier"])
    measured = tooth_angle(dark, centre, (GEAR.r_a + 3 * GEAR.r_f) / 4 * pixels, GEAR.z)
    off = (measured - phase - 1.2 * box.ratios["planet 1"]) * GEAR.z / (2 * np.pi)
    assert off - round(off) == pytest.approx(0, abs=0.05)
