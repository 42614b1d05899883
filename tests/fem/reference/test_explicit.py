"""Explicit time integration: the same contact and equilibria as the implicit methods, energy, friction, stability."""

from dataclasses import replace

import numpy as np
import pytest
from paper_gears import few_teeth, paper_pair
from skfem import ElementQuad1

import fem
from fem.elasticity.mesh_density import Density
from fem.reference.deformable_gear import clamped
from fem.reference.explicit import CentralDifferences, numbered, rotor, stable_step, transmission_error
from fem.reference.nonlinear import Meshing, assembled, correction, equilibrium, rows
from fem.reference.penalty_contact import Law, Side, press
from fem.reference.st_venant_kirchhoff import internal_force, strain_energy
from fem.reference.time_integration import RunUp
from fem.units import mm, rpm, um

COARSE = Density(flank=12, fillet=2, tooth=2, rim=2, body=3, teeth=1, behind=1)
PENALTY = 1e16


FROM_BASE_CIRCLE = fem.GearPair(few_teeth(fillet=0.5 * mm), few_teeth(fillet=0.5 * mm))


@pytest.fixture(scope="module", params=[paper_pair(), FROM_BASE_CIRCLE], ids=["paper", "from base circle"])
def relieved(request):
    """Both gears of a relieved pair and displacements that press them together."""
    gear = replace(request.param.pinion, flank=(fem.TipRelief(15 * um, 2.5 * mm),))
    body = clamped(gear, COARSE, ElementQuad1())
    u = [1e-6 * np.sin(700 * k * body.solid.places + k) for k in (1, 2)]
    nothing = np.zeros((body.transverse.shape[0], 0))
    pair = fem.GearPair(gear, gear, a=request.param.a)
    return Meshing(pair, (body, body), (np.zeros_like,) * 2, (nothing,) * 2, lag=1.0), u


def pressed(meshing, u, v, spins, phase, law):
    """Contact forces on both gears, torques on their hubs, energy, power lost, and places of both."""
    gears = [rotor(body, CentralDifferences()) for body in meshing.bodies]
    force, torque, energy, lost = [np.zeros_like(x) for x in u], np.zeros(2), 0.0, 0.0
    sides = [Side(gear.teeth, *motion) for gear, *motion in zip(gears, u, v, force, spins, strict=True)]
    places = meshing.places(phase, 20 * um)
    for touch in numbered(meshing, phase):
        own, mate = touch[0], 1 - touch[0]
        angle = places[mate].angle
        dx = (places[own].centre - places[mate].centre)[0]
        place = dx * np.cos(angle), -dx * np.sin(angle), places[own].angle - angle
        stick = np.zeros(sides[own].teeth.arcs.size)
        one, other, stored, slipped = press(sides[own], sides[mate], touch, place, law, stick)
        torque += np.array([one, other] if own == 0 else [other, one])
        energy, lost = energy + stored, lost + slipped
    return force, torque, energy, lost


def test_compiled_contact_is_that_of_the_mortar_method(relieved):
    """Pressure is penalty times the penetrations of `mortar`; forces and torque follow from their derivatives."""
    meshing, u = relieved
    still = [np.zeros_like(x) for x in u]
    force, torque, energy, _ = pressed(meshing, u, still, (0.0, 0.0), 0.3, Law(PENALTY, 0.0, 1e-7))
    here = rows(meshing, meshing.touches(0.3), 0.3, 20 * um, u)
    f = PENALTY * here.area * np.maximum(-here.gap, 0)
    assert energy == pytest.approx((f**2 / (2 * PENALTY * here.area)).sum(), rel=1e-3)
    assert torque[1] == pytest.approx(-here.closing @ f * meshing.pair.wheel.r_b, rel=1e-3)
    for body, by, one in zip(meshing.bodies, here.by, force, strict=True):
        assert body.transverse @ one.ravel() == pytest.approx(f @ by, abs=1e-3 * np.abs(one).max())


def test_contact_forces_on_both_gears_balance(relieved):
    """Torques but for the gap between the points that touch, along which friction acts."""
    meshing, u = relieved
    v = [1e-3 * np.cos(500 * x + 1e3) for x in u]
    force, torque, _, lost = pressed(meshing, u, v, (1.0, -1.0), 0.3, Law(PENALTY, 0.3, 1e-4))
    turned = [np.array([[np.cos(p.angle), -np.sin(p.angle)], [np.sin(p.angle), np.cos(p.angle)]])
              for p in meshing.places(0.3, 20 * um)]  # fmt: skip
    total = [turn @ one.sum(axis=0) for turn, one in zip(turned, force, strict=True)]
    assert total[0] == pytest.approx(-total[1], rel=1e-9)
    assert torque[0] + torque[1] + meshing.pair.a * total[1][1] == pytest.approx(0, abs=0.7 * um * np.hypot(*total[1]))
    assert lost > 0


