"""Axes of carrier, ring and sun beside each other, and an eccentric carrier: shares of the planets over its turn."""

from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from math import cos, pi

import numpy as np
import pytest
from planetary_boxes import GEAR, PIN, SUN_PAIR, members, planar_box, planetary, waving_law

import exugear
from fem.units import deg, mm, um

#: Load on the carrier [N m], displacement [m] and direction [rad].
LOAD, SHIFT, AT = 4000.0, 2 * um, 30 * deg
ALPHA = SUN_PAIR.alpha_wt
#: X = k e / F with 1/k = 1 / (2 k_m cos^2 alpha) and the force F of all pins.
X = 2 * 5e8 * cos(ALPHA) ** 2 * SHIFT / (LOAD / SUN_PAIR.a)


def turned(duration_turns: float = 1.0, displaced: str | None = None, **changes) -> tuple[exugear.Run, np.ndarray]:
    """A run over turns of the carrier, and shares of the planets in the pin forces (3, n)."""
    shafts = members()
    if displaced:
        offset = exugear.Placement(x=SHIFT * cos(AT), y=SHIFT * cos(AT - pi / 2))
        shafts[displaced] = replace(shafts[displaced], offset=offset)
    box = exugear.Gearbox([planetary(waving_law(amplitude=0.0), **shafts | changes)], held="ring")
    options = {"sample": 2e-3, "tolerance": 1e-2, "power": True, "progress": False, "checks": 0}
    run = exugear.run_up(exugear.build(box), speed=100.0, load=LOAD, duration=duration_turns * 2 * pi / 25, **options)
    forces = run.data["mesh_force"].values.reshape(3, 2, -1).sum(axis=1)
    return run, forces / forces.sum(axis=0)


@pytest.mark.parametrize(("member", "amplitude"), [("carrier", X), ("ring", X / (2 * cos(ALPHA)))])
def test_an_axis_beside_the_others_varies_the_shares_once_in_a_turn_of_the_carrier(member, amplitude):
    """Carrier: 1/3 + X sin(psi + theta - at), ahead by -e sin; ring: it moves one of two meshes, along its line."""
    run, shares = turned(displaced=member)
    assert run.energy_balance().relative < 1e-9
    theta = 25.0 * run.data["time"].values
    waves = np.mean((shares * np.exp(-1j * theta))[:, 1:], axis=1) * 2
    assert np.abs(waves) == pytest.approx(amplitude, rel=1e-3)
    if member == "carrier":
        psi = np.arange(3) * 2 * pi / 3
        expected = 1 / 3 + X * np.sin(psi[:, None] + theta - AT)
        assert shares == pytest.approx(expected, abs=1e-3 * X)


def test_on_elastic_pins_a_displaced_carrier_varies_the_shares_by_less():
    """1/k = 1 / (2 k_m cos^2 alpha) + 1 / k_pin."""
    carrier = exugear.Shaft("carrier", {}, inertia=0.02, mass=5.0, offset=exugear.Placement(x=SHIFT))
    box = planar_box(sun_bearing=None, law=waving_law(amplitude=0.0), carrier=carrier)
    options = {"sample": 2e-3, "tolerance": 1e-2, "progress": False, "checks": 0}
    data = exugear.run_up(exugear.build(box), speed=100.0, load=LOAD, duration=0.05, **options).data
    forces = data["mesh_force"].values.reshape(3, 2, -1).sum(axis=1)
    soft = SHIFT / (LOAD / SUN_PAIR.a) / (1 / (2 * 5e8 * cos(ALPHA) ** 2) + 1 / 1e8)
    turned_by = np.arange(3)[:, None] * 2 * pi / 3 + 25.0 * data["time"].values
    assert forces / forces.sum(axis=0) == pytest.approx(1 / 3 + soft * np.sin(turned_by), abs=2e-2 * soft)


