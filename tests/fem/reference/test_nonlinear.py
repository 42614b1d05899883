"""The nonlinear reference: gaps, balance of the contact, elements, refusals."""

from dataclasses import replace

import numpy as np
import pytest
from contacts import unloaded_te
from mating_gears import deformable_gear, gaps_of, mating, unbalanced_force
from paper_gears import few_teeth, paper_gear
from raw_twin import COARSE, gap_change
from skfem import ElementHex1, ElementHex2, ElementQuad1, ElementQuad2, ElementTriP2
from twins import plane_twin, twin_te

import fem
from fem import Density, nonlinear
from fem.units import mm, um

RELIEF = fem.TipRelief(15 * um, 2.5 * mm)


@pytest.fixture(scope="module")
def problem(paper_pair):
    return nonlinear.static_problem(paper_pair, COARSE, ElementQuad2())


@pytest.mark.parametrize("flank", [(), (RELIEF,)])
def test_gap_at_rest_is_that_of_exact_flanks(flank):
    """Smallest gap over closing against `flank_gap`; the mean under a hat rounds the beginning of the relief."""
    gear = paper_gear(flank=flank)
    pair = fem.GearPair(gear, gear, a=150 * mm)
    gears = mating(pair, deformable_gear(gear, Density(flank=152, tooth=1, rim=1, body=1), ElementQuad2()))
    for phase in (0.0, 0.3, 0.45):
        gaps = gaps_of(gears, phase, 0.0)
        assert (gaps.gap / gaps.closing).min() == pytest.approx(unloaded_te(pair, phase), abs=0.05 * um)


@pytest.mark.parametrize("density", [Density(flank=6), Density(flank=16), Density(flank=12, tooth=20)])
@pytest.mark.parametrize("element", [ElementQuad1(), ElementQuad2(), ElementHex2()])
def test_flanks_have_the_nodes_of_their_elements_and_no_others(density, element):
    """Also where straight edges lie far inside the involute, and where the first layer below the flank is thin."""
    gear = fem.Gear(z=17, x=0.2, m_n=2 * mm, b=10 * mm, d_bore=20 * mm)
    deformable = deformable_gear(gear, replace(density, width=1, teeth=1, behind=1), element, half=True)
    for tooth, flank in deformable.flanks.items():
        across = flank.degree + 1 if element.dim == 3 else 1
        assert flank.nodes.shape == (flank.degree * density.flank + 1, across)
        x, y = deformable.solid.positions[flank.nodes][..., :2].T
        assert np.ptp(np.hypot(x, y), axis=0).max() < 1e-9 * mm
        assert (np.diff(flank.arcs) > 1e-3 * mm).all()
        angle = np.arctan2(-x[0], y[0]) - 2 * np.pi * tooth / gear.z
        assert ((angle > 0) & (angle < np.pi / gear.z)).all()


def test_derivatives_of_the_gaps(problem):
    phase, step, te, gears = 0.3, 1e-3, 5 * um, problem.gears
    u, du = ([1e-6 * np.sin(700 * k * gear.solid.positions + k) for k, gear in enumerate(gears, n)] for n in (1, 3))

    def gaps(error=te, factor=0.0):
        return gaps_of(problem.mating, phase, error, [v + factor * dv for v, dv in zip(u, du, strict=True)])

    change = gap_change(gears, gaps().gradients, du)
    quotient = (gaps(factor=step).gap - gaps(factor=-step).gap) / (2 * step)
    assert quotient == pytest.approx(change, abs=1e-4 * np.abs(change).max())
    ahead, behind = (gaps_of(problem.mating, phase, te + dte) for dte in (1e-9, -1e-9))
    assert (behind.gap - ahead.gap) / 2e-9 == pytest.approx(ahead.closing, rel=1e-5)


