"""Steady states of planetary sets: against settled runs, and what the phases of the planets suppress."""

from dataclasses import replace

import numpy as np
import pytest
from elastic_rings import BOLTS, BUSH, box_on_ring, ring_modes, set_on_ring
from planetary_boxes import GEAR, PIN, SUN_PAIR, helical_box, planar_box, planetary, planetary_box, waving_law
from settled_runs import agree, settled_dte

import exugear
from fem.units import deg, mm, um

LAW = waving_law(0.15, damping=8000.0)
#: Planets neither in phase nor evenly spaced.
UNEVEN = (0.0, 123 * deg, 243 * deg)


def spins():
    return planetary_box(law=LAW, angles=UNEVEN), (100.0, 102.0), 1200.0


def phases_that_fall():
    return planetary_box(law=LAW, driving="carrier", driven="sun"), (33.0, 33.5), 300.0


def two_members_driven():
    """The carrier turns against the sun, the ring is loaded."""
    speeds = {"sun": 1.0, "carrier": -0.1}
    return exugear.Gearbox([planetary(LAW, angles=UNEVEN)], speeds=speeds, driven="ring"), (180.0, 184.0), 1200.0


def two_members_driven_on_pins():
    speeds = {"sun": 1.0, "carrier": -0.1}
    box = exugear.Gearbox([planetary(LAW, angles=UNEVEN, pin=PIN)], speeds=speeds, driven="ring")
    return box, (180.0, 184.0), 1200.0


def planets_on_pins():
    return planar_box(law=LAW, angles=UNEVEN), (200.0, 204.0), 1200.0


def sun_on(stiffness_x: float, **mass) -> exugear.Gearbox:
    """Planets on one side push the sun with its bearing against a seat, 2e8 N/m in y."""
    seat = exugear.Housing([("sun", 0.0)], np.diag([stiffness_x, 2e8, 2e8, 1e6, 1e6, 1e6]), damping_time=2e-5, **mass)
    return planar_box(law=LAW, angles=(0.0, 90 * deg, 180 * deg), housing=seat)


def sun_on_a_housing():
    return sun_on(2e8), (200.0, 204.0), 1200.0


def planets_in_space():
    return helical_box(LAW, bearing=None, angles=UNEVEN), (200.0, 204.0), 1200.0


@pytest.mark.parametrize(
    ("case", "duration"),
    [
        pytest.param(spins, 0.3, marks=pytest.mark.slow),
        (phases_that_fall, 0.1),
        (two_members_driven, 0.1),
        pytest.param(two_members_driven_on_pins, 0.3, marks=pytest.mark.slow),
        (planets_on_pins, 0.1),
        (sun_on_a_housing, 0.1),
        pytest.param(planets_in_space, 0.3, marks=pytest.mark.slow),
    ],
)
def test_states_are_those_of_a_settled_run(case, duration):
    """On pins in the frame of the carrier, displaced by centrifugal forces: the means are those of the run, too."""
    box, speed, load = case()
    model = exugear.build(box)
    data = exugear.steady_states(model, speed=speed, load=load, stage=(0, 1), progress=False)
    assert data.attrs["exciting_stages"] == [*model.gearbox.labels]
    assert data.attrs["common_period"] == 1
    assert data.attrs["force_error"] < 1e-4
    orbit = data.isel(point=0)
    agree(orbit, settled_dte(model, orbit, load, 5e-6, 40, duration)[:2])


def on_ring(support, **options) -> exugear.Gearbox:
    """A set whose ring has five modes."""
    return box_on_ring(support, ring_damping_ratio=0.03, ring_modes=ring_modes(support, 5), **options)


def carrier_on_ring() -> exugear.Gearbox:
    of_set = set_on_ring(BOLTS, ring_damping_ratio=0.03, ring_modes=ring_modes(BOLTS, 5))
    return exugear.Gearbox([of_set], held="ring", driving="carrier", driven="sun")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("case", "speed", "load"),
    [
        (lambda: on_ring(BUSH), 200.0, 200.0),
        (lambda: on_ring(BOLTS), 300.0, -200.0),
        (carrier_on_ring, 60.0, 40.0),
        (lambda: on_ring(BOLTS, pin=PIN), 300.0, 200.0),
    ],
    ids=["bush", "coast flanks on bolts", "driven by the carrier", "planets on pins"],
)
def test_states_on_a_ring_with_modes_are_those_of_a_settled_run(case, speed, load):
    """Over a turn of the planets around the ring, 69 mesh cycles; whole laws have the forces of the reduced ones."""
    model = exugear.build(case())
    data = exugear.steady_states(model, speed=(speed, 1.004 * speed), load=load, stage=(0, 1), progress=False)
    assert data.attrs["common_period"] == 69
    assert data.attrs["force_error"] < 1e-4
    orbit = data.isel(point=0)
    agree(orbit, settled_dte(model, orbit, load, 5e-6, 69)[:2])


def test_ring_modes_must_oscillate():
    model = exugear.build(box_on_ring(ring_damping_ratio=1.0))
    with pytest.raises(ValueError, match="ring_damping_ratio of 'ring' must lie below 1"):
        exugear.steady_states(model, speed=(200.0, 202.0), load=200.0, progress=False)


