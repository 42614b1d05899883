"""Explicit time integration: contact and equilibria of the implicit methods, energy, friction, stability."""

from dataclasses import replace

import numpy as np
import pytest
from mating_gears import deformable_gear, gaps_of, mating, unbalanced_force
from paper_gears import few_teeth, paper_pair
from skfem import ElementQuad1

import fem
from fem import Density, dynamic, explicit, nonlinear
from fem.reference.penalty_contact import (
    ContactLaw,
    MovingGear,
    RelativePose,
    ToothPair,
    add_contact_forces,
    flank_arrays,
    tooth_pair_table,
)
from fem.units import mm, rpm, um

COARSE = Density(flank=12, fillet=2, tooth=2, rim=2, body=3, teeth=1, behind=1)
PENALTY = 1e16


FROM_BASE_CIRCLE = fem.GearPair(few_teeth(fillet=0.5 * mm), few_teeth(fillet=0.5 * mm))


@pytest.fixture(scope="module", params=[paper_pair(), FROM_BASE_CIRCLE], ids=["paper", "from base circle"])
def relieved(request):
    """Mating gears of a relieved pair and displacements that press them together."""
    gear = replace(request.param.pinion, flank=(fem.TipRelief(15 * um, 2.5 * mm),))
    deformable = deformable_gear(gear, COARSE, ElementQuad1())
    u = [1e-6 * np.sin(700 * k * deformable.solid.positions + k) for k in (1, 2)]
    pair = fem.GearPair(gear, gear, a=request.param.a)
    return mating(pair, deformable, wheel_share=1.0), u


def contact(gears, u, v, spins, phase, law):
    """Contact forces on both gears, torques on their hubs, energy and lost power."""
    force, torque, energy, lost_power = [np.zeros_like(x) for x in u], np.zeros(2), 0.0, 0.0
    motions = zip(map(flank_arrays, gears.gears), u, v, force, spins, strict=True)
    moving, placed = [MovingGear(*motion) for motion in motions], gears.placements(phase, 20 * um)
    for row in tooth_pair_table(gears, phase):
        tooth_pair = ToothPair(*row.tolist())
        sides = [tooth_pair.slave, 1 - tooth_pair.slave]
        slave, master = (placed[side] for side in sides)
        dx = (slave.centre - master.centre)[0]
        pose = RelativePose(
            dx * np.cos(master.rotation), -dx * np.sin(master.rotation), slave.rotation - master.rotation
        )
        friction = np.zeros(moving[0].flanks.arcs.size)
        *torques, stored, slip = add_contact_forces(*(moving[side] for side in sides), tooth_pair, pose, law, friction)
        torque[sides] += torques
        energy, lost_power = energy + stored, lost_power + slip
    return force, torque, energy, lost_power


def test_compiled_contact_is_that_of_the_mortar_method(relieved):
    """Pressure is penalty times the penetrations of `mortar`; forces and torque follow from their derivatives."""
    gears, u = relieved
    still = [np.zeros_like(x) for x in u]
    forces, torque, energy, _ = contact(gears, u, still, (0.0, 0.0), 0.3, ContactLaw(PENALTY, 0.0, 1e-7))
    gaps = gaps_of(gears, 0.3, 20 * um, u)
    f = PENALTY * gaps.area * np.maximum(-gaps.gap, 0)
    assert energy == pytest.approx((f**2 / (2 * PENALTY * gaps.area)).sum(), rel=1e-3)
    assert torque[1] == pytest.approx(-gaps.closing @ f * gears.pair.wheel.r_b, rel=1e-3)
    for gear, gradient, force in zip(gears.gears, gaps.gradients, forces, strict=True):
        assert gear.flank_operator @ force.ravel() == pytest.approx(f @ gradient, abs=1e-3 * np.abs(force).max())


def test_contact_forces_on_both_gears_balance(relieved):
    """Torques except for the gap between the points that touch, which is a lever of the friction."""
    gears, u = relieved
    v = [1e-3 * np.cos(500 * x + 1e3) for x in u]
    forces, torque, _, lost_power = contact(gears, u, v, (1.0, -1.0), 0.3, ContactLaw(PENALTY, 0.3, 1e-4))
    placed = gears.placements(0.3, 20 * um)
    pinion, wheel = (
        complex(*force.sum(axis=0)) * np.exp(1j * gear.rotation) for force, gear in zip(forces, placed, strict=True)
    )
    assert pinion == pytest.approx(-wheel, rel=1e-9)
    assert torque[0] + torque[1] + gears.pair.a * wheel.imag == pytest.approx(0, abs=0.7 * um * abs(wheel))
    assert lost_power > 0