def test_gears_in_contact_are_in_balance(problem):
    force, phase = 2000.0, 0.35
    state = nonlinear.equilibrium(problem, phase, force)
    gaps = gaps_of(problem.mating, phase, state.te, state.u, candidates=state.candidates)
    contact_forces = state.contact_forces
    assert gaps.closing @ contact_forces == pytest.approx(force, rel=1e-6)
    assert contact_forces.min() >= 0
    assert gaps.gap.min() > -1e-5 * um
    assert np.abs(contact_forces * gaps.gap).max() < 1e-8 * um * force
    for gear, gradient, u in zip(problem.gears, gaps.gradients, state.u, strict=True):
        load = gear.flank_operator.T @ (contact_forces @ gradient)
        unbalanced = unbalanced_force(gear, load, u).ravel()
        assert np.abs(unbalanced[gear.free]).max() < 1e-5 * np.abs(load).max()


def test_complementarity_of_a_single_spring():
    te, f = nonlinear.complementarity(np.array([[2e-9]]), np.array([3 * um]), np.ones(1), 500.0)
    assert (te, f[0]) == (pytest.approx(4 * um), pytest.approx(500))


def test_identical_gears_give_a_symmetric_curve(problem):
    ahead, behind = (nonlinear.equilibrium(problem, phase, 2000.0).te for phase in (0.3, -0.3))
    assert ahead == pytest.approx(behind, rel=1e-5)


def test_flank_may_begin_on_the_base_circle():
    """As with few teeth whose fillet is given; there the radius of curvature is 0."""
    gear = few_teeth(fillet=0.5 * mm)
    assert gear.roll_form == 0
    pair, twin, phases = fem.GearPair(gear, gear), plane_twin(gear, COARSE, 1), [0.0, 0.3]
    te = nonlinear.static_transmission_error(pair, 30, phases, density=COARSE, progress=False)["te"].values[0]
    assert te == pytest.approx([twin_te(pair, twin, phase, 30 / gear.r_b) for phase in phases], rel=0.03)


def uniform(removed: float, **changes) -> tuple[fem.Gear, fem.Gear]:
    """Small gears from whose flanks a uniform layer is removed."""
    flank = fem.Grid([0.0, 1.0], [-1.0, 1.0], np.full((2, 2), removed))
    sizes = {"m_n": mm, "b": 5 * mm, "flank": (flank,)} | changes
    return tuple(fem.Gear(z=z, x=x, d_bore=0.4 * z * mm, **sizes) for z, x in ((20, 0.2), (40, 0.0)))


def test_material_removed_everywhere_turns_the_gears():
    """Also by more than the gap within which nodes are contact candidates."""
    pairs, options = (fem.GearPair(*uniform(v)) for v in (0.0, 25 * um)), {"density": COARSE, "progress": False}
    te, removed = (nonlinear.static_transmission_error(pair, 2, [0.3, 0.5], **options)["te"].values for pair in pairs)
    assert removed - te == pytest.approx(50 * um, abs=0.05 * um)


def test_all_nodes_that_touch_soft_gears_are_candidates(monkeypatch):
    soft, te = fem.GearPair(*uniform(0.0, material=fem.Material(E=1e9, nu=0.38))), []
    for _ in range(2):
        density = Density(flank=16)
        te.append(nonlinear.static_transmission_error(soft, 0.6, [0.0], density=density, progress=False)["te"].item())
        monkeypatch.setattr("fem.reference.mortar.CANDIDATE_GAP", 1 / 4)
    assert te[0] == pytest.approx(te[1], rel=1e-9)
    assert te[0] > 0.12 * mm


def test_pair_with_its_pitch_point_beside_the_path_of_contact():
    """All contact then lies on the path of recess, or of approach where the other gear drives."""
    wheel, pinion = (
        fem.Gear(z=z, m_n=2 * mm, x=x, b=10 * mm, d_bore=0.8 * z * mm, d_a=d_a * mm)
        for z, x, d_a in ((60, -0.95, 119.8), (30, 0.95, 67.2))
    )
    recess, approach = fem.GearPair(pinion, wheel), fem.GearPair(wheel, pinion)
    assert recess.roll_start > recess.roll_pitch and approach.roll_end < approach.roll_pitch
    options = {"density": Density(flank=24), "progress": False}
    te = nonlinear.static_transmission_error(recess, 50, [0.02, 0.2], **options)["te"].values[0]
    swapped = nonlinear.static_transmission_error(approach, 100, [0.8, 0.98], **options)["te"].values[0]
    assert swapped[::-1] == pytest.approx(te, rel=1e-3)


