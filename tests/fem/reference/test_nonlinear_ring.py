"""`fem.nonlinear` of pinions in rings: gaps at rest, balance, and the confirmation of compliance and contact."""

from dataclasses import replace

import numpy as np
import pytest
from contacts import contact_of, densities_of
from mating_gears import deformable_gear, gaps_of, mating, unbalanced_force
from raw_twin import balanced, problem_of
from ring_gears import bolted, few_teeth, helical_ring_pair, planet, ring, ring_pair, thin_ring_pair, wind_turbine_stage
from skfem import ElementHex1, ElementHex2, ElementQuad2
from twins import plane_twin, yield_by_bending

import fem
from fem import Density
from fem.units import deg, mm, um

COARSE, MAP_DENSITY = Density(flank=30), fem.Resolution().density
#: Of the reference. Thin layers below the flank govern it: 24 raise te by less than 0.02 % of its mean. Where teeth
#: take over, its elements along the flank do: from 66 to 132, 198, 297 and 396 te rises there by 0.6, 0.2, 0.08 and
#: 0.01 % of its mean with the thin rim; from 66 to 132 and 198 by 0.5 and 0.1 % with the wind turbine, elsewhere by 0.2
#: and 0.02 %.
FINE = Density(flank=132, fillet=6, land=2, tooth=16, rim=8, body=14)
FINEST = replace(FINE, flank=297)


def plane_te(pair: fem.GearPair, torque: float, phases, density: Density = MAP_DENSITY) -> np.ndarray:
    """(n_phase,) te [m] by compliance and contact in plane strain, on the mesh of a map."""
    gears = zip((pair.pinion, pair.wheel), densities_of(pair, density), strict=True)
    twins = tuple(plane_twin(gear, of_gear, 2) for gear, of_gear in gears)
    nearest = [phase - round(phase) for phase in phases]
    return np.array([contact_of(pair, twins, phase, 1).state(torque / pair.pinion.r_b).te for phase in nearest])


def test_gaps_at_rest_vanish_where_rigid_flanks_touch():
    problem = problem_of(ring_pair(), Density(flank=60, tooth=1, rim=1, body=1), ElementQuad2())
    for phase in (0.0, 0.3, 0.45):
        gaps = gaps_of(problem.mating, phase, 0.0)
        assert (gaps.gap / gaps.closing).min() == pytest.approx(0.0, abs=0.05 * um)


@pytest.mark.parametrize(
    ("pair", "density", "element"),
    [
        (ring_pair(), COARSE, ElementQuad2()),
        (helical_ring_pair(), Density(flank=10, fillet=1, tooth=1, rim=1, body=1, width=3), ElementHex1()),
    ],
)
def test_both_gears_are_in_balance(pair, density, element):
    force, phase = 2000.0, 0.35
    problem = problem_of(pair, density, element)
    state = balanced(problem, phase, force)
    gaps = gaps_of(problem.mating, phase, state.te, state.u, candidates=state.candidates)
    assert gaps.closing @ state.contact_forces == pytest.approx(force, rel=1e-6)
    for deformable, gradient, u, gear in zip(
        problem.gears, gaps.gradients, state.u, (pair.pinion, pair.wheel), strict=True
    ):
        load = (deformable.flank_operator.T @ (state.contact_forces @ gradient)).reshape(u.shape)
        unbalanced = unbalanced_force(deformable, load, u).ravel()
        assert np.abs(unbalanced[deformable.free]).max() < 1e-5 * np.abs(load).max()
        x, y = deformable.solid.positions[:, :2].T
        assert (x * load[:, 1] - y * load[:, 0]).sum() == pytest.approx(-force * gear.r_b, rel=1e-3)
        if element.dim == 3:
            thrust = gear.sign * force * np.tan(gear.beta_b)
            assert load[:, 2].sum() == pytest.approx(thrust, rel=1e-3)


def test_compliance_and_contact_are_near_on_a_coarse_mesh():
    phases = [0.0, 0.5]
    pair = ring_pair()
    nonlinear = fem.nonlinear.static_transmission_error(pair, 50, phases, density=COARSE, progress=False)
    assert plane_te(pair, 50, phases) == pytest.approx(nonlinear["te"].values[0], rel=0.02)


