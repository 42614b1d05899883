"""Steady states of planetary sets: against settled runs, and what the phases of the planets suppress."""

import numpy as np
import pytest
from planetary_boxes import GEAR, helical_box, planar_box, planetary_box, waving_law
from settled_runs import agree, settled_dte

import exugear
from fem.units import deg, um

LAW = waving_law(0.15, damping=4000.0)
#: Planets neither in phase nor evenly spaced.
UNEVEN = (0.0, 123 * deg, 243 * deg)


def spins():
    return planetary_box(law=LAW, angles=UNEVEN), (100.0, 102.0), 1200.0


def phases_that_fall():
    return planetary_box(law=LAW, driving="carrier", driven="sun"), (33.0, 33.5), 300.0


def planets_on_pins():
    return planar_box(law=LAW, angles=UNEVEN), (200.0, 204.0), 1200.0


def planets_in_space():
    return helical_box(LAW, bearing=None, angles=UNEVEN), (200.0, 204.0), 1200.0


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(spins, marks=pytest.mark.slow),
        phases_that_fall,
        planets_on_pins,
        pytest.param(planets_in_space, marks=pytest.mark.slow),
    ],
)
def test_states_are_those_of_a_settled_run(case):
    """On pins in the frame of the carrier, displaced by centrifugal forces: the means are those of the run, too."""
    box, speed, load = case()
    model = exugear.build(box)
    data = exugear.steady_states(model, speed=speed, load=load, stage=(0, 1), progress=False)
    assert data.attrs["exciting_stages"] == [*model.gearbox.labels]
    assert data.attrs["common_period"] == 1
    assert data.attrs["force_error"] < 1e-4
    orbit = data.isel(point=0)
    agree(orbit, settled_dte(model, orbit, load, 5e-6, 40)[:2])


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
    "the axes of .'sun'. lie beside the others": lambda: planetary_box(law=LAW, sun=BESIDE),
}


@pytest.mark.parametrize("words", REFUSED)
def test_what_turns_in_the_frame_of_the_carrier_is_refused(words):
    model = exugear.build(REFUSED[words]())
    with pytest.raises(ValueError, match=words):
        exugear.steady_states(model, speed=(100.0, 102.0), load=1200.0, progress=False)