def test_strain_energy_is_the_work_of_the_internal_force(relieved):
    body, u = relieved[0].bodies[0], relieved[1][0]
    share, weight = np.polynomial.legendre.leggauss(3)
    along = [(internal_force(body.solid, (1 + s) / 2 * u) * u).sum() / 2 for s in share]
    assert strain_energy(body.solid, u) == pytest.approx(weight @ along, rel=1e-9)


def test_small_steps_need_no_mass_and_long_ones_slow_the_gear(relieved):
    body = relieved[0].bodies[0]
    step = stable_step(body, PENALTY)
    natural = rotor(body, CentralDifferences(step)).mass.sum()
    assert natural == pytest.approx(rotor(body, CentralDifferences(step / 2)).mass.sum(), rel=1e-12)
    assert rotor(body, CentralDifferences(30 * step)).mass.sum() > 1.05 * natural


def test_reliefs_take_no_small_elements_that_would_need_more_mass(short):
    relieved = replace(paper_pair().pinion, flank=(fem.TipRelief(15 * um, 2.5 * mm),))
    pair, run = fem.GearPair(relieved, relieved, a=150 * mm), RunUp(20 * rpm, 0.02, 0.03, 0.001, steps=200)
    found = transmission_error(pair, 150, run, CentralDifferences(1e-6), density=COARSE, progress=False)
    assert found.attrs["added_mass"] == pytest.approx(short.attrs["added_mass"], rel=1e-9)


def ran(speed: float, start: float, stop: float, run_up: float = 0.06, steps: int = 200, **options):
    run = RunUp(speed, start, stop, run_up, steps=steps)
    return transmission_error(paper_pair(), 150, run, CentralDifferences(**options), density=COARSE, progress=False)


def static(found, at: np.ndarray) -> np.ndarray:
    """Equilibria at time steps at with the same penalty, under the viscous load of the moment."""
    meshing = assembled(paper_pair(), COARSE, ElementQuad1(), penalty=PENALTY, lag=1.0)
    force = found["torque"].values / meshing.pair.pinion.r_b
    return np.array([equilibrium(meshing, found["phase"].values[i], force[i]).te for i in at])


@pytest.fixture(scope="module")
def short():
    """A few hundredths of a pitch behind the pitch point, where one pair of teeth carries all."""
    return ran(20 * rpm, 0.02, 0.14, step=1e-6)


@pytest.fixture(scope="module")
def rubbing():
    """With friction, behind and before the pitch point."""
    return [ran(20 * rpm, start, start + 0.12, step=1e-6, friction=0.3) for start in (0.02, -0.24)]


def unaccounted(found) -> np.ndarray:
    """Energy from nowhere [J]."""
    work = found["work"].values
    return found["energy"].values.sum(axis=1) - work[:, 0] + work[:, 1:].sum(axis=1)


def test_slow_gears_pass_through_static_equilibria(short):
    settled = np.flatnonzero(short["phase"].values > 0.09)
    te = short["te"].values[settled]
    assert te.mean() == pytest.approx(static(short, settled).mean(), rel=3e-3)


def test_energy_is_kept(short, rubbing):
    for found in (short, *rubbing):
        assert np.abs(unaccounted(found)).max() < 2e-3 * found["energy"].values.sum(axis=1).max()


def test_energy_is_kept_where_damping_takes_some():
    """It acts against steady rotation, behind which the wheel lags while teeth deflect."""
    run = RunUp(20 * rpm, 0.02, 0.14, 0.06, steps=200, damping=5000.0)
    found = transmission_error(paper_pair(), 150, run, CentralDifferences(1e-6), density=COARSE, progress=False)
    stored = found["energy"].values.sum(axis=1).max()
    assert np.abs(unaccounted(found)).max() < 2e-3 * stored
    assert np.abs(found["work"].values[:, 2]).max() > 5e-3 * stored


def test_gears_that_part_by_more_than_their_backlash_are_refused():
    gear = fem.Gear(z=30, m_n=2 * mm, b=10 * mm, d_bore=30 * mm)
    run = RunUp(1000 * rpm, -0.3, 0.3, 0.1)
    with pytest.raises(RuntimeError, match=r"have parted by .* their backlash is .*: take a longer run_up"):
        transmission_error(fem.GearPair(gear, gear), 5, run, CentralDifferences(1e-6), density=COARSE, progress=False)