def thin_rim() -> fem.GearPair:
    """ISMA 2016: 39 teeth in 99, the rim 2.25 modules thick."""
    return fem.GearPair(planet(39, 0.1), ring(-99, 0.1, height=0.9, rim=2.25))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "pair", "torque", "density"),
    [
        ("thin rim, z 39/-99", thin_rim(), (60, 200), FINEST),
        ("few teeth, z 17/-52", few_teeth(), (80, 250), FINE),
        ("NREL, z 36/-93", wind_turbine_stage(), (1e5, 2e5), FINE),
    ],
)
def test_nonlinear_statics_confirm_the_compliance_of_rings(name, pair, torque, density, measured):
    """In plane strain: mean 0.2 %, any phase 0.35 % of the mean, peak to peak 0.5 % of it or 0.15 % of the mean."""
    phases, options = np.arange(12) / 12, {"density": density, "progress": False}
    reference = fem.nonlinear.static_transmission_error(pair, torque, phases, **options)["te"].values
    for load, expected in zip(torque, reference, strict=True):
        te = plane_te(pair, load, phases)
        swings = np.ptp(te), np.ptp(expected)
        numbers = [f"{curve.mean() / um:.3f} / {np.ptp(curve) / um:.3f}" for curve in (te, expected)]
        measured.cells(f"ring in plane strain, {name}, {load:g} N m", *numbers)
        assert te.mean() == pytest.approx(expected.mean(), rel=2e-3)
        assert np.abs(te - expected).max() < 3.5e-3 * expected.mean()
        assert abs(swings[0] - swings[1]) < max(5e-3 * swings[1], 1.5e-3 * expected.mean())


