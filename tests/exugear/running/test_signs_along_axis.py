"""What runs record along the axes, by the forces of the bearings: one frame for all flanks, directions and stages."""

from functools import cache

import numpy as np
import pytest
from paper_gears import paper_gear, paper_pair
from scenes import K, linear_law
from spatial_meshes import two_helical_stages

import exugear
from fem.units import deg, mm, rpm, um

PLACES, RADIAL, AXIAL = (0.0, 100 * mm), 2e8, 1e8
GEARS = {"input": (30 * mm,), "middle": (30 * mm, 65 * mm), "output": (65 * mm,)}
ANGLES = 25 * deg, -100 * deg
TILTS, REACH = np.array([-2e-4, 0, 2e-4]), np.array([0.0, 50 * um])
#: Softer where a map's misalignment is negative.
ONE_SIDED = exugear.MeshForce(
    [0.0],
    REACH,
    K * (1 + 1e3 * TILTS)[:, None, None] * REACH,
    backlash=20 * um,
    offsets={"misalignment": TILTS},
)


@cache
def model_of(hand: int) -> exugear.Model:
    return exugear.build(two_helical_stages(exugear.Bearing(RADIAL, AXIAL), ANGLES, hand=hand, backlash=50 * um))


def bearings_of(data, shaft: str) -> np.ndarray:
    """Force (2, 3) of both bearings on a shaft at the beginning."""
    return np.array([data["bearing_force"].sel(bearing=f"{shaft} at {z / mm:g} mm") for z in PLACES])


def displaced(data, shaft: str) -> tuple[np.ndarray, float]:
    """Slope of the axis (2) and shift along z [m], by what the bearings yield."""
    force = bearings_of(data, shaft)
    slope = -np.diff(force[:, :2], axis=0)[0] / RADIAL / (PLACES[1] - PLACES[0])
    return slope, float(-force[:, 2].mean() / AXIAL)


def height_of_force(data, shaft: str, to_pitch_point: np.ndarray) -> float:
    """z of the mesh force from the mid-plane of a shaft's only gear, by the balance of moments about x and y.

    A torque on the spin of an Rxyz node stands along (0, slope_y, 1) and takes part in it.
    """
    levers, radius = np.c_[np.zeros((2, 2)), np.array(PLACES) - GEARS[shaft][0]], np.array([*to_pitch_point, 0.0])
    force, (slope, _) = bearings_of(data, shaft), displaced(data, shaft)
    push = -force.sum(axis=0)
    torque = -np.cross(radius, push)[2] * np.array([0.0, slope[1], 1.0])
    moment = -np.cross(levers, force).sum(axis=0) - torque - np.cross(radius, push)
    return float((moment[1] * push[0] - moment[0] * push[1]) / (push[:2] @ push[:2]))


@pytest.mark.parametrize("hand", [1, -1])
@pytest.mark.parametrize("speed", [100 * rpm, -100 * rpm])
@pytest.mark.parametrize("load", [150.0, -150.0])
def test_bearings_confirm_offsets_and_centroid_of_every_flank_and_stage(hand, speed, load):
    model = model_of(hand)
    options = {"duration": 1e-4, "step": 1e-6, "sample": 1e-4, "progress": False}
    data = exugear.run_up(model, speed=speed, load=load, **options).data.isel(time=0)
    radius = 75 * mm * np.array([[np.cos(angle), np.sin(angle)] for angle in ANGLES])
    shift = displaced(data, "output")[1] - displaced(data, "middle")[1]
    heights = height_of_force(data, "input", radius[0]), height_of_force(data, "output", -radius[1]) + shift
    assert (data["mesh_force"].values * load > 0).all()
    by_tilts = 75 * mm * max(np.linalg.norm(displaced(data, shaft)[0]) for shaft in GEARS)
    assert (np.abs(data["centroid"].values - heights) < 3 * um + by_tilts).all()
    assert np.abs(heights).min() > 0.1 * mm
    for stage, (pinion, wheel) in enumerate((("input", "middle"), ("middle", "output"))):
        (slope_1, z_1), (slope_2, z_2) = displaced(data, pinion), displaced(data, wheel)
        pushed = -bearings_of(data, "output").sum(axis=0) if stage else bearings_of(data, "input").sum(axis=0)
        normal = pushed[:2] / np.linalg.norm(pushed[:2])
        opening = normal @ (slope_2 - slope_1)
        shift = z_2 - z_1 + slope_1 @ radius[stage] * 2
        assert float(data["axial_offset"][stage]) == pytest.approx(shift, rel=1e-2)
        assert float(data["misalignment"][stage]) == pytest.approx(opening, rel=1e-2)
        assert opening * heights[stage] < 0


def deflection_askew(tilt: float, load: float, joints: bool, turns: int) -> float:
    """Of a stage whose wheel's axis parts from the pinion's; turns -1: the second stage."""
    askew, parts = exugear.Placement(tilt_y=tilt, pivot=30 * mm), {30 * mm: paper_gear()}
    shafts = exugear.Shaft("a", parts), exugear.Shaft("b", parts, offset=askew)
    stages = [exugear.Stage(*shafts, ONE_SIDED, pair=paper_pair())]
    if turns < 0:
        plain = linear_law(backlash=20 * um)
        stages = [exugear.Stage(exugear.Shaft("first", parts), shafts[0], plain, pair=paper_pair()), *stages]
    box = exugear.Gearbox(stages)
    plan = exugear.plan(box).with_joints() if joints else exugear.plan(box)
    options = {"speed": 0.0, "duration": 1e-4, "step": 1e-6, "sample": 1e-4, "progress": False}
    first, last = exugear.run_up(exugear.build(box, plan=plan), load=load, **options).data["dte"].values[-1]
    assert first == pytest.approx(last, rel=1e-4)
    return last


@pytest.mark.parametrize("turns", [1, -1])
@pytest.mark.parametrize("joints", [False, True])
def test_a_displaced_shaft_loads_the_back_flank_as_its_mirror_image_loads_the_driving_one(joints, turns):
    """Where the axes part towards z the gap opens there on both flanks, which the map counts in opposite senses."""
    tilt, pair = turns * 1e-4, paper_pair()
    expected = ONE_SIDED.deflection_at(0.0, 150 / pair.pinion.r_b, misalignment=1e-4 * np.sin(pair.alpha_wt))
    assert deflection_askew(tilt, 150.0, joints, turns) == pytest.approx(expected, rel=1e-3)
    assert deflection_askew(-tilt, -150.0, joints, turns) == pytest.approx(-20 * um - expected, rel=1e-3)