def test_friction_changes_the_force_as_sliding_says(rubbing):
    """Behind the pitch point it drives the wheel, before it brakes: rigid wheel F (r_b +- mu rho) = torque."""
    pair, force = paper_pair(), []
    for found, sign in zip(rubbing, (1, -1), strict=True):
        late = found["phase"].values > found["phase"].values[-1] - 0.04
        phase, time, lost = (found[name].values[late] for name in ("phase", "time", "work"))
        lost = lost[:, 3]
        sliding = 2 * 20 * rpm * pair.p_bt * np.abs(phase)
        force.append((lost[-1] - lost[0]) / (0.3 * np.trapezoid(sliding, time)))
        rho = pair.wheel.r_b * np.tan(pair.alpha_wt) - phase.mean() * pair.p_bt
        assert force[-1] == pytest.approx(150 / (pair.wheel.r_b + sign * 0.3 * rho), rel=0.03)


def test_little_friction_changes_little(short):
    little = ran(20 * rpm, 0.02, 0.05, 0.02, step=1e-6, friction=1e-4)
    none = ran(20 * rpm, 0.02, 0.05, 0.02, step=1e-6)
    assert little["te"].values == pytest.approx(none["te"].values, rel=1e-4)
    assert none["work"].values[-1, 3] == 0 < little["work"].values[-1, 3]


def static_with_friction(meshing, phase: float, force: float, mu: float) -> float:
    """Transmission error where each hat also pulls along the flank by mu times its force, against the sliding."""
    touches, te, u = meshing.touches(phase), 0.0, [body.rest() for body in meshing.bodies]
    behind = np.concatenate([np.full(t.sample.chosen.size, np.sign(phase + t.teeth[0])) for t in touches])
    f = 0 * behind
    for _ in range(40):
        here, residual = rows(meshing, touches, phase, te, u), []
        for body, by, v in zip(meshing.bodies, here.by, u, strict=True):
            normal = by.reshape(len(by), -1, 2)
            along = np.stack([-normal[..., 1], normal[..., 0]], axis=-1).reshape(by.shape)
            load = body.transverse.T @ ((mu * behind * f) @ along)
            residual.append(load.reshape(v.shape) - internal_force(body.solid, v))
        (x, y), (pull_x, pull_y) = (meshing.bodies[1].solid.places + u[1]).T, load.reshape(-1, 2).T
        driven = (x * pull_y - y * pull_x).sum() / meshing.pair.wheel.r_b
        te, du, f = correction(meshing, here, te, residual, force + driven)
        u = [one + two for one, two in zip(u, du, strict=True)]
        if max(np.abs(one).max() for one in du) < 1e-6 * np.abs(u[0]).max():
            return te
    raise AssertionError("friction did not settle")


@pytest.mark.slow
def test_friction_moves_te_as_in_statics_with_coulomb_forces():
    """Less before the pitch point, more behind it, while the normal force does the opposite."""
    found = ran(10 * rpm, -0.3, 0.2, 0.08, step=1e-6, friction=0.3)
    meshing, changes = assembled(paper_pair(), COARSE, ElementQuad1(), penalty=PENALTY, lag=1.0), []
    force, phase, te = (found[name].values for name in ("torque", "phase", "te"))
    for low, high in ((-0.16, -0.04), (0.06, 0.18)):
        at = np.flatnonzero((phase > low) & (phase < high))[::2]
        states = [(meshing, phase[i], force[i] / meshing.pair.pinion.r_b) for i in at]
        rubbing = np.mean([static_with_friction(*state, 0.3) for state in states])
        smooth = np.mean([equilibrium(*state).te for state in states])
        assert te[at].mean() == pytest.approx(rubbing, rel=2e-3)
        changes.append(te[at].mean() / smooth - 1)
    assert changes[0] < -0.005 and changes[1] > 0.005


@pytest.mark.slow
def test_a_cycle_at_10_rpm_is_the_static_curve():
    """But for ringing after kinks of a coarse mesh, which may fall on a peak: te = gain static + ringing of no mean."""
    found = ran(10 * rpm, -0.65, 0.5, 0.15, steps=400, step=5e-7)
    cycle = np.flatnonzero(found["phase"].values > found["phase"].values[-1] - 1 + 1e-9)
    te, expected = found["te"].values[cycle], static(found, cycle)
    assert te.mean() == pytest.approx(expected.mean(), rel=3e-3)
    gain = np.polyfit(expected, te, 1)[0]
    assert gain == pytest.approx(1, abs=3e-3)
    assert (te - gain * expected).std() < 5e-3 * np.ptp(expected)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: CentralDifferences(step=0), "step must be > 0"),
        (lambda: CentralDifferences(penalty=-1), "penalty must be > 0"),
        (lambda: CentralDifferences(friction=2), "friction must lie"),
        (lambda: CentralDifferences(step=np.inf), "step must be > 0 and finite"),
        (lambda: CentralDifferences(penalty="stiff"), "penalty must be one real number"),
        (lambda: transmission_error(paper_pair(), 0.0), "torque must be > 0"),
        (lambda: transmission_error(paper_pair(), np.inf), "torque must be finite"),
        (lambda: transmission_error(paper_pair(), 150, scheme={"step": 1e-6}), "scheme must be a fem.explicit"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
