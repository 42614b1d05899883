"""A `fem.GearPair` of a pinion in a ring wherever a `RingPair` goes: stages, laws, runs, friction, phases, pictures."""

from dataclasses import replace

import numpy as np
import pytest
from ring_gears import COARSE, planet, ring, ring_pair
from spatial_meshes import mesh_of_spins

import exugear
import fem
from exugear import graphics
from fem.units import deg, mm, um

PAIR = ring_pair(a=abs(ring_pair().a) - 0.05 * mm)
BALL = exugear.Bearing(radial=4e8, axial=2e8, damping_time=1e-5)


@pytest.fixture(scope="module")
def ste():
    return fem.static_transmission_error(PAIR, [0, 20, 60, 100], 8, resolution=COARSE, progress=False)


def box_of(ste, *, bearings: bool = False, **options) -> exugear.Gearbox:
    """Planet and ring on two shafts."""
    held = {-30 * mm: BALL, 30 * mm: BALL} if bearings else {}
    shafts = [exugear.Shaft(name, {0.0: gear} | held) for name, gear in (("planet", PAIR.pinion), ("ring", PAIR.wheel))]
    return exugear.Gearbox([exugear.Stage(*shafts, ste, damping_ratio=0.1, **options)])


def test_signs_are_those_of_a_ring_pair():
    table = exugear.RingPair(PAIR.pinion, PAIR.wheel.z, a=PAIR.a)
    assert PAIR.a < 0 and PAIR.wheel.z < 0
    for name in ("alpha_wt", "beta_b", "back_phase", "b"):
        assert getattr(PAIR, name) == pytest.approx(getattr(table, name))
    assert PAIR.wheel.r_b == pytest.approx(table.wheel.r_b)
    law = exugear.MeshForce([0.0, 0.3, 0.6], [0.0, 1e-3], [[0.0, 4e5], [0.0, 5e5], [0.0, 6e5]])
    for turned in (0.0, 0.03, 0.2):
        lead = 8 * um / PAIR.pinion.r_b
        spins = turned + lead, -turned * PAIR.pinion.z / PAIR.wheel.z
        by_gears, by_table = (mesh_of_spins(law, pair, 0.2, spins, (0.0, 0.0)) for pair in (PAIR, table))
        assert by_gears[0] == pytest.approx(8 * um, rel=1e-6)
        assert by_table[:2] == pytest.approx(by_gears[:2], rel=1e-9)
        assert by_table[2] == pytest.approx(by_gears[2], rel=1e-9)


def test_both_shafts_turn_the_same_way_in_the_ratio_of_the_teeth(ste):
    box = box_of(ste, angle=0.4)
    assert box.ratios["ring"] == pytest.approx(23 / 71)
    assert box.shaft_positions["ring"] == pytest.approx((PAIR.a * np.cos(0.4), PAIR.a * np.sin(0.4)))


@pytest.mark.parametrize("bearings", [False, True])
def test_a_run_settles_on_the_static_transmission_error(ste, bearings):
    """Under 60 N m on the pinion the mesh force is that torque over r_b1, the DTE that of the map."""
    model = exugear.build(box_of(ste, bearings=bearings))
    load = {"ring": 60 * 71 / 23}
    data = exugear.run(model, drives={"planet": 20.0}, loads=load, duration=0.1, progress=False, checks=0).data
    settled = data.isel(time=slice(data.sizes["time"] // 2, None))
    assert settled["mesh_force"].values.mean() * PAIR.pinion.r_b == pytest.approx(60, rel=5e-3)
    assert settled["dte"].values.mean() == pytest.approx(ste["te"].sel(torque=60).values.mean(), abs=0.2 * um)


def test_static_offsets_have_the_sign_of_the_ring(ste):
    """A shaft that is displaced towards the mesh: a stays < 0, and grows by that displacement."""
    stage, offsets = box_of(ste).stages[0], fem.Offsets(a=(PAIR.a - 0.03 * mm, PAIR.a))
    moved = replace(stage.fast, offset=exugear.Placement(x=0.01 * mm))
    mapped = fem.static_transmission_error(PAIR, [0, 20, 60], 8, offsets=offsets, resolution=COARSE, progress=False)
    box = exugear.Gearbox([exugear.Stage(moved, stage.slow, mapped)])
    assert box.offsets(box.stages[0])["a"] == pytest.approx(PAIR.a - 0.01 * mm)


def test_friction_of_a_ring_has_its_path_of_contact():
    """The loss is less than that of an external pair of these teeth, as flanks slide less."""
    external = fem.GearPair(planet(), fem.Gear(z=71, m_n=2 * mm, x=0.2, b=20 * mm, d_bore=100 * mm))
    for law in (0.05, exugear.XuFriction(0.02, 0.4 * um)):
        inside, outside = (
            exugear.MeshFriction.of_pair(pair, law).loss(pair, force=2000.0, speed=100.0) for pair in (PAIR, external)
        )
        assert 0 < inside < 0.9 * outside
    with pytest.raises(
        ValueError, match=r"a ring has no path of contact: pass the tables.* take fem.GearPair\(planet, ring\)"
    ):
        exugear.MeshFriction.of_pair(exugear.RingPair(PAIR.pinion, -71, a=PAIR.a), 0.05)


@pytest.mark.parametrize(("theta", "direction", "phase"), [(0.0, 1, 0.0), (0.7, -1, 0.3), (2.0, 1, 0.9)])
def test_pictures_of_pinion_and_ring_touch_without_overlap(theta, direction, phase):
    """The outline of the pinion lies inside that of the ring's space, and comes near it."""
    angles = graphics.meshing_angles(PAIR, theta, direction, phase=phase)
    pinion, space = (
        complex_outline(gear, angle) for gear, angle in zip((PAIR.pinion, PAIR.wheel), angles, strict=True)
    )
    pinion = pinion - PAIR.a * np.exp(1j * theta)
    near = pinion[np.abs(pinion) > abs(PAIR.wheel.r_a)]
    assert np.abs(space[:, None] - near).min() < 0.2 * mm
    assert (crossing_number(near, space) % 2 == 1).mean() > 0.97


def complex_outline(gear: fem.Gear, angle: float) -> np.ndarray:
    """Outline as points x + iy [m]."""
    x, y = graphics.gear_outline(gear, phase_angle=angle, points_per_tooth=48)
    return x + 1j * y


def crossing_number(points: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """(n,) edges of a closed polygon that a ray from each point in the direction of x crosses."""
    start, end = polygon[:-1, None], polygon[1:, None]
    spans = (start.imag > points.imag) != (end.imag > points.imag)
    rise = np.where(spans, end.imag - start.imag, 1.0)
    at = start.real + (points.imag - start.imag) / rise * (end.real - start.real)
    return (spans & (at > points.real)).sum(axis=0)


def test_graphics_of_a_ring_enclose_its_volume():
    """By the divergence theorem, with triangles that face outwards; teeth and spaces even out."""
    data = graphics.gear_graphics(ring(beta=5 * deg, d_a=139.4 * mm, d_rim=170 * mm))
    points, triangles = (np.array(data[name]).reshape(-1, 3) for name in ("points", "triangles"))
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    hollow = np.pi / 4 * 20 * mm * ((170 * mm) ** 2 - (143 * mm) ** 2)
    assert volume == pytest.approx(hollow, rel=0.03)


def test_a_ring_is_no_pinion():
    with pytest.raises(ValueError, match=r"pinion must be an external gear, .* give the ring's teeth as z"):
        exugear.RingPair(PAIR.wheel, PAIR.wheel.z, a=PAIR.a)
