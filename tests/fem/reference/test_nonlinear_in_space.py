"""The nonlinear reference on the whole face width: helical pairs, and flanks whose two halves differ."""

from dataclasses import replace

import numpy as np
import pytest
from helical_gears import helical
from mating_gears import deformable_gear, gaps_of, mating
from paper_gears import paper_gear
from raw_twin import RawTwin, gap_change
from skfem import ElementHex1, ElementHex2

import fem
from fem import Density, nonlinear
from fem.units import deg, mm, um

COARSE = Density(flank=10, fillet=1, tooth=1, rim=1, body=1, width=3, teeth=1, behind=1)


@pytest.fixture(scope="module")
def pair() -> fem.GearPair:
    return fem.GearPair(helical(1), helical(-1), a=150 * mm)


@pytest.fixture(scope="module")
def problem(pair):
    return nonlinear.static_problem(pair, COARSE, ElementHex1())


@pytest.mark.parametrize("element", [ElementHex1(), ElementHex2()])
def test_flanks_follow_the_helix(element):
    gear = helical(-1)
    deformable = deformable_gear(gear, COARSE, element)
    for tooth, flank in deformable.flanks.items():
        assert flank.nodes.shape == (flank.degree * 10 + 1, flank.degree * 6 + 1)
        x, y, z = deformable.solid.positions[flank.nodes].transpose(2, 0, 1)
        assert z == pytest.approx(np.tile(flank.width.nodes, (len(z), 1)), abs=1e-9)
        chord = np.diff(flank.width.nodes).max() * flank.degree * gear.twist
        sagitta = gear.r_a * chord**2 / 8 if flank.degree == 2 else 0.0
        assert np.ptp(np.hypot(x, y), axis=1).max() == pytest.approx(sagitta, rel=0.01, abs=1e-12)
        turned = np.unwrap(np.arctan2(-x, y) - 2 * np.pi * tooth / gear.z, axis=1)
        assert turned == pytest.approx(turned[:, [0]] + np.tan(gear.beta) / gear.r * (z - z[:, [0]]), abs=1e-6)


def test_derivatives_of_the_gaps(problem):
    phase, step, gears = 0.3, 1e-3, problem.gears
    assert {candidate.slave for candidate in problem.mating.candidates(phase)} == {0, 1}
    u, du = ([1e-6 * np.sin(500 * k * gear.solid.positions + k) for k, gear in enumerate(gears, n)] for n in (1, 3))

    def gaps(factor=0.0):
        return gaps_of(problem.mating, phase, 5 * um, [v + factor * dv for v, dv in zip(u, du, strict=True)])

    change = gap_change(gears, gaps().gradients, du)
    quotient = (gaps(step).gap - gaps(-step).gap) / (2 * step)
    assert quotient == pytest.approx(change, abs=1e-4 * np.abs(change).max())


def test_gear_that_moves_along_its_axis_turns_in_the_transverse_plane(pair, problem):
    """By tan(beta_b) on the line of action at every point; the wheel, of the other hand, turns the other way."""
    phase, axial = 0.2, 3 * um
    for side, sign in ((0, -1), (1, 1)):
        gears = replace(problem.mating, wheel_share=side)
        u = [gear.undeformed() for gear in gears.gears]
        u[side][:, 2] = axial
        along, turned = gaps_of(gears, phase, 0.0, u), gaps_of(gears, phase, sign * axial * np.tan(pair.beta_b))
        assert along.gap == pytest.approx(turned.gap, abs=1e-9)


def test_helical_gears_in_contact_are_in_balance(pair, problem):
    """Torques are those of the mesh force, thrusts are the mesh force times tan(beta_b)."""
    force, phase = 2000.0, 0.35
    state = nonlinear.equilibrium(problem, phase, force)
    gaps = gaps_of(problem.mating, phase, state.te, state.u, candidates=state.candidates)
    assert gaps.closing @ state.contact_forces == pytest.approx(force, rel=1e-6)
    assert state.contact_forces.min() >= 0
    assert gaps.gap.min() > -1e-5 * um
    gears = (pair.pinion, pair.wheel)
    for deformable, gradient, u, gear in zip(problem.gears, gaps.gradients, state.u, gears, strict=True):
        load = (deformable.flank_operator.T @ (state.contact_forces @ gradient)).reshape(u.shape)
        x, y = deformable.solid.positions[:, :2].T
        torque, thrust = (x * load[:, 1] - y * load[:, 0]).sum(), load[:, 2].sum()
        assert torque == pytest.approx(-force * gear.r_b, rel=1e-3)
        assert thrust == pytest.approx(-torque * np.tan(gear.beta_b) / gear.r_b, rel=1e-9)


def test_mirrored_gears_give_a_symmetric_curve(problem):
    ahead, behind = (nonlinear.equilibrium(problem, phase, 2000.0).te for phase in (0.3, -0.3))
    assert ahead == pytest.approx(behind, rel=1e-6)


def test_exchanged_hands_give_the_same(pair, problem):
    swapped = nonlinear.static_problem(fem.GearPair(pair.wheel, pair.pinion, a=pair.a), COARSE, ElementHex1())
    assert nonlinear.equilibrium(swapped, 0.2, 2000.0).te == pytest.approx(
        nonlinear.equilibrium(problem, 0.2, 2000.0).te, rel=1e-6
    )


