"""Outline of all kinds of teeth: involute, trochoid with and without undercut, circular fillet; their FE meshes."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from paper_gears import paper_gear
from strategies import gears

import fem
from fem import Density, Gear, section
from fem.gear import tooth_profile
from fem.units import deg, mm

SHARES = np.linspace(0, 1, 41)
COARSE = Density(flank=4, fillet=1, tooth=2, rim=1, body=1)
many = settings(max_examples=100)


def gear_of(**changes) -> Gear:
    return fem.Gear(**{"z": 24, "m_n": 2 * mm, "b": 10 * mm, "d_bore": 1 * mm} | changes)


def half_outline(gear: Gear) -> tooth_profile.Polar:
    """Outline from the tip corner to the middle of the space."""
    flank = tooth_profile.flank(gear, np.linspace(gear.roll_tip, gear.roll_form, 40))
    parts = [flank, tooth_profile.fillet(gear, SHARES), tooth_profile.root_land(gear, 4)]
    return tooth_profile.Polar(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def rack_clearance(gear: Gear, r: float, psi: float) -> float:
    """Least distance [m] of a point of the tooth from the rounded tooth of the rack that rolls past it.

    Teeth of the rack are straight: that distance lies in their normal section, where ISO 53 has their rounding.
    """
    depth, rho = gear.h_rack - gear.rho_f, gear.rho_f
    reach = np.linspace(-6, 6, 120001) * gear.m_t
    angle = np.pi / gear.z - psi - reach / gear.r
    across, down = (r * np.sin(angle) + reach) * np.cos(gear.beta), gear.r - r * np.cos(angle)
    half = (np.pi * gear.m_n - gear.s_n) / 2 - rho / np.cos(gear.alpha_n)
    corner = half - depth * np.tan(gear.alpha_n)
    side = np.array([np.sin(gear.alpha_n), -np.cos(gear.alpha_n)])
    along = np.maximum(0, (np.abs(across) - corner) * side[0] + (down - depth) * side[1])
    to_side = np.hypot(np.abs(across) - corner - along * side[0], down - depth - along * side[1])
    inside = (np.abs(across) < corner + (depth - down) * np.tan(gear.alpha_n)) & (down < depth)
    to_floor = np.where(np.abs(across) < corner, down - depth, np.inf)
    return float(np.where(inside, -1, np.minimum(to_side, np.maximum(to_floor, 0))).min() - rho)


@given(gears())
@many
def test_outline_neither_crosses_itself_nor_its_neighbours(gear):
    outline = half_outline(gear)
    assert (np.diff(outline.r) < 1e-9 * gear.m_n).all()
    assert (outline.psi > 0).all() and (outline.psi <= np.pi / gear.z * (1 + 1e-9)).all()
    assert outline.r[-1] == pytest.approx(gear.r_f, rel=1e-9)
    assert outline.psi[-1] == pytest.approx(np.pi / gear.z, rel=1e-9)


@given(gears())
@many
def test_normals_of_the_involute_touch_the_base_circle(gear):
    roll = np.linspace(gear.roll_form + 0.3 * gear.m_n, gear.roll_tip, 9)
    points = tooth_profile.cartesian(tooth_profile.flank(gear, roll))
    step = 1e-4 * gear.m_n
    ends = [tooth_profile.cartesian(tooth_profile.flank(gear, roll + side)) for side in (-step, step)]
    tangent = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
    assert np.abs((points * tangent).sum(axis=0)) == pytest.approx(gear.r_b, abs=1e-5 * gear.m_n)
    distance = points[0] * tangent[1] - points[1] * tangent[0]
    assert np.abs(distance) == pytest.approx(roll, abs=1e-5 * gear.m_n)


@given(gears())
@many
def test_flank_bounds_the_thickness(gear):
    roll = np.linspace(gear.roll_form, gear.roll_tip, 5)
    r, psi = tooth_profile.flank(gear, roll)
    assert 2 * r * psi == pytest.approx([gear.thickness(max(radius, gear.r_b)) for radius in r], rel=1e-9)
    assert gear.thickness(gear.r) == pytest.approx(gear.s_t, rel=1e-9)


@given(gears())
@many
def test_root_continues_the_involute_and_meets_the_root_circle(gear):
    end, root = tooth_profile.flank(gear, [gear.roll_form]), tooth_profile.fillet(gear, [0, 1 - 1e-4, 1])
    assert root.r[0] == pytest.approx(end.r[0], rel=1e-9)
    assert root.psi[0] == pytest.approx(end.psi[0], abs=1e-8)
    assert root.r[2] == pytest.approx(gear.r_f, rel=1e-9)
    along, rise = (root.psi[2] - root.psi[1]) * gear.r_f, root.r[1] - root.r[2]
    assert 0 <= rise < 1e-3 * along


@given(gears())
@many
def test_root_leaves_the_involute_without_a_corner_unless_undercut(gear):
    if gear.undercut:
        return
    step = 1e-4
    first, second = (
        tooth_profile.cartesian(tooth_profile.fillet(gear, [share, share + step]))[:, ::-1] for share in (0, step)
    )
    rolls = gear.roll_form + np.array([0.5, 1]) * 1e-3 * gear.m_n
    bends = [np.diff(points)[:, 0] / np.hypot(*np.diff(points)[:, 0]) for points in (first, second)]
    involute = np.diff(tooth_profile.cartesian(tooth_profile.flank(gear, rolls)))[:, 0]
    assert bends[0] @ bends[1] == pytest.approx(1, abs=1e-6)
    assert bends[0] @ involute / np.hypot(*involute) == pytest.approx(1, abs=1e-3)


@given(gears())
@many
def test_elements_of_every_gear_have_positive_areas(gear):
    mesh = section(gear, COARSE)
    corners = mesh.p[:, mesh.t]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    area, lengths = ahead[0] * behind[1] - ahead[1] * behind[0], np.hypot(*ahead) * np.hypot(*behind)
    assert (area / lengths).min() > 0.3
    assert len(mesh.boundary_facets()) < mesh.facets.shape[1] / 2
    edges = mesh.p[:, mesh.facets[:, mesh.boundary_facets()]].mean(axis=1)
    assert np.hypot(*edges).min() < gear.d_bore / 2 * (1 + 1e-9)


@pytest.mark.parametrize(
    "changes",
    [
        *({}, {"z": 10}, {"z": 12}, {"z": 8, "x": 0.2, "h_fP": 2.2 * mm}, {"x": 0.7}),
        *({"z": 19, "beta": 25 * deg}, {"z": 12, "beta": -15 * deg}, {"z": 12, "x": -0.3, "beta": 30 * deg}),
        *({"z": 25, "x": 0.4, "beta": 30 * deg}, {"z": 60, "beta": -40 * deg}, {"alpha_n": 25 * deg, "beta": 44 * deg}),
    ],
)
def test_rack_touches_every_point_of_the_outline_and_cuts_none(changes, measured):
    """The rack is rolled past the tooth as a rounded solid, without any formula of the trochoid or its end."""
    gear = gear_of(**changes)
    flank, root = (
        tooth_profile.flank(gear, np.linspace(gear.roll_form, gear.roll_tip, 6)),
        tooth_profile.fillet(gear, SHARES[::8]),
    )
    points = [*zip(*flank, strict=True), *zip(*root, strict=True)]
    clearance = max(abs(rack_clearance(gear, r, psi)) for r, psi in points)
    measured("roots of helical gears to 44°, over the module", clearance / gear.m_n, 1e-6)


@pytest.mark.parametrize(("beta", "z"), [(0.0, 17), (15 * deg, 15), (30 * deg, 11), (40 * deg, 8)])
def test_undercut_begins_at_the_number_of_teeth_of_the_textbook(beta, z):
    """z = 2 (h_fP - rho_fP (1 - sin alpha_n)) cos(beta) / (m_n sin^2 alpha_t): 17.09 to 8.47 for profile A."""
    alpha_t = np.arctan(np.tan(20 * deg) / np.cos(beta))
    limit = 2 * (1.25 - 0.38 * (1 - np.sin(20 * deg))) * np.cos(beta) / np.sin(alpha_t) ** 2
    assert z < limit < z + 1
    assert gear_of(z=z, beta=beta).undercut and not gear_of(z=z + 1, beta=beta).undercut


def test_trochoid_cuts_the_involute_only_where_it_undercuts():
    at_limit = 1.25 - 0.38 * (1 - np.sin(20 * deg)) - 12 * np.sin(20 * deg) ** 2 / 2
    assert gear_of(z=12, x=at_limit - 1e-3).undercut
    just, clear = (gear_of(z=12, x=at_limit + dx) for dx in (-1e-4, 1e-4))
    assert just.r_form == pytest.approx(clear.r_form, rel=1e-5)


def test_undercut_shortens_the_involute_and_thins_the_root():
    gear = gear_of(z=10)
    r, psi = tooth_profile.fillet(gear, SHARES)
    assert gear.r_form > gear.r_b
    assert 2 * (r * psi).min() < 0.95 * gear.thickness(gear.r_form)


@pytest.mark.parametrize(("z", "on_line"), [(60, False), (24, True)])
def test_given_fillet_is_an_arc_tangent_to_both_its_ends(z, on_line):
    gear = gear_of(z=z, fillet=0.6 * mm)
    assert type(gear.root).__name__ == "Arc" and gear.root.on_line is on_line
    points = tooth_profile.cartesian(tooth_profile.fillet(gear, np.linspace(0.6, 1, 9)))
    centre = tooth_profile.cartesian(tooth_profile.Polar(np.array([gear.r_f + 0.6 * mm]), np.array([gear.root.psi_f])))
    assert np.hypot(*(points - centre)) == pytest.approx(0.6 * mm, rel=1e-9)
    if on_line:
        upper = tooth_profile.fillet(gear, [0, 1e-3])
        assert upper.psi == pytest.approx(gear.psi_b, rel=1e-9)
        assert gear.r_form == gear.r_b


def test_tools_with_smaller_tip_radius_leave_less_material_in_the_root():
    """Arc and trochoid of about the same radius are close to each other."""
    rack, arc = gear_of(z=60), gear_of(z=60, fillet=0.9 * mm)
    assert type(rack.root).__name__ == "Trochoid"
    assert arc.r_form == pytest.approx(rack.r_form, abs=0.2 * mm)
    assert gear_of(z=60, fillet=0.5 * mm).r_form < arc.r_form


@pytest.mark.parametrize("factor", [0.1, 3.0])
@pytest.mark.parametrize("changes", [{}, {"z": 11}, {"fillet": 0.6 * mm}])
def test_lengths_scale_with_the_gear(changes, factor):
    gear = gear_of(**changes)
    lengths = {name: getattr(gear, name) for name in ("m_n", "b", "d_bore", "s_n", "d_a", "d_f", "rho_f", "fillet")}
    scaled = replace(gear, **{name: value and value * factor for name, value in lengths.items()})
    assert half_outline(scaled).r == pytest.approx(factor * half_outline(gear).r, rel=1e-9)
    assert half_outline(scaled).psi == pytest.approx(half_outline(gear).psi, rel=1e-7, abs=1e-9)


@pytest.mark.parametrize(("alpha_n", "beta"), [(25 * deg, 0.0), (28 * deg, 0.0), (25 * deg, 35 * deg)])
def test_root_without_land(alpha_n, beta):
    """The rack of profile A has no room for its tip radius at 25 deg: a fully rounded tip is taken instead."""
    gear = gear_of(alpha_n=alpha_n, beta=beta)
    floor = np.pi / 2 - 2 * 1.25 * np.tan(alpha_n)
    assert gear.rho_f == pytest.approx(floor / 2 / np.tan((np.pi / 2 - alpha_n) / 2) * gear.m_n)
    assert gear.root.psi_f == pytest.approx(np.pi / gear.z)
    mesh = section(gear, Density(teeth=1))
    corners = mesh.p[:, mesh.t]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    assert (ahead[0] * behind[1] - ahead[1] * behind[0]).min() > 0


@pytest.mark.parametrize("z", [5, 6, 7])
def test_mesh_of_few_teeth_closes(z):
    """The boundary of the section is one bore and one outline, also where all teeth are drawn."""
    gear = gear_of(z=z, x=0.2, h_fP=2.2 * mm)
    mesh = section(gear, Density(flank=6, teeth=2))
    ends = mesh.facets[:, mesh.boundary_facets()]
    assert (np.bincount(ends.ravel())[np.unique(ends)] == 2).all()
    assert mesh.t.max() + 1 == mesh.p.shape[1]
    assert mesh.p.shape[1] - mesh.facets.shape[1] + mesh.t.shape[1] == 0


def test_left_flank_is_the_drive_flank_of_the_outline():
    """Seen from positive z with the tooth pointing up the left flank, x < 0, faces counter-clockwise."""
    gear = paper_gear()
    rolls = np.array([gear.roll_form, gear.roll_tip])
    left = tooth_profile.cartesian(tooth_profile.flank(gear, rolls))
    assert (left[0] < 0).all()
    tangent = left[:, 1] - left[:, 0]
    outward = np.array([-tangent[1], tangent[0]])
    assert left[0].mean() * outward[1] - left[1].mean() * outward[0] > 0


@pytest.mark.parametrize(("z", "x"), [(57, -0.16), (20, 0.2), (120, 0.0), (35, 0.6)])
def test_root_continues_the_involute(z, x):
    gear = fem.Gear(z=z, x=x, m_n=2 * mm, b=10 * mm, d_bore=10 * mm)
    involute_end = tooth_profile.cartesian(tooth_profile.flank(gear, [gear.roll_form, gear.roll_form * (1 + 1e-6)]))
    root_end = tooth_profile.cartesian(tooth_profile.fillet(gear, [0, 1e-6]))
    assert root_end[:, 0] == pytest.approx(involute_end[:, 0], abs=1e-15)
    tangents = np.diff(involute_end)[:, 0], np.diff(root_end)[:, 0]
    upwards, downwards = (tangent / np.hypot(*tangent) for tangent in tangents)
    assert upwards @ downwards == pytest.approx(-1, abs=1e-9)
    bottom = tooth_profile.fillet(gear, [1])
    assert bottom.r[0] == pytest.approx(gear.r_f, rel=1e-12)
