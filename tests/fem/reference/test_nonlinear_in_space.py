"""The nonlinear reference on the whole face width: helical pairs, and flanks whose two halves differ."""

from dataclasses import replace

import numpy as np
import pytest
from helical_gears import helical
from paper_gears import paper_gear
from raw_twin import RawTwin
from skfem import ElementHex1, ElementHex2

import fem
from fem.elasticity.mesh_density import Density
from fem.reference.deformable_gear import clamped
from fem.reference.nonlinear import Meshing, assembled, complementarity, equilibrium, factorized, rows, under_hats
from fem.units import deg, mm, um

COARSE = Density(flank=10, fillet=1, tooth=1, rim=1, body=1, width=3, teeth=1, behind=1)


@pytest.fixture(scope="module")
def pair() -> fem.GearPair:
    return fem.GearPair(helical(1), helical(-1), a=150 * mm)


@pytest.fixture(scope="module")
def meshing(pair):
    return assembled(pair, COARSE, ElementHex1())


@pytest.mark.parametrize("element", [ElementHex1(), ElementHex2()])
def test_flanks_follow_the_helix(element):
    gear = helical(-1)
    body = clamped(gear, COARSE, element, whole=True)
    for tooth, flank in body.flanks.items():
        assert flank.nodes.shape == (flank.degree * 10 + 1, flank.degree * 6 + 1)
        x, y, z = body.solid.places[flank.nodes].transpose(2, 0, 1)
        assert z == pytest.approx(np.tile(flank.width.nodes, (len(z), 1)), abs=1e-9)
        chord = np.diff(flank.width.nodes).max() * flank.degree * gear.twist
        sagitta = gear.r_a * chord**2 / 8 if flank.degree == 2 else 0.0
        assert np.ptp(np.hypot(x, y), axis=1).max() == pytest.approx(sagitta, rel=0.01, abs=1e-12)
        turned = np.unwrap(np.arctan2(-x, y) - 2 * np.pi * tooth / gear.z, axis=1)
        assert turned == pytest.approx(turned[:, [0]] + np.tan(gear.beta) / gear.r * (z - z[:, [0]]), abs=1e-6)


def test_derivatives_of_the_gaps(meshing):
    u, du = ([1e-6 * np.sin(500 * v * b.solid.places + v) for v, b in enumerate(meshing.bodies, k)] for k in (1, 3))
    touches, step, te = meshing.touches(0.3), 1e-3, 5 * um
    assert {touch.own for touch in touches} == {0, 1}
    ahead, behind = (
        rows(meshing, touches, 0.3, te, [a + s * b for a, b in zip(u, du, strict=True)]) for s in (step, -step)
    )
    here = rows(meshing, touches, 0.3, te, u)
    moved = sum(by @ (b.transverse @ v.ravel()) for by, v, b in zip(here.by, du, meshing.bodies, strict=True))
    assert (ahead.gap - behind.gap) / (2 * step) == pytest.approx(moved, abs=1e-4 * np.abs(moved).max())


def test_gear_that_moves_along_its_axis_turns_in_the_transverse_plane(pair, meshing):
    """By tan(beta_b) on the line of action, wherever it touches; the mate, of the other hand, the other way."""
    touches, moved = meshing.touches(0.2), 3 * um
    for side, sign in ((0, -1), (1, 1)):
        meshing, u = replace(meshing, lag=side), [body.rest() for body in meshing.bodies]
        u[side][:, 2] = moved
        along = rows(meshing, touches, 0.2, 0.0, u)
        te = sign * moved * np.tan(pair.beta_b)
        turned = rows(meshing, touches, 0.2, te, [body.rest() for body in meshing.bodies])
        assert along.gap == pytest.approx(turned.gap, abs=1e-9)


def test_helical_gears_in_contact_are_in_balance(pair, meshing):
    """Torques are those of the mesh force, thrusts are it times tan(beta_b)."""
    force, phase = 2000.0, 0.35
    state = equilibrium(meshing, phase, force)
    here = rows(meshing, state.touches, phase, state.te, state.u)
    assert here.closing @ state.f == pytest.approx(force, rel=1e-6)
    assert state.f.min() >= 0
    assert here.gap.min() > -1e-5 * um
    gears = (pair.pinion, pair.wheel)
    for body, by, u, gear in zip(meshing.bodies, here.by, state.u, gears, strict=True):
        load = (body.transverse.T @ (state.f @ by)).reshape(u.shape)
        x, y = body.solid.places[:, :2].T
        torque, thrust = (x * load[:, 1] - y * load[:, 0]).sum(), load[:, 2].sum()
        assert torque == pytest.approx(-force * gear.r_b, rel=1e-3)
        assert thrust == pytest.approx(-torque * np.tan(gear.beta_b) / gear.r_b, rel=1e-9)


def test_mirrored_gears_give_a_symmetric_curve(meshing):
    ahead, behind = (equilibrium(meshing, phase, 2000.0).te for phase in (0.3, -0.3))
    assert ahead == pytest.approx(behind, rel=1e-6)


def test_other_hands_give_the_same(pair, meshing):
    swapped = fem.GearPair(pair.wheel, pair.pinion, a=pair.a)
    other = assembled(swapped, COARSE, ElementHex1())
    assert equilibrium(other, 0.2, 2000.0).te == pytest.approx(equilibrium(meshing, 0.2, 2000.0).te, rel=1e-6)


