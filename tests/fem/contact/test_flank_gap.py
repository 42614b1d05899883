"""Lines of contact, and the contact of springs, against closed forms; gaps and directions of contact."""

import numpy as np
import pytest
from contacts import position_of, single_slice
from helical_gears import published_pair
from hypothesis import given
from hypothesis import strategies as st
from paper_gears import paper_gear, paper_pair
from whole_section import FACES

import fem
from fem.contact.flank_gap import between_normals, first_roll, foot_at, sections_of, write_gaps
from fem.contact.strip_bounds import NODES, STRIPS, WINDOW, strips_of
from fem.contact.strip_contact import CAPACITY, StripContact, local_compliance
from fem.elasticity.half_space import along_line
from fem.units import deg, mm, um


@pytest.fixture(scope="module")
def lines():
    """The published pair and its lines of contact."""
    pair = published_pair()
    return pair, [np.array(list(position_of(pair, i / 2000).lines().values())) for i in range(2000)]


def test_length_of_the_lines_of_contact(lines):
    pair, at_phases = lines
    total = np.array([(ends[:, 1] - ends[:, 0]).sum() for ends in at_phases]) / np.cos(pair.beta_b)
    assert [total.min(), total.max(), total.mean()] == pytest.approx([23.768 * mm, 43.855 * mm, 34.617 * mm], rel=1e-3)


def test_centroid_of_evenly_loaded_lines(lines):
    _, at_phases = lines
    centroid = [np.average(ends.mean(axis=1), weights=ends[:, 1] - ends[:, 0]) for ends in at_phases]
    assert np.ptp(centroid) == pytest.approx(3.946 * mm, rel=1e-3)


def sides(gap: np.ndarray) -> np.ndarray:
    """Displacements of equal strips per transmission error, gaps (n, m) and shape functions."""
    approach = np.ones_like(gap)
    return local_compliance(np.ones_like(gap), True, 1.0, np.ones(len(gap)), approach, gap)[1]


@pytest.mark.parametrize(
    ("tilt", "delta", "tangent", "k_h_beta"), [(5, 7.183, 460.0, 1.534), (10, 9.678, 445.2, 2.067)]
)
def test_misaligned_line_of_springs(tilt, delta, tangent, k_h_beta):
    """c = 20 N/(mm um) over 23 mm, touching all over, or as far as delta^2 = 2 tilt F / (c b)."""
    b, c, n = 23 * mm, 20e9, 200
    force = 150 / paper_pair().pinion.r_b
    even = force / (c * b)
    exact = even + tilt * um / 2 if even > tilt * um / 2 else np.sqrt(2 * tilt * um * even)
    springs = np.tile(np.eye(STRIPS) * STRIPS * n / (c * b), (n, 1, 1))
    gap = (np.arange(n * STRIPS).reshape(n, STRIPS) + 0.5) / (n * STRIPS) * tilt * um
    every, uncoupled = np.ones_like(gap, bool), np.zeros((n * NODES, n * NODES))
    te, _, f = StripContact(springs, uncoupled, sides(gap)).solve(force, every)
    line_load = f * n * STRIPS / b
    assert te == pytest.approx(exact, rel=1e-6)
    assert te / um == pytest.approx(delta, abs=1e-3)
    assert c * b * (f > 0).mean() / 1e6 == pytest.approx(tangent, abs=0.1)
    assert line_load.max() / (force / b) == pytest.approx(k_h_beta, abs=1e-3)


def test_strips_that_join_one_by_one_reach_the_same_contact():
    rng, n = np.random.default_rng(0), 6
    root = rng.standard_normal((n * NODES, n * NODES))
    smooth = 1e-10 * (root @ root.T)
    local = np.tile(2e-9 * np.exp(-np.abs(np.subtract.outer(np.arange(STRIPS), np.arange(STRIPS))) / 5), (n, 1, 1))
    gap = rng.uniform(0, 5 * um, (n, STRIPS))
    contact = StripContact(local, smooth, sides(gap))
    te, _, f = contact.solve(2000.0, np.ones_like(gap, bool))
    te_slow, _, f_slow = contact.solve(2000.0, np.ones_like(gap, bool), exchanges=1)
    assert te_slow == pytest.approx(te, rel=1e-12)
    assert f_slow == pytest.approx(f, abs=1e-8)
    assert 0 < (f > 0).mean() < 1


def gaps_at(slices, roll: np.ndarray) -> np.ndarray:
    """(n,) gaps in the first slice at roll lengths of the host [m]."""
    mesh, gap, foot = slices.mesh.geometry, np.empty((1, roll.size)), np.empty((1, roll.size))
    sections = sections_of(mesh, slices.number, slices.low, slices.high, np.zeros(1))
    write_gaps(mesh, sections, roll[None], gap, foot)
    return gap[0]


@pytest.mark.parametrize("phase", [-0.3, 0.3])
def test_flanks_in_contact_have_a_common_normal(phase):
    """At the contact point the slope of a parabolic relief is the angle between the normals of the involutes."""
    relief = fem.TipRelief(15 * um, 4 * mm, power=2)
    gear = paper_gear(flank=relief)
    slices = single_slice(fem.GearPair(gear, gear, a=150 * mm), phase)
    at = sections_of(slices.mesh.geometry, slices.number, slices.low, slices.high, np.zeros(1))[0]
    (roll,), (foot,) = slices.closest.roll, slices.closest.foot
    of_mate = between_normals(at, roll, foot)
    step = 1e-3 * mm
    change = np.diff(relief.removed(gear.face, np.array([-step, step]) + foot, 0.0))[0]
    assert of_mate > 2e-3
    assert of_mate == pytest.approx(change / (2 * step * foot / gear.r_b), rel=0.02)


