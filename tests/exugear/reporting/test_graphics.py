"""Graphics of gears and shafts: closed surfaces, outward normals, volumes, and teeth in mesh."""

from collections import Counter

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from exudyn import graphics as drawn
from exudyn.rigidBodyUtilities import InertiaCuboid
from involutes import involute_flank
from paper_gears import paper_gear, paper_pair

import fem
from exugear import graphics
from fem.units import deg, mm, um

GEARS = {
    "paper": paper_gear(),
    "helical": paper_gear(beta=15 * deg, s_n=None, d_a=None, d_f=None, d_bore=40 * mm),
    "left-hand": paper_gear(beta=-30 * deg, s_n=None, d_a=None, d_f=None, d_bore=40 * mm),
    "undercut": fem.Gear(z=10, m_n=3 * mm, b=20 * mm, d_bore=10 * mm),
    "fillet": paper_gear(z=20, fillet=0.8 * mm, d_a=None, d_f=None, s_n=None, d_bore=20 * mm),
}


def surface(data) -> tuple[np.ndarray, np.ndarray]:
    points, triangles = drawn.ToPointsAndTrigs(data)
    return np.array(points), np.array(triangles)


def volume(data) -> float:
    """By the divergence theorem, > 0 where the normals point outward."""
    points, triangles = surface(data)
    a, b, c = (points[corner] for corner in triangles.T)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6


def area(gear: fem.Gear) -> float:
    """Transverse section within the involutes, roots and tip arcs, less the bore [m^2]: half of r^2 over the angle."""
    flank = involute_flank(gear, np.linspace(gear.roll_tip, gear.roll_form, 1001))
    r, psi = np.hstack([flank, gear.root.points(np.linspace(0, 1, 1001))])
    tip, root = gear.r_a**2 * psi[0], r[-1] ** 2 * (np.pi / gear.z - psi[-1])
    return gear.z * (tip + np.trapezoid(r**2, psi) + root) - np.pi * gear.d_bore**2 / 4


@pytest.mark.parametrize("name", GEARS)
def test_gear_is_a_closed_surface_with_outward_normals(name):
    data = graphics.gear_graphics(GEARS[name], phase_angle=0.3, axial=10 * mm)
    points, triangles = surface(data)
    edges = Counter((int(t[i]), int(t[i - 2])) for t in triangles for i in range(3))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    assert len(points) - len(edges) // 2 + len(triangles) == 0
    a, b, c = (points[corner] for corner in triangles.T)
    normals = np.cross(b - a, c - a)
    assert np.linalg.norm(normals, axis=1).min() > 0
    middle = (a + b + c) / 3
    top = np.ptp(np.stack([a, b, c])[:, :, 2], axis=0) == 0
    assert (np.sign(normals[top, 2]) == np.sign(middle[top, 2] - 10 * mm)).all()
    inside = np.hypot(*middle[:, :2].T) < GEARS[name].d_bore / 2 * (1 + 1e-9)
    assert (np.einsum("ij,ij->i", normals[inside & ~top], middle[inside & ~top] * [1, 1, 0]) < 0).all()


@pytest.mark.parametrize("name", GEARS)
def test_volume_is_that_of_the_section(name):
    gear = GEARS[name]
    assert volume(graphics.gear_graphics(gear)) == pytest.approx(area(gear) * gear.b, rel=4e-3)
    fine = graphics.gear_graphics(gear, points_per_tooth=96)
    assert volume(fine) == pytest.approx(area(gear) * gear.b, rel=1e-3)


@pytest.mark.parametrize("beta", [20 * deg, -30 * deg])
def test_twist_keeps_the_volume(beta):
    twisted = paper_gear(beta=beta, s_n=None, d_a=None, d_f=None, d_bore=60 * mm)
    x, y = graphics.gear_outline(twisted, points_per_tooth=24)
    flat = (abs(x[:-1] @ y[1:] - x[1:] @ y[:-1]) / 2 - np.pi * twisted.d_bore**2 / 4) * twisted.b
    assert volume(graphics.gear_graphics(twisted, points_per_tooth=24)) == pytest.approx(flat, rel=1e-3)


@pytest.mark.parametrize("name", GEARS)
def test_outline_has_z_teeth_with_tooth_zero_at_the_given_angle(name):
    gear, angle = GEARS[name], 0.37
    points, _ = surface(graphics.gear_graphics(gear, phase_angle=angle, axial=5 * mm))
    for side in (-1, 1):
        end = points[abs(points[:, 2] - 5 * mm - side * gear.b / 2) < 1e-9]
        tips = end[np.hypot(*end[:, :2].T) > gear.r_a * (1 - 1e-9)]
        assert len(tips) == 2 * gear.z
        turn = angle + side * gear.b / 2 * np.tan(gear.beta) / gear.r
        centred = np.angle((tips[:, 0] + 1j * tips[:, 1]) ** gear.z * np.exp(-1j * gear.z * turn))
        half = gear.thickness(gear.r_a) / 2 / gear.r_a * gear.z
        assert sorted(np.round(centred, 6)) == pytest.approx(sorted(np.round([-half, half] * gear.z, 6)), abs=1e-5)