@pytest.mark.parametrize("on_pins", [False, True])
def test_parts_of_a_run_about_displaced_or_tilted_axes_give_the_serial_run(on_pins):
    """Later parts start from the equilibrium at the angle of their carrier."""
    shafts = members()
    offset = exugear.Placement(tilt_x=TILT) if on_pins else exugear.Placement(x=SHIFT)
    shafts["sun"] = replace(shafts["sun"], offset=offset)
    law = law_beside_the_middle() if on_pins else waving_law(damping=6000.0)
    pin = replace(PIN, damping_time=1e-4) if on_pins else None
    model = exugear.build(exugear.Gearbox([planetary(law, pin=pin, **shafts)], held="ring"))
    options = {"speed": (50.0, 80.0), "load": LOAD, "duration": 0.4, "progress": False, "checks": 0}
    serial = exugear.run_up(model, **options).data
    with ProcessPoolExecutor(2) as executor:
        parts = exugear.run_up(model, **options, executor=executor).data
    assert "0 of the run integrated again" in parts.attrs["parts"]
    assert float(np.abs(parts["dte"] - serial["dte"]).max()) < 1e-6 * float(serial["dte"].std())


def test_an_eccentric_carrier_gives_shares_that_stay():
    """The pins are displaced by e sin(at - psi) in the carrier's frame: 1/3 - X sin(at - psi) throughout."""
    _, shares = turned(0.3, eccentricity=(SHIFT / 4, AT))
    psi = np.arange(3) * 2 * pi / 3
    assert shares == pytest.approx(np.tile(1 / 3 - X / 4 * np.sin(AT - psi), (shares.shape[1], 1)).T, abs=2e-3 * X)


#: Tilt of an axis [rad], and axial position at which mesh forces act [m].
TILT, ARM = 4e-4, 4 * mm


def law_beside_the_middle() -> exugear.MeshForce:
    """F = k (deflection + ARM misalignment): a mesh whose force acts beside its mid-plane."""
    misalignment, pressed = TILT * np.arange(-2, 3), np.linspace(0, 60 * um, 9)
    deflection = np.broadcast_to(pressed - ARM * misalignment[:, None, None], (5, 4, 9))
    force, axis = np.broadcast_to(5e8 * pressed, (5, 4, 9)), {"misalignment": misalignment}
    return exugear.MeshForce(np.arange(4) / 4, deflection, force, damping=1500.0, backlash=50 * um, offsets=axis)


def tilted(load: float = LOAD, pin: exugear.Bearing | None = None, **tilts: float) -> tuple[exugear.Run, np.ndarray]:
    """A run over a turn of the carrier with axes tilted about the direction AT, and shares of the planets."""
    speed = 400.0 if pin else 100.0
    shafts = members()
    for name, tilt in tilts.items():
        offset = exugear.Placement(tilt_x=tilt * cos(AT), tilt_y=tilt * cos(AT - pi / 2))
        shafts[name] = replace(shafts[name], offset=offset)
    box = exugear.Gearbox([planetary(law_beside_the_middle(), pin=pin, **shafts)], held="ring")
    options = {"sample": 0.2 / speed, "tolerance": 1e-2, "power": True, "progress": False, "checks": 0}
    run = exugear.run_up(exugear.build(box), speed=speed, load=load, duration=8 * pi / speed, **options)
    forces = run.data["mesh_force"].values.reshape(3, 2, -1).sum(axis=1)
    return run, forces / forces.sum(axis=0)


def once_in_a_turn(run: exugear.Run, shares: np.ndarray) -> np.ndarray:
    """(3,) complex amplitudes of the shares over the turn of the carrier."""
    theta = 2 * pi * run.data["time"].values / float(run.data["time"][-1])
    return np.mean((shares * np.exp(-1j * theta))[:, 1:], axis=1) * 2


@pytest.mark.parametrize(("member", "load"), [("sun", LOAD), ("ring", LOAD), ("sun", -LOAD)])
def test_a_tilted_axis_varies_the_shares_once_in_a_turn_of_the_carrier(member, load):
    """The misalignment moves one of two meshes by ARM TILT along its line: k cos(alpha) ARM TILT / F, either flank."""
    run, shares = tilted(load, **{member: TILT})
    assert run.energy_balance().relative < 1e-10
    expected = 5e8 * cos(ALPHA) * ARM * TILT / (LOAD / SUN_PAIR.a)
    assert np.abs(once_in_a_turn(run, shares)) == pytest.approx(expected, rel=1e-5)