def test_whole_width_of_a_spur_pair_is_twice_its_half(paper_pair):
    half = assembled(paper_pair, COARSE, ElementHex1())
    body = clamped(paper_pair.pinion, COARSE, ElementHex1(), whole=True)
    whole = factorized(paper_pair, (body, body), (0.0, 0.0), penalty=np.inf, lag=0.5)
    assert (half.bodies[0].share, body.share) == (0.5, 1.0)
    assert equilibrium(whole, 0.2, 2000.0).te == pytest.approx(equilibrium(half, 0.2, 2000.0).te, rel=1e-6)


def sloped_pair(*slopes: float) -> fem.GearPair:
    return fem.GearPair(*(paper_gear(flank=(fem.HelixSlope(slope),)) for slope in slopes), a=150 * mm)


def test_helix_slopes_of_both_gears_add_up():
    """Opposite ones leave nothing; either sign does the same, and either gear."""
    none, one, turned, other = (
        equilibrium(assembled(sloped_pair(*slopes), COARSE, ElementHex1()), 0.2, 2000.0)
        for slopes in ((8 * um, -8 * um), (8 * um, 0), (-8 * um, 0), (0, 8 * um))
    )
    assert one.te == pytest.approx(turned.te, rel=1e-6)
    assert one.te == pytest.approx(other.te, rel=1e-3)
    plain = equilibrium(assembled(sloped_pair(0, 0), COARSE, ElementHex1()), 0.2, 2000.0)
    assert none.te == pytest.approx(plain.te, rel=1e-6)
    assert abs(one.te - none.te) > 0.1 * um


def test_high_overlap_takes_more_teeth():
    gear = fem.Gear(z=30, m_n=2 * mm, b=28 * mm, d_bore=30 * mm, beta=30 * deg)
    wide = fem.GearPair(gear, replace(gear, beta=-gear.beta))
    assert 3 < wide.eps_alpha + wide.eps_beta < 4
    body = assembled(wide, COARSE, ElementHex1()).bodies[0]
    assert list(body.flanks) == [-2, -1, 0, 1, 2]


@pytest.mark.slow
def test_helical_hexahedra_are_their_linear_twin(pair):
    """Large displacements and contact where the flanks are now, against one independent linear solve at rest."""
    density = replace(COARSE, flank=16, width=4)
    meshing = assembled(pair, density, ElementHex1())
    twin = RawTwin(meshing, density)
    force = 350 / pair.pinion.r_b
    for phase in (0.0, 0.25, 0.5):
        assert equilibrium(meshing, phase, force).te == pytest.approx(twin.te(phase, force), rel=2e-3)


def at_rest(meshing: Meshing, phase: float, force: float) -> float:
    """Transmission error by the meshing's flexibility, linear about gears that are turned by it."""
    te, rest = 0.0, tuple(body.rest() for body in meshing.bodies)
    for _ in range(2):
        here = rows(meshing, meshing.touches(phase), phase, te, rest)
        matrix = sum(under_hats(by, flexible) for by, flexible in zip(here.by, meshing.flexible, strict=True))
        te = complementarity(matrix, here.gap + here.closing * te, here.closing, force)[0]
    return te


def moving_next_teeth_only(meshing: Meshing) -> Meshing:
    """Without what teeth two pitches apart do to one another."""
    found = []
    for body, flexible in zip(meshing.bodies, meshing.flexible, strict=True):
        teeth = np.repeat(list(body.flanks), len(flexible) // len(body.flanks))
        found.append(np.where(np.abs(np.subtract.outer(teeth, teeth)) > 1, 0.0, flexible))
    return replace(meshing, flexible=tuple(found))


@pytest.mark.slow
def test_helical_pair_on_hexahedra_confirms_the_compliance(pair):
    """Nothing is left out of what teeth do to one another; those two pitches apart do as much here as in ours.

    That at the pitch point. At 150 N m these elements are too coarse for differences of te over the phase, and for the
    little that far teeth do at phase 0.2.
    """
    density = Density(flank=12, fillet=2, tooth=2, rim=2, body=3, width=4, teeth=1, behind=1)
    meshing, phases = assembled(pair, density, ElementHex2()), (0.0, 0.2, 0.5)
    next_only = moving_next_teeth_only(meshing)
    for torque, near in ((150, 0.03), (350, 0.01)):
        force = torque / pair.pinion.r_b
        te = np.array([equilibrium(meshing, at, force).te for at in phases])
        linear, without = ([at_rest(one, at, force) for at in phases] for one in (meshing, next_only))
        ours, ours_without = (
            fem.static_transmission_error(pair, torque, phases, resolution=model, progress=False)["te"].values[0]
            for model in (fem.Resolution(), fem.Resolution(neighbours=1))
        )
        assert linear == pytest.approx(te, rel=1e-3)
        assert te == pytest.approx(ours, rel=near)
        far, ours_far = np.subtract(linear, without), ours - ours_without
        assert far[0] == pytest.approx(ours_far[0], rel=0.1)
        assert far[2] == pytest.approx(ours_far[2], abs=1e-6 * um)
    assert te[0] - te[2] == pytest.approx(ours[0] - ours[2], rel=0.04)