def test_softer_contact_gives_more(paper_pair):
    hard, *soft = (
        nonlinear.static_transmission_error(paper_pair, 150, [0.0], density=COARSE, penalty=penalty, progress=False)[
            "te"
        ].item()
        for penalty in (np.inf, 1e17, 1e16)
    )
    assert hard < soft[0] < soft[1] < 1.02 * hard


@pytest.mark.slow
def test_default_mesh_resolves_where_reliefs_begin():
    """Relief on the pinion alone, of 15 um: within 10 nm of a finer mesh, where even elements are 40 nm off."""
    pair = fem.GearPair(paper_gear(flank=(RELIEF,)), paper_gear(), a=150 * mm)
    default, even, fine = (
        nonlinear.static_transmission_error(pair, 150, [0.1, 0.7], density=density, progress=False)["te"].values
        for density in (COARSE, replace(COARSE, edges=()), Density(flank=66))
    )
    assert default == pytest.approx(fine, abs=10e-9)
    assert np.abs(even - fine).min() > 20e-9


def test_bad_input_is_refused(paper_pair):
    wider = fem.GearPair(paper_gear(), paper_gear(b=25 * mm), a=150 * mm)
    with pytest.raises(ValueError, match="b of pinion and wheel must be equal"):
        nonlinear.static_transmission_error(wider, 150, 4)
    helical = fem.GearPair(paper_gear(beta=0.1, d_a=156 * mm), paper_gear(beta=-0.1, d_a=156 * mm), a=151 * mm)
    with pytest.raises(ValueError, match="beta must be 0 in plane strain"):
        nonlinear.static_transmission_error(helical, 150, 4)
    pitched, sloped = (
        fem.GearPair(paper_gear(flank=(part,)), paper_gear(), a=150 * mm)
        for part in (fem.PitchDeviation(np.linspace(0, 5 * um, 57)), fem.HelixSlope(5 * um))
    )
    with pytest.raises(ValueError, match="teeth must be alike"):
        nonlinear.static_transmission_error(pitched, 150, 4)
    with pytest.raises(ValueError, match="flanks must be the same across the width"):
        nonlinear.static_transmission_error(sloped, 150, 4)
    with pytest.raises(ValueError, match="element must be one of ElementQuad1"):
        nonlinear.static_transmission_error(wider, 150, 4, element=ElementTriP2())
    for torque in (0, [150, 100], np.inf, 1e9, "150"):
        with pytest.raises(ValueError, match="torque must"):
            nonlinear.static_transmission_error(paper_pair, torque, 4)
    for phases in (2.5, 0, np.nan, [0.5, 0.2], [0.3, 1.0], [[0.1, 0.2]], "a", None):
        with pytest.raises(ValueError, match="phases must"):
            nonlinear.static_transmission_error(paper_pair, 150, phases)
    for penalty in (-1e16, 0.0, np.nan):
        with pytest.raises(ValueError, match="penalty must be > 0"):
            nonlinear.static_transmission_error(paper_pair, 150, 4, penalty=penalty)
    with pytest.raises(ValueError, match=r"density must be a fem\.Density"):
        nonlinear.static_transmission_error(paper_pair, 150, 4, density=fem.Resolution())
    long = fem.Gear(z=17, m_n=2 * mm, b=300 * mm, d_bore=15 * mm, beta=0.6)
    with pytest.raises(ValueError, match=r"z must be at least the \d+ teeth that may touch, got 17; reduce b"):
        nonlinear.static_transmission_error(fem.GearPair(long, replace(long, beta=-0.6)), 150, 4, element=ElementHex1())


def test_linear_elements_approach_quadratic_ones_from_the_stiff_side(paper_pair, problem):
    coarse, fine = (nonlinear.static_problem(paper_pair, COARSE.refined(q), ElementQuad1()) for q in (1, 2))
    te = [nonlinear.equilibrium(model, 0.0, 2000.0).te for model in (coarse, fine, problem)]
    assert te[0] < te[1] < te[2]
    assert te[1] == pytest.approx(te[2], rel=0.025)