def test_loaded_teeth_touch_nearer_to_both_tips():
    """On the line of action rigid flanks would overlap by te; the contact lies in the middle of this overlap."""
    te = 10 * um
    for phase in (-0.2, 0.1):
        rolls = []
        for at in (0.0, te):
            closest = single_slice(paper_pair(), phase, at).closest
            rolls.append(np.stack([closest.roll, closest.foot]))
        assert rolls[1] - rolls[0] == pytest.approx(te / 2 + 0 * rolls[0], rel=1e-3)


@pytest.mark.parametrize("relief", [(), fem.ProfileCrowning(5 * um)])
def test_the_direction_of_contact_is_the_same_whichever_gear_carries_the_strips(relief):
    """At the pitch point either gear may carry the strips."""
    pair = fem.GearPair(paper_gear(flank=relief), paper_gear(flank=relief), a=150 * mm)
    from_gears = []
    for phase in (-1e-12, 1e-12):
        slices = single_slice(pair, phase, 30 * um)
        strips = strips_of(slices, np.array([0.2 * mm]))
        order = slice(None) if slices.pinion_is_host[0] else slice(None, None, -1)
        from_gears.append([values[..., order] for values in (strips.tilts, strips.approach, strips.gap)])
    for from_pinion, from_wheel, error in zip(*from_gears, (3e-4, 3e-5, 1e-9), strict=True):
        assert from_pinion == pytest.approx(from_wheel, abs=error)
    tilts, approach, _ = from_gears[0]
    assert 5e-3 < np.abs(tilts).max() < 2e-2
    assert np.abs(approach - 1).max() < 1e-3


@pytest.mark.parametrize("flank", [(), fem.ProfileCrowning(5 * um)])
def test_gaps_of_strips_are_means_over_them(flank):
    """Gaps at the middles of strips neglect the curvature: w^2 / (24 rho), here 5 nm."""
    pair = fem.GearPair(paper_gear(flank=flank), paper_gear(flank=flank), a=150 * mm)
    slices, reach, r_b = single_slice(pair, 0.2), np.array([0.4 * mm]), pair.wheel.r_b
    strips = strips_of(slices, reach / WINDOW)
    arcs = slices.closest.roll**2 / (2 * r_b) + reach * np.linspace(-1, 1, 100 * STRIPS + 1)[50::100]
    within = arcs[:, None] + strips.width[0, :, None] * ((np.arange(100) + 0.5) / 100 - 0.5)
    gap = gaps_at(slices, np.sqrt(2 * r_b * within.ravel())).reshape(STRIPS, 100).mean(axis=1)
    assert strips.gap[0] == pytest.approx(gap, abs=1e-12)
    assert np.abs(gaps_at(slices, np.sqrt(2 * r_b * arcs)) - gap).max() > 3e-9


@pytest.mark.parametrize(("z", "x", "beta"), [((12, 150), 0.5, 0.0), ((14, 90), 0.2, 30 * deg), ((57, 57), 0.0, 0.0)])
def test_strips_end_where_the_normal_at_the_mates_tip_corner_meets_the_flank(z, x, beta):
    data = {"m_n": 2 * mm, "b": 20 * mm, "d_bore": 10 * mm, "x": x}
    pair = fem.GearPair(fem.Gear(z=z[0], beta=beta, **data), fem.Gear(z=z[1], beta=-beta, **data))
    for phase in (0.0, 0.3, 0.7):
        position = position_of(pair, phase)
        number, low = (at.ravel() for at in np.meshgrid(position.numbers(), np.linspace(-10, 9, 20) * mm))
        mesh = single_slice(pair, phase).mesh.geometry
        sections = sections_of(mesh, number, low, low + 1 * mm, np.full(low.size, 20 * um))
        start = np.array([first_roll(mesh, at) for at in sections])
        foot = np.array([foot_at(mesh, *point) for point in zip(sections, start, strict=True)])
        beyond, meet = foot - sections["mate_tip"], ~sections["out_of_reach"]
        cut = meet & (start > sections["form"] * (1 + 1e-12))
        assert cut.any()
        assert beyond[cut] == pytest.approx(0, abs=1e-12 * pair.a)
        assert (beyond[meet] <= 1e-12 * pair.a).all()


@given(st.lists(st.floats(1e-2, 10), min_size=1, max_size=12), st.sampled_from([FACES["any"], FACES["equal"]]))
def test_compliance_of_strips_is_positive_definite(lengths, face):
    """Slices of a hundredth to ten times the width of a strip; half-planes clamped at a quarter of all strips."""
    edges = np.append(0, np.cumsum(lengths))
    depth = CAPACITY * STRIPS
    along = along_line(edges, edges[-1], depth, face)
    n = len(lengths)
    ones = np.ones((n, STRIPS))
    local, _ = local_compliance(ones, True, depth, 1 / np.diff(edges), ones, ones)
    compliance = np.zeros((n, STRIPS, n, STRIPS)) + along[:, None, :, None]
    compliance[range(n), :, range(n)] += local
    assert np.linalg.eigvalsh(compliance.reshape(n * STRIPS, -1)).min() > 0