@pytest.mark.slow
def test_nonlinear_statics_in_space_confirm_a_ring(measured):
    """Quadratic hexahedra; what so coarse a section lacks is taken from plane strain."""
    pair, torque, phases = ring_pair(), 50.0, np.arange(6) / 6
    force = torque / pair.pinion.r_b
    density = Density(flank=24, fillet=3, tooth=3, rim=3, body=4, width=3, teeth=2, behind=1)
    space, plane = (problem_of(pair, density, element) for element in (ElementHex2(), ElementQuad2()))
    te = plane_te(pair, torque, phases)
    te += [balanced(space, phase, force).te - balanced(plane, phase, force).te for phase in phases]
    ste = fem.static_transmission_error(pair, torque, phases, progress=False)["te"].values[0]
    numbers = [f"{curve.mean() / um:.3f} / {np.ptp(curve) / um:.3f}" for curve in (ste, te)]
    measured.cells(f"ring in space, z 23/-71, {torque:g} N m", *numbers)
    assert ste.mean() == pytest.approx(te.mean(), rel=2e-3)
    assert np.abs(ste - te).max() < 3.5e-3 * te.mean()
    assert np.ptp(ste) == pytest.approx(np.ptp(te), rel=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("first", [0.0, 0.55])
def test_nonlinear_statics_confirm_a_rim_that_bends_on_bolts(first, measured):
    """Rim of 2.25 modules, all teeth meshed, bolts as springs, in plane strain: any phase within 0.5 %."""
    pair, phases = thin_ring_pair(bolted(first=first)), [-0.3, 0.0, 0.3]
    options = {"density": Density(flank=32), "progress": False}
    phases = np.sort(np.array(phases) % 1)
    expected = fem.nonlinear.static_transmission_error(pair, 40, phases, **options)["te"].values[0]
    te = plane_te(pair, 40, phases)
    measured.cells(f"ring on bolts from {first} rad", *(f"{curve.mean() / um:.3f}" for curve in (te, expected)))
    assert te == pytest.approx(expected, rel=5e-3)


@pytest.mark.slow
def test_nonlinear_statics_in_space_confirm_a_rim_on_bolts(measured):
    """As a ring in space above; bolts act on the mean displacement of the rim across the face: within 0.5 %."""
    pair, torque, phases = thin_ring_pair(bolted()), 40.0, [0.0, 0.3]
    force, pitch = torque / pair.pinion.r_b, 2 * np.pi / abs(pair.wheel.z)
    density = Density(flank=8, fillet=1, tooth=1, rim=1, body=2, width=2, teeth=2, behind=1)
    space, plane = (problem_of(pair, density, element) for element in (ElementHex2(), ElementQuad2()))
    te = plane_te(pair, torque, phases)
    te += [balanced(space, phase, force).te - balanced(plane, phase, force).te for phase in phases]
    options = {"stations": 2, "progress": False}
    ste = [fem.load_distribution(pair, torque, [x], ring_angle=x * pitch, **options)["te"].values[0, 0] for x in phases]
    measured("ring on bolts in space, z 19/-53, 40 N m, two phases", np.abs(np.array(ste) / te - 1).max(), 5e-3)


def test_whole_face_of_a_spur_ring_on_bolts_is_twice_its_half():
    pair = thin_ring_pair(bolted())
    density = Density(flank=6, fillet=1, tooth=1, rim=1, body=1, width=1, teeth=1, behind=1)
    all_teeth, te = density.with_teeth(abs(pair.wheel.z), behind=0), []
    for half in (True, False):
        pinion = deformable_gear(pair.pinion, density, ElementHex1(), half=half)
        problem = fem.nonlinear.contact_problem(
            mating(pair, pinion, deformable_gear(pair.wheel, all_teeth, ElementHex1(), half=half))
        )
        te.append(balanced(problem, 0.2, 40 / pair.pinion.r_b).te)
    assert te[1] == pytest.approx(te[0], rel=1e-6)


def even_load(deformable) -> np.ndarray:
    """(n_dofs, dim) unit force into the flank of tooth 0, even along the profile and across the width."""
    flank, gear = deformable.flanks[0], deformable.flanks[0].gear
    along = flank.shapes.integrate(*flank.arcs[[0, -1]]) / np.ptp(flank.arcs)
    across = flank.width.weights @ flank.width.shapes / flank.width.weights.sum()
    angle = np.pi / 2 + gear.psi_b - np.sqrt(2 * flank.arcs / gear.r_b)
    normal = np.cos(gear.beta_b) * np.stack([-np.sin(angle), np.cos(angle)])
    force, number = np.einsum("cn,n,k->nkc", normal, along, across).ravel(), list(deformable.flanks).index(0)
    on_flanks = np.zeros(deformable.flank_operator.shape[0])
    on_flanks[number * force.size : (number + 1) * force.size] = force
    return (deformable.flank_operator.T @ on_flanks).reshape(deformable.solid.positions.shape)


def yield_of_solid(gear: fem.Gear, density: Density) -> float:
    """Displacement of the flank under its `even_load` [m/N], on hexahedra over the whole face."""
    deformable = deformable_gear(gear, density, ElementHex2())
    load = even_load(deformable)
    return float((load * deformable.solver()(load[..., None])[..., 0]).sum())


@pytest.mark.slow
@pytest.mark.parametrize("beta", [0.0, 10 * deg])
def test_solids_on_bolts_yield_as_a_map_says(beta, measured):
    """All teeth on hexahedra, against one pitch and harmonics of the rim: within 0.4 %, spur and helical."""
    d = 53 / np.cos(beta)
    sizes = {"beta": beta, "d_a": (d - 1.4) * 2 * mm, "d_rim": (d + 7.2) * 2 * mm}
    clamped, on_bolts = (ring(-53, -0.1, support=support, **sizes) for support in ((), bolted()))
    density = Density(flank=4, fillet=1, tooth=1, rim=1, body=1, width=1, teeth=1, behind=1)
    added = yield_of_solid(on_bolts, density.with_teeth(53, behind=0)) - yield_of_solid(clamped, density)
    row = "bending of a spur and of a helical ring on bolts in space, z -53"
    measured(row, abs(yield_by_bending(on_bolts, density) / added - 1), 4e-3)