def test_whole_width_of_a_spur_pair_is_twice_its_half(paper_pair):
    half = nonlinear.static_problem(paper_pair, COARSE, ElementHex1())
    gear = deformable_gear(paper_pair.pinion, COARSE, ElementHex1())
    whole = nonlinear.contact_problem(mating(paper_pair, gear))
    assert (half.gears[0].face.share, gear.face.share) == (0.5, 1.0)
    assert nonlinear.equilibrium(whole, 0.2, 2000.0).te == pytest.approx(
        nonlinear.equilibrium(half, 0.2, 2000.0).te, rel=1e-6
    )


def sloped_pair(*slopes: float) -> fem.GearPair:
    return fem.GearPair(*(paper_gear(flank=(fem.HelixSlope(slope),)) for slope in slopes), a=150 * mm)


def test_helix_slopes_of_both_gears_add_up():
    """Opposite slopes cancel; either sign has the same effect, and either gear."""
    cancelled, on_pinion, negative, on_wheel, plain = (
        nonlinear.equilibrium(nonlinear.static_problem(sloped_pair(*slopes), COARSE, ElementHex1()), 0.2, 2000.0).te
        for slopes in ((8 * um, -8 * um), (8 * um, 0), (-8 * um, 0), (0, 8 * um), (0, 0))
    )
    assert on_pinion == pytest.approx(negative, rel=1e-6)
    assert on_pinion == pytest.approx(on_wheel, rel=1e-3)
    assert cancelled == pytest.approx(plain, rel=1e-6)
    assert abs(on_pinion - cancelled) > 0.1 * um


def test_high_overlap_takes_more_teeth():
    gear = fem.Gear(z=30, m_n=2 * mm, b=28 * mm, d_bore=30 * mm, beta=30 * deg)
    wide = fem.GearPair(gear, replace(gear, beta=-gear.beta))
    assert 3 < wide.eps_alpha + wide.eps_beta < 4
    assert list(nonlinear.static_problem(wide, COARSE, ElementHex1()).gears[0].flanks) == [-2, -1, 0, 1, 2]


@pytest.mark.slow
def test_helical_hexahedra_are_their_linear_twin(pair):
    """Large displacements and contact of the moved flanks against an independent linear solve at rest."""
    density = replace(COARSE, flank=16, width=4)
    problem = nonlinear.static_problem(pair, density, ElementHex1())
    twin = RawTwin(problem, density)
    force = 350 / pair.pinion.r_b
    for phase in (0.0, 0.25, 0.5):
        assert nonlinear.equilibrium(problem, phase, force).te == pytest.approx(twin.te(phase, force), rel=2e-3)


def linearized_te(problem: nonlinear.ContactProblem, phase: float, force: float) -> float:
    """Transmission error by the flexibility of the flanks, linearized about gears that are turned by it."""
    te = 0.0
    for _ in range(2):
        gaps = gaps_of(problem.mating, phase, te)
        matrix = sum(nonlinear.gap_flexibility(*side) for side in zip(gaps.gradients, problem.flexibility, strict=True))
        te = nonlinear.complementarity(matrix, gaps.gap + gaps.closing * te, gaps.closing, force)[0]
    return te


def coupling_next_teeth_only(problem: nonlinear.ContactProblem) -> nonlinear.ContactProblem:
    """The problem without the coupling of teeth two pitches apart."""
    coupled = []
    for gear, flexibility in zip(problem.gears, problem.flexibility, strict=True):
        teeth = np.repeat(list(gear.flanks), len(flexibility) // len(gear.flanks))
        coupled.append(np.where(np.abs(np.subtract.outer(teeth, teeth)) > 1, 0.0, flexibility))
    return replace(problem, flexibility=tuple(coupled))


@pytest.mark.slow
def test_helical_pair_on_hexahedra_confirms_the_compliance(pair):
    """No coupling between teeth is left out; that of teeth two pitches apart is the same by both methods.

    It is compared at the pitch point. At 150 N m these elements are too coarse for differences of te over the phase,
    and for the small effect of this coupling at phase 0.2.
    """
    density = Density(flank=12, fillet=2, tooth=2, rim=2, body=3, width=4, teeth=1, behind=1)
    problem, phases = nonlinear.static_problem(pair, density, ElementHex2()), (0.0, 0.2, 0.5)
    next_only = coupling_next_teeth_only(problem)
    for torque, near in ((150, 0.03), (350, 0.01)):
        force = torque / pair.pinion.r_b
        te = np.array([nonlinear.equilibrium(problem, phase, force).te for phase in phases])
        linear, without = ([linearized_te(model, phase, force) for phase in phases] for model in (problem, next_only))
        ste, ste_without = (
            fem.static_transmission_error(pair, torque, phases, resolution=model, progress=False)["te"].values[0]
            for model in (fem.Resolution(), fem.Resolution(neighbours=1))
        )
        assert linear == pytest.approx(te, rel=1e-3)
        assert te == pytest.approx(ste, rel=near)
        far, ste_far = np.subtract(linear, without), ste - ste_without
        assert far[0] == pytest.approx(ste_far[0], rel=0.1)
        assert far[2] == pytest.approx(ste_far[2], abs=1e-6 * um)
    assert te[0] - te[2] == pytest.approx(ste[0] - ste[2], rel=0.04)
