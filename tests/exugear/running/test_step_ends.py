"""Iterations of Newton's method where the first call of a step is taken at its expected end, and the runs."""

from dataclasses import replace

import numpy as np
import pytest
from planetary_boxes import NEEDLE, PIN, STIFFNESS, helical_box, planar_box, waving_law

import exugear
from fem.units import mm, rpm

OPTIONS = {"progress": False, "checks": 0, "load": 400.0, "power": True}
SETS = {
    "carrier held": (planar_box, {"held": "carrier"}, 75.0),
    "sun drives": (planar_box, {}, 100.0),
    "carrier drives": (planar_box, {"driving": "carrier"}, 25.0),
    "carrier on bearings": (planar_box, {"bearings": PIN, "planets": 4}, 100.0),
    "needles": (planar_box, {"pin": NEEDLE}, 100.0),
    "helical": (helical_box, {}, 100.0),
}


def iterations_and_data(scene: str, duration: float):
    box, options, speed = SETS[scene]
    data = exugear.run_up(exugear.build(box(**options)), speed=(speed, 1.05 * speed), duration=duration, **OPTIONS).data
    return data.attrs["newton_iterations"], data


@pytest.mark.parametrize("scene", SETS)
def test_expected_ends_of_steps_save_iterations_and_do_not_change_the_run(scene, monkeypatch):
    """To 1e-10 of the mesh forces, as with the energy books; pins of a held carrier keep their directions."""
    with_ends, expected = iterations_and_data(scene, 0.01)
    monkeypatch.setattr("exugear.multibody.contact_steps.step_ends_of", lambda mbs: [])
    monkeypatch.setattr("exugear.multibody.gear_contact.reads_step_ends", lambda kinds, frame: False)
    without, data = iterations_and_data(scene, 0.01)
    assert with_ends < 2.2
    assert with_ends < without - (0.05 if scene == "carrier held" else 0.4)
    for name in ("dte", "mesh_force", "bearing_force"):
        assert float(abs(data[name] - expected[name]).max()) < 1e-7 * float(abs(expected[name]).max())


def test_planets_vibrate_on_without_damping_as_they_began():
    """What Newton's tolerance leaves of the residual must not feed vibrations; by a tenth in 0.2 s at that of pairs."""
    pin = replace(PIN, damping_time=0.0)
    model = exugear.build(planar_box(sun_bearing=pin, pin=pin, driving="carrier", law=waving_law(damping=0.0)))
    force = exugear.run_up(model, speed=3000 * rpm, load=400.0, duration=0.2, progress=False, checks=0).data[
        "mesh_force"
    ]
    early, late = (force.sel(time=part).std("time").max() for part in (slice(0, 0.1), slice(0.1, 0.2)))
    assert float(late) == pytest.approx(float(early), rel=0.01)


def test_sets_that_torques_drive_take_few_iterations():
    """Their free turning is no vibration without damping."""
    torques = {"drives": {"sun": exugear.Torque(100.0)}, "loads": {"carrier": 400.0}}
    model = exugear.build(planar_box())
    data = exugear.run(model, **torques, start_speed=100.0, duration=0.05, progress=False, checks=0).data
    assert data.attrs["newton_iterations"] < 1.1


def test_a_run_that_stops_where_teeth_without_backlash_part_says_so():
    """Planets thrown outwards stand too close to the ring; once their teeth part, the back flanks would carry."""
    phase, deflection = np.arange(32) / 32, np.array([0, 1 * mm])
    stiffness = STIFFNESS * (1 + 0.3 * np.cos(2 * np.pi * phase))
    law = exugear.MeshForce(phase, deflection, np.outer(stiffness, deflection), damping=100.0, backlash=0.0)
    pin = replace(PIN, damping_time=5e-6)
    model = exugear.build(planar_box(sun_bearing=pin, pin=pin, law=law))
    with pytest.raises(exugear.RunStopped, match=r"-ring so close that their backlash of 0 um is used up"):
        exugear.run_up(model, speed=(900 * rpm, 3000 * rpm), load=400.0, duration=0.2, progress=False, checks=0)