def test_stable_steps_add_no_mass_and_longer_steps_do(relieved):
    gear = relieved[0].gears[0]
    stable = 2 * np.sqrt(gear.masses / explicit.stiffness_bound(gear, PENALTY)).min()
    natural = gear.masses.sum()
    assert explicit.rotor(gear, explicit.CentralDifferences(stable)).mass.sum() == pytest.approx(natural, rel=1e-12)
    assert explicit.rotor(gear, explicit.CentralDifferences(30 * stable)).mass.sum() > 1.05 * natural


def test_reliefs_add_no_small_elements_that_would_need_more_mass(short):
    relieved = replace(paper_pair().pinion, flank=(fem.TipRelief(15 * um, 2.5 * mm),))
    pair, run = fem.GearPair(relieved, relieved, a=150 * mm), dynamic.RunUp(20 * rpm, 0.02, 0.03, 0.001, steps=200)
    result = explicit.transmission_error(
        pair, 150, run, explicit.CentralDifferences(1e-6), density=COARSE, progress=False
    )
    assert result.attrs["added_mass"] == pytest.approx(short.attrs["added_mass"], rel=1e-9)


def run_at(speed: float, start: float, stop: float, run_up: float = 0.06, steps: int = 200, **options):
    run = dynamic.RunUp(speed, start, stop, run_up, steps=steps)
    return explicit.transmission_error(
        paper_pair(), 150, run, explicit.CentralDifferences(**options), density=COARSE, progress=False
    )


def static(result, steps: np.ndarray) -> np.ndarray:
    """Equilibria at time steps with the same penalty, under the present viscous load."""
    problem = nonlinear.static_problem(paper_pair(), COARSE, ElementQuad1(), penalty=PENALTY, wheel_share=1.0)
    force = result["torque"].values / problem.pair.pinion.r_b
    return np.array([nonlinear.equilibrium(problem, result["phase"].values[step], force[step]).te for step in steps])


@pytest.fixture(scope="module")
def short():
    """A few hundredths of a pitch behind the pitch point, in single tooth contact."""
    return run_at(20 * rpm, 0.02, 0.14, step=1e-6)


@pytest.fixture(scope="module")
def rubbing():
    """With friction, behind and before the pitch point."""
    return [run_at(20 * rpm, start, start + 0.12, step=1e-6, friction=0.3) for start in (0.02, -0.24)]


def energy_error(result) -> np.ndarray:
    """Energy minus the work of the hub plus all work that left the system [J]."""
    work = result["work"].values
    return result["energy"].values.sum(axis=1) - work[:, 0] + work[:, 1:].sum(axis=1)


def test_slow_gears_pass_through_static_equilibria(short):
    settled = np.flatnonzero(short["phase"].values > 0.09)
    te = short["te"].values[settled]
    assert te.mean() == pytest.approx(static(short, settled).mean(), rel=3e-3)


def test_energy_is_conserved(short, rubbing):
    for result in (short, *rubbing):
        assert np.abs(energy_error(result)).max() < 2e-3 * result["energy"].values.sum(axis=1).max()


def test_energy_is_balanced_with_damping():
    """Damping acts relative to steady rotation; the wheel turns more slowly while the teeth deflect."""
    run = dynamic.RunUp(20 * rpm, 0.02, 0.14, 0.06, steps=200, damping=5000.0)
    result = explicit.transmission_error(
        paper_pair(), 150, run, explicit.CentralDifferences(1e-6), density=COARSE, progress=False
    )
    stored = result["energy"].values.sum(axis=1).max()
    assert np.abs(energy_error(result)).max() < 2e-3 * stored
    assert np.abs(result["work"].values[:, 2]).max() > 5e-3 * stored


def test_gears_that_separate_by_more_than_their_backlash_are_refused():
    gear = fem.Gear(z=30, m_n=2 * mm, b=10 * mm, d_bore=30 * mm)
    run = dynamic.RunUp(1000 * rpm, -0.3, 0.3, 0.1)
    with pytest.raises(RuntimeError, match=r"have parted by .* their backlash is .*: take a longer run_up"):
        explicit.transmission_error(
            fem.GearPair(gear, gear), 5, run, explicit.CentralDifferences(1e-6), density=COARSE, progress=False
        )


def test_friction_changes_the_normal_force_with_the_sense_of_sliding(rubbing):
    """Behind the pitch point it drives the wheel, before it brakes: rigid wheel F (r_b +- mu rho) = torque."""
    pair = paper_pair()
    for result, sign in zip(rubbing, (1, -1), strict=True):
        late = result["phase"].values > result["phase"].values[-1] - 0.04
        phase, time, work = (result[name].values[late] for name in ("phase", "time", "work"))
        sliding = 2 * 20 * rpm * pair.p_bt * np.abs(phase)
        force = (work[-1, 3] - work[0, 3]) / (0.3 * np.trapezoid(sliding, time))
        rho = pair.wheel.r_b * np.tan(pair.alpha_wt) - phase.mean() * pair.p_bt
        assert force == pytest.approx(150 / (pair.wheel.r_b + sign * 0.3 * rho), rel=0.03)