def test_a_tilted_carrier_is_a_sun_and_a_ring_tilted_against_it():
    of_carrier, of_both = tilted(carrier=TILT), tilted(sun=-TILT, ring=-TILT)
    assert of_carrier[0].energy_balance().relative < 1e-10
    # To the second order of the tilt.
    assert of_carrier[1] == pytest.approx(of_both[1], abs=5e-3 * np.ptp(of_both[1]))
    assert once_in_a_turn(*of_carrier) == pytest.approx(once_in_a_turn(*of_both), rel=1e-4)


@pytest.mark.parametrize(("member", "load"), [("sun", LOAD), ("ring", LOAD), ("sun", -LOAD)])
def test_on_elastic_pins_a_tilted_axis_varies_the_shares_by_less(member, load):
    """Pins in series with both meshes of a planet: 1 / (1 + 2 cos^2 alpha k / k_pin) of the shares on ideal pins."""
    run, shares = tilted(load, pin=replace(PIN, tilt=1e7), **{member: TILT})
    assert run.energy_balance().relative < 1e-8
    softened = 1 + 2 * cos(ALPHA) ** 2 * 5e8 / PIN.radial
    expected = 5e8 * cos(ALPHA) * ARM * TILT / (LOAD / SUN_PAIR.a) / softened
    # The planets tilt, too: by k ARM^2 over the stiffness of the pin against tilt, 8e-4.
    assert np.abs(once_in_a_turn(run, shares)) == pytest.approx(expected, rel=1e-4)


def test_on_elastic_pins_a_tilted_carrier_is_a_sun_and_a_ring_tilted_against_it():
    of_carrier, of_both = tilted(pin=PIN, carrier=TILT), tilted(pin=PIN, sun=-TILT, ring=-TILT)
    assert of_carrier[0].energy_balance().relative < 1e-8
    assert once_in_a_turn(*of_carrier) == pytest.approx(once_in_a_turn(*of_both), rel=1e-4)
    alike = tilted(pin=PIN, carrier=TILT, sun=TILT, ring=TILT)[1]
    assert alike == pytest.approx(tilted(pin=PIN)[1], abs=1e-4)


def test_axes_that_cannot_be_followed_are_refused_in_words():
    shafts = members()
    leaning = replace(shafts["sun"], offset=exugear.Placement(tilt_x=1e-4))
    unmapped = r"its misalignment turns from -0.0001 to 0.0001 rad; map it with fem.Offsets\(misalignment="
    for pin in (None, PIN):
        with pytest.raises(ValueError, match=unmapped):
            exugear.plan(exugear.Gearbox([planetary(**shafts | {"sun": leaning}, pin=pin)], held="ring"))
    with pytest.raises(ValueError, match=r"beyond the map's axis from -0\.0008 to 0\.0008"):
        tilted(sun=3 * TILT)
    with pytest.raises(ValueError, match="eccentricity must lie within"):
        planetary(eccentricity=(20.0, 0.0))
    with pytest.raises(ValueError, match="eccentricity must be a distance"):
        planetary(eccentricity=20 * um)


@pytest.mark.parametrize("planet", [0, 1])
def test_a_planet_with_thinner_teeth_takes_less_whichever_flanks_drive(planet):
    """As with its pin displaced by half of the thickness with the force on it: (1 - (N - 1) X) / N."""
    thinner = 1 * um
    thin = replace(GEAR, s_n=GEAR.s_n - thinner)
    planets = [thin if n == planet else GEAR for n in range(3)]
    x = X * (thinner / 2) / SHIFT
    for driving in ("sun", "carrier"):
        box = exugear.Gearbox([planetary(waving_law(amplitude=0.0), planet=planets)], held="ring", driving=driving)
        load = LOAD / 4 if driving == "carrier" else LOAD
        options = {"duration": 1e-3, "progress": False, "checks": 0}
        data = exugear.run_up(exugear.build(box), speed=10.0, load=load, **options).data
        forces = data["mesh_force"].values[:, -1].reshape(3, 2).sum(axis=1)
        expected = np.full(3, (1 + x) / 3)
        expected[planet] = (1 - 2 * x) / 3
        assert forces / forces.sum() == pytest.approx(expected, abs=2e-2 * x)