def test_members_that_turn_as_a_block_and_speeds_without_a_common_period_are_refused():
    block = exugear.Gearbox([planetary(LAW)], speeds={"sun": 1.0, "carrier": 1.0}, driven="ring")
    options = {"speed": (200.0, 202.0), "progress": False}
    with pytest.raises(ValueError, match="stand in their mesh at these speeds, its members turn as a block"):
        exugear.steady_states(exugear.build(block), load=300.0, **options)
    carrier = exugear.Shaft("carrier", {50 * mm: GEAR}, inertia=0.02, mass=5.0)
    out = exugear.Shaft("out", {50 * mm: GEAR})
    parallel = exugear.Stage(carrier, out, LAW, pair=SUN_PAIR)
    members = [planetary(LAW, carrier=carrier), parallel]
    coupled = exugear.build(exugear.Gearbox(members, speeds={"sun": 1.0, "ring": 0.6180339887}, driven="out"))
    apart = r"at these speeds of \['sun', 'ring'\].*or exugear.run_up over a slow ramp"
    with pytest.raises(ValueError, match=apart):
        exugear.steady_states(coupled, load=300.0, stage=(0, 6), **options)


@pytest.mark.slow
def test_branches_of_a_set_with_loss_of_contact_are_those_of_runs():
    """Over the resonance teeth separate; where there are several stable orbits a run shows one of them."""
    model, load = exugear.build(planetary_box(law=waving_law(0.3, damping=3000.0))), 300.0
    top = 1.4 * exugear.modes(model, load=load)["frequency"].values.max() / model.mesh_cycles[0]
    data = exugear.steady_states(model, speed=(0.3 * top, top), load=load, stage=(0, 1), progress=False)
    assert data["share_without_contact"].values.max() > 0.1
    stable, settled = data.isel(point=np.flatnonzero(data["stable"])), 0
    for point in np.linspace(0, stable.sizes["point"] - 1, 5).astype(int):
        orbit = stable.isel(point=point)
        sizes = np.ptp(settled_dte(model, orbit, load, 2e-6, 40)[:2], axis=1)
        settled += bool(np.allclose(sizes, orbit["peak_to_peak"].values, rtol=5e-3))
    assert settled >= 4


def test_planets_in_counterphase_leave_no_first_harmonic_in_the_torque():
    """z_sun = 30: with three planets in phase, with four every second one half a pitch behind."""
    in_torque = {}
    for planets in (3, 4):
        model = exugear.build(planetary_box(law=LAW, planets=planets))
        data = exugear.steady_states(model, speed=(100.0, 102.0), load=1200.0, progress=False)
        amplitude = data["torque_harmonics"].isel(point=0)
        in_torque[planets] = amplitude.sel(shaft="sun", harmonic=[1, 2]).values
        assert float(data["harmonics"].isel(point=0).sel(harmonic=1)) > 1e-7
        static = 1200.0 / 4 / planets / model.gearbox.stages[0].pair.pinion.r_b
        factor = exugear.dynamic_factor(data, static_force=static)["K_v"].values
        assert ((factor > 1.0) & (factor < 1.2)).all()
    first, second = in_torque[4]
    assert first < 1e-4 * in_torque[3][0]
    assert second > 100 * first


UNEVEN_BEARING = exugear.Bearing(matrix=np.diag([1e8, 2e8, 1e8, 1e6, 1e6, 0.0]))
BESIDE = exugear.Shaft("sun", {0.0: GEAR}, offset=exugear.Placement(x=20 * um))
REFUSED = {
    "bearings of shaft 'sun' must be the same in x and y": lambda: planar_box(law=LAW, sun_bearing=UNEVEN_BEARING),
    "housing must be the same in x and y, .* differ by .* %; pass the mean": lambda: sun_on(1e8),
    "housing must be a stiffness alone": lambda: sun_on(2e8, mass=np.diag([1.0] * 3 + [1e-3] * 3)),
    "the axes of .'sun'. lie beside the others": lambda: planetary_box(law=LAW, sun=BESIDE),
}


@pytest.mark.parametrize("words", REFUSED)
def test_what_turns_in_the_frame_of_the_carrier_is_refused(words):
    model = exugear.build(REFUSED[words]())
    with pytest.raises(ValueError, match=words):
        exugear.steady_states(model, speed=(100.0, 102.0), load=1200.0, progress=False)


def test_planets_that_are_thrown_into_the_ring_have_no_steady_states():
    """The lost backlash is 2 sin(alpha) m a omega^2 / k, of a planet on its pin alone."""
    box = planar_box(sun_bearing=None, driving="carrier", law=replace(waving_law(), backlash=60 * um))
    model, planet = exugear.build(box), box.ends["planet 1"]
    limit = (60 * um * PIN.radial / (2 * np.sin(20 * deg) * planet.mass * 90 * mm)) ** 0.5
    with pytest.raises(ValueError, match=r"planets are thrown outwards: .* touch both flanks"):
        exugear.steady_states(model, speed=(limit, 1.03 * limit), load=400.0, progress=False)
    with pytest.raises(exugear.RunStopped, match="both flanks"):
        exugear.run_up(model, speed=1.03 * limit, load=400.0, duration=1e-3, progress=False, checks=0)
    with pytest.raises(exugear.RunStopped, match="so close that their backlash"):
        exugear.run_up(model, speed=1.2 * limit, load=400.0, duration=1e-3, progress=False, checks=0)
    exugear.run_up(model, speed=0.95 * limit, load=400.0, duration=1e-3, progress=False, checks=0)