def test_little_friction_changes_little(short):
    little = run_at(20 * rpm, 0.02, 0.05, 0.02, step=1e-6, friction=1e-4)
    smooth = run_at(20 * rpm, 0.02, 0.05, 0.02, step=1e-6)
    assert little["te"].values == pytest.approx(smooth["te"].values, rel=1e-4)
    assert smooth["work"].values[-1, 3] == 0 < little["work"].values[-1, 3]


def static_with_friction(problem, phase: float, force: float, mu: float) -> float:
    """Transmission error where each node also pulls along the flank by mu times its force, against the sliding."""
    gears, te = problem.gears, 0.0
    candidates, u = problem.mating.candidates(phase), [gear.undeformed() for gear in gears]
    signs = [np.full(c.quadrature.nodes.size, np.sign(phase + c.teeth[0])) for c in candidates]
    sliding = np.concatenate(signs)
    f = 0 * sliding
    for _ in range(40):
        gaps, residual = gaps_of(problem.mating, phase, te, u, candidates=candidates), []
        for gear, gradient, v in zip(gears, gaps.gradients, u, strict=True):
            normal = gradient.reshape(len(gradient), -1, 2)
            along = np.stack([-normal[..., 1], normal[..., 0]], axis=-1).reshape(gradient.shape)
            pull = gear.flank_operator.T @ ((mu * sliding * f) @ along)
            residual.append(unbalanced_force(gear, pull, v))
        (x, y), (pull_x, pull_y) = (gears[1].solid.positions + u[1]).T, pull.reshape(-1, 2).T
        driving = (x * pull_y - y * pull_x).sum() / problem.pair.wheel.r_b
        te, du, f = nonlinear.newton_step(problem, gaps, te, residual, force + driving)
        u = [v + dv for v, dv in zip(u, du, strict=True)]
        if max(np.abs(dv).max() for dv in du) < 1e-6 * np.abs(u[0]).max():
            return te
    raise AssertionError("friction did not converge")


@pytest.mark.slow
def test_friction_changes_te_as_in_statics_with_coulomb_forces():
    """Less before the pitch point, more behind it, while the normal force does the opposite."""
    result = run_at(10 * rpm, -0.3, 0.2, 0.08, step=1e-6, friction=0.3)
    problem = nonlinear.static_problem(paper_pair(), COARSE, ElementQuad1(), penalty=PENALTY, wheel_share=1.0)
    changes = []
    torque, phase, te = (result[name].values for name in ("torque", "phase", "te"))
    for low, high in ((-0.16, -0.04), (0.06, 0.18)):
        steps = np.flatnonzero((phase > low) & (phase < high))[::2]
        states = [(problem, phase[i], torque[i] / problem.pair.pinion.r_b) for i in steps]
        rubbing = np.mean([static_with_friction(*state, 0.3) for state in states])
        smooth = np.mean([nonlinear.equilibrium(*state).te for state in states])
        assert te[steps].mean() == pytest.approx(rubbing, rel=2e-3)
        changes.append(te[steps].mean() / smooth - 1)
    assert changes[0] < -0.005 and changes[1] > 0.005


@pytest.mark.slow
def test_a_cycle_at_10_rpm_is_the_static_curve():
    """Except for ringing after kinks of the coarse mesh, which may fall on a peak: te = gain static + ringing."""
    result = run_at(10 * rpm, -0.65, 0.5, 0.15, steps=400, step=5e-7)
    cycle = np.flatnonzero(result["phase"].values > result["phase"].values[-1] - 1 + 1e-9)
    te, expected = result["te"].values[cycle], static(result, cycle)
    assert te.mean() == pytest.approx(expected.mean(), rel=3e-3)
    gain = np.polyfit(expected, te, 1)[0]
    assert gain == pytest.approx(1, abs=3e-3)
    assert (te - gain * expected).std() < 5e-3 * np.ptp(expected)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: explicit.CentralDifferences(step=0), "step must be > 0"),
        (lambda: explicit.CentralDifferences(penalty=-1), "penalty must be > 0"),
        (lambda: explicit.CentralDifferences(friction=2), "friction must lie"),
        (lambda: explicit.CentralDifferences(step=np.inf), "step must be > 0 and finite"),
        (lambda: explicit.CentralDifferences(penalty="stiff"), "penalty must be one real number"),
        (lambda: explicit.transmission_error(paper_pair(), 0.0), "torque must be > 0"),
        (lambda: explicit.transmission_error(paper_pair(), np.inf), "torque must be finite"),
        (
            lambda: explicit.transmission_error(paper_pair(), 150, scheme={"step": 1e-6}),
            "scheme must be a fem.explicit",
        ),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