def test_hand_of_the_helix_is_that_of_the_finite_elements():
    gear = GEARS["helical"]
    assert gear.beta > 0
    points, _ = surface(graphics.gear_graphics(gear))
    tips = points[np.isclose(np.hypot(*points[:, :2].T), gear.r_a)]
    low, high = (tips[np.isclose(tips[:, 2], side * gear.b / 2)] @ [1, 1j, 0] for side in (-1, 1))
    turned = low * np.exp(1j * np.tan(gear.beta) / gear.r * gear.b)
    assert abs(turned[:, None] - high).min(axis=1).max() < 1e-9
    assert abs(low[:, None] - high).min(axis=1).max() > 0.1 * mm


def outline_of(gear: fem.Gear, angle: float, centre: float) -> np.ndarray:
    """Corners x + iy of the drawn outline, counter-clockwise."""
    points, _ = surface(graphics.gear_graphics(gear, phase_angle=angle, points_per_tooth=80))
    plane = points[: len(points) // 2] @ [1, 1j, 0]
    outline, _ = graphics.loops(gear.z, 81, len(plane) // gear.z - 81)
    return plane[outline] + centre


def signed_distance(p: np.ndarray, polygon: np.ndarray) -> np.ndarray:
    """Distances (n,) of points from a polygon, < 0 inside."""
    a, side = polygon, np.roll(polygon, -1) - polygon
    share = np.clip(((p[:, None] - a) * np.conj(side)).real / abs(side) ** 2, 0, 1)
    distance = abs(p[:, None] - a - share * side).min(axis=1)
    above = a.imag <= p.imag[:, None]
    crosses = above != (np.roll(a, -1).imag <= p.imag[:, None])
    right = ((np.conj(side) * (p[:, None] - a)).imag > 0) == above
    winding = np.where(crosses & right, np.where(above, 1, -1), 0).sum(axis=1)
    return np.where(winding != 0, -distance, distance)


@pytest.mark.parametrize("direction", [1, -1])
def test_gears_of_a_pair_touch_at_the_pitch_point_without_overlap(direction):
    pair = paper_pair()
    psi_1, psi_2 = graphics.meshing_angles(pair, 0.0, direction)
    pinion, wheel = outline_of(pair.pinion, psi_1, 0.0), outline_of(pair.wheel, psi_2, pair.a)
    pitch_point = pair.pinion.r_b / np.cos(pair.alpha_wt)
    near = [p[abs(p - pitch_point) < 20 * mm] for p in (pinion, wheel)]
    gaps = signed_distance(near[0], wheel), signed_distance(near[1], pinion)
    assert min(gap.min() for gap in gaps) > -0.2 * um
    assert max(gap.min() for gap in gaps) < 0.5 * um
    for outline in (pinion, wheel):
        assert abs(signed_distance(np.array([pitch_point + 0j]), outline)) < 0.2 * um
    turned = outline_of(pair.pinion, psi_1 + direction * 10 * um / pair.pinion.r_b, 0.0)
    deep = signed_distance(turned[abs(turned - pitch_point) < 20 * mm], wheel).min()
    assert deep == pytest.approx(-10 * um, abs=0.5 * um)


def test_shafts_have_the_volume_of_cylinders():
    solid = graphics.shaft_graphics(0.2, 0.04, axial=0.1)
    assert volume(solid) == pytest.approx(0.2 * np.pi * 0.02**2, rel=5e-3)
    hollow = graphics.shaft_graphics(0.2, 0.04, d_bore=0.02)
    assert volume(hollow) == pytest.approx(0.2 * np.pi * (0.02**2 - 0.01**2), rel=5e-3)
    points, _ = surface(solid)
    assert (points[:, 2].min(), points[:, 2].max()) == pytest.approx((0, 0.2))


@pytest.mark.parametrize("assembled", [False, True])
def test_gear_is_added_to_the_graphics_of_a_body(assembled):
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    inertia = InertiaCuboid(1000, [1, 1, 1])
    shaft = [graphics.shaft_graphics(0.2, 0.04)]
    kind = exu.NodeType.RotationRxyz
    body = mbs.CreateRigidBody(inertia=inertia, nodeType=kind, graphicsDataList=shaft)
    spin = mbs.AddObject(eii.ObjectRotationalMass1D(nodeNumber=mbs.AddNode(eii.Node1D(referenceCoordinates=[0.0]))))
    if assembled:
        mbs.Assemble()
    gear = volume(graphics.gear_graphics(paper_gear()))
    for item, volumes in ((body, [volume(shaft[0]), gear]), (spin, [gear])):
        graphics.add_gear_graphics(mbs, item, paper_gear(), phase_angle=0.1)
        shown = mbs.GetObject(item, addGraphicsData=True)["VgraphicsData"]
        solid = [volume(data) for data in shown if data["type"] == "TriangleList"]
        assert solid == pytest.approx(volumes, rel=1e-5)
    spring = mbs.CreateSpringDamper(itemNumbers=[mbs.CreateGround(), body], referenceLength=1)
    with pytest.raises(ValueError, match="cannot carry graphics"):
        graphics.add_gear_graphics(mbs, spring, paper_gear())


@pytest.mark.parametrize("points", [9, 6])
def test_odd_and_few_points_are_refused(points):
    with pytest.raises(ValueError, match="points_per_tooth"):
        graphics.gear_graphics(paper_gear(), points_per_tooth=points)
