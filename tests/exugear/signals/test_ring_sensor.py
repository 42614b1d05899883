"""A sensor on a ring: lines at turns of the carrier by the waves of a thin ring, as planets pass."""

from functools import cache

import numpy as np
import pytest
import xarray as xr
from planetary_boxes import waving_law
from ring_gears import COARSE, bolted, ring_pair, thin_ring_pair

import exugear
import fem
from fem.units import mm

#: Duration of a turn of the carrier [s], samples in a pitch of the ring.
TURN, IN_PITCH = 0.3, 12


def pairs_of(z: tuple[int, int, int]) -> dict:
    """Sun and planet, planet and ring with these numbers of teeth."""
    sun, planet = (fem.Gear(z=n, m_n=3 * mm, b=25 * mm, d_bore=20 * mm) for n in z[:2])
    pair = fem.GearPair(sun, planet)
    return {"sun_pair": pair, "ring_pair": exugear.RingPair(planet, z[2], a=-pair.a)}


@cache
def turn_of(z: tuple[int, int, int], softer: float = 0.0) -> xr.Dataset:
    """The last turn of the carrier of a run at constant speed; the mesh of planet 1 with the ring is softer."""
    pairs, law = pairs_of(z), waving_law(0.1, damping=3e4)
    sun, ring = exugear.Shaft("sun", {0.0: pairs["sun_pair"].pinion}), {0.0: pairs["ring_pair"].wheel}
    members = {"sun": sun, "ring": exugear.Shaft("ring", ring, inertia=0.05, mass=5.0)}
    members["carrier"] = exugear.Shaft("carrier", {}, inertia=0.02, mass=5.0)
    meshes = {"sun_mesh": law, "ring_mesh": [waving_law(0.1 + softer, damping=3e4), law, law]}
    box = exugear.Gearbox([exugear.Planetary(**members, **pairs, **meshes)], held="ring")
    sample = TURN / (IN_PITCH * abs(z[2]))
    options = {"sample": sample, "step": sample / np.ceil(sample / 1.2e-5), "progress": False, "checks": 0}
    speed = 2 * np.pi / TURN * (1 + abs(z[2]) / z[0])
    run = exugear.run(
        exugear.build(box), drives={"sun": speed}, loads={"carrier": 600.0}, duration=1.25 * TURN, **options
    )
    return run.data.isel(time=slice(-IN_PITCH * abs(z[2]), None))


def lines(data: xr.Dataset, **waves: float) -> np.ndarray:
    """Amplitudes at orders 0, 1, 2, ... of the carrier; waves: amplitude of n lobes around the ring as n=."""
    shape = lambda angle: sum(a * np.cos(int(n[1:]) * angle) for n, a in waves.items())  # noqa: E731
    signal = exugear.RingSensor(0.3, shape).signal(data)
    return 2 * np.abs(np.fft.rfft(signal.values)) / signal.size


def test_equal_planets_give_lines_at_multiples_of_their_number():
    """Bending puts the mesh of 99 teeth at 96 and 102, three lobes away; breathing alone leaves it at 99."""
    data = turn_of((21, 39, -99))
    bending = lines(data, n2=1e-9, n3=1e-10, n4=1e-11)
    others = np.arange(1, 250) % 3 != 0
    assert bending[1:250][others].max() < 1e-8 * bending[1:250].max()
    assert bending[99] < 1e-6 * min(bending[96], bending[102])
    assert bending[96] == pytest.approx(bending[102], rel=0.01)
    breathing = lines(data, n0=1e-9)
    assert breathing[99] > 1e5 * max(breathing[96], breathing[102])


def test_a_mesh_that_is_no_multiple_shows_its_neighbours():
    """92 teeth: 90 by two lobes of bending, 93 by the translation of the ring on its support."""
    data = turn_of((22, 35, -92))
    for waves, order, absent in (({"n2": 1e-9}, 90, 93), ({"n1": 1e-9}, 93, 90)):
        amplitudes = lines(data, **waves)
        assert amplitudes[60:120].argmax() + 60 == order
        assert amplitudes[absent] < 1e-7 * amplitudes[order]
        assert amplitudes[92] < 1e-7 * amplitudes[order]


def test_unequal_planets_fill_the_rest():
    shape = {"n2": 1e-9, "n3": 1e-10}
    equal, unequal = (lines(turn_of((21, 39, -99), softer), **shape) for softer in (0.0, 0.05))
    assert equal[[97, 98, 100, 101]].max() < 1e-6 * equal[96]
    assert unequal[[97, 101]].min() > 1e-2 * unequal[96]


def test_the_signal_counts_turns_of_the_carrier():
    data = turn_of((21, 39, -99))
    signal = exugear.RingSensor(-0.2, np.cos).signal(data)
    assert float(signal["angle"][-1]) == pytest.approx(2 * np.pi * (1 - 1 / signal.size), rel=1e-4)
    assert float(signal["speed"].mean()) == pytest.approx(2 * np.pi / TURN, rel=1e-4)
    assert float(signal["mesh_order"]) == 99
    over = exugear.over_angle(signal, highest_order=300)
    assert over.sizes[over.dims[-1]] > 600


def test_a_dataset_around_the_ring_is_the_function_that_it_samples():
    """Of `fem.ring_deflection`: its angles count from the middle of tooth 0, which touches half a thickness further."""
    pair = ring_pair()
    sun = fem.Gear(z=22, x=0.4, m_n=pair.pinion.m_n, b=pair.pinion.b, d_bore=10 * mm)
    law, outer = waving_law(), fem.GearPair(sun, pair.pinion, a=-pair.a)
    members = {"sun": exugear.Shaft("sun", {0.0: sun}), "ring": exugear.Shaft("ring", {0.0: pair.wheel})}
    members["carrier"] = exugear.Shaft("carrier", {}, inertia=1e-3, mass=1.0)
    given = {"sun_pair": outer, "ring_pair": pair, "sun_mesh": law, "ring_mesh": law, "planets": 1}
    box = exugear.Gearbox([exugear.Planetary(**members, **given)], held="ring")
    options = {"duration": 0.02, "progress": False, "checks": 0}
    run = exugear.run(exugear.build(box), drives={"sun": 300.0}, loads={"carrier": 50.0}, **options)

    def shape(angle):
        return np.cos(2 * angle) + 0.3 * np.sin(3 * angle)

    r_w = pair.wheel.r_b / np.cos(pair.alpha_wt)
    half_tooth = pair.wheel.thickness(r_w) / abs(2 * r_w)
    angle = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    table = shape(angle - angle[:, None] - half_tooth)
    data = xr.Dataset(dict.fromkeys(("radial", "tangential"), (("mesh", "at"), table)), {"mesh": angle, "at": angle})
    expected = exugear.RingSensor(0.5, shape).signal(run).values
    for direction in ("radial", "tangential"):
        values = exugear.RingSensor(0.5, data, direction=direction).signal(run).values
        assert values == pytest.approx(expected, abs=1e-4 * np.abs(expected).max())


def test_what_a_sensor_cannot_tell_is_refused():
    data = turn_of((21, 39, -99))
    with pytest.raises(ValueError, match="ring must be one of"):
        exugear.RingSensor(0.0, np.cos).signal(data, ring="sun")
    with pytest.raises(ValueError, match="pass radians"):
        exugear.RingSensor(90.0, np.cos)
    with pytest.raises(ValueError, match="all around the ring"):
        part = xr.Dataset(
            {n: (("mesh", "at"), np.ones((2, 2))) for n in ("radial", "tangential")}, {"mesh": [0, 1], "at": [0, 1]}
        )
        exugear.RingSensor(0.0, part)
    with pytest.raises(ValueError, match="back flanks"):
        exugear.RingSensor(0.0, np.cos).signal(data.assign(mesh_force=-data["mesh_force"]))


def test_a_ring_on_bolts_bends_where_the_planet_passes():
    """Its law runs over all pitches between the bolts; the sensor moves most, outwards, as the planet passes.

    The line of action meets the rim some degrees behind the planet.
    """
    pair = thin_ring_pair(bolted())
    sun = fem.Gear(z=14, m_n=pair.pinion.m_n, b=pair.pinion.b, d_bore=8 * mm)
    ste = fem.over_pitches(fem.static_transmission_error(pair, [0, 10, 60], 6, resolution=COARSE, progress=False))
    members = {"sun": exugear.Shaft("sun", {0.0: sun}), "ring": exugear.Shaft("ring", {0.0: pair.wheel})}
    members["carrier"] = exugear.Shaft("carrier", {}, inertia=1e-3, mass=1.0)
    given = {"sun_pair": fem.GearPair(sun, pair.pinion, a=-pair.a), "sun_mesh": waving_law(0.0), "ring_mesh": ste}
    box = exugear.Gearbox([exugear.Planetary(**members, **given, planets=1, damping=1500.0)], held="ring")
    turn, ratio = 0.2, 1 + 53 / 14
    options = {"duration": turn, "sample": turn / 1060, "step": turn / 10600, "progress": False, "checks": 0}
    run = exugear.run(exugear.build(box), drives={"sun": 2 * np.pi / turn * ratio}, loads={"carrier": 80.0}, **options)
    ring = run.data.isel(stage=1)
    law, force = box.stages[1].force, ring["mesh_force"].values
    static = [law.deflection_at(p, f) for p, f in zip(ring["phase"].values[::20], force[::20], strict=True)]
    assert ring["dte"].values[::20] == pytest.approx(static, abs=0.02 * np.ptp(static))
    around = np.linspace(0, 2 * np.pi, 212, endpoint=False)
    influence = fem.ring_deflection(pair, around, around, resolution=COARSE)
    for angle in (1.1, 2.7, 4.3):
        signal = exugear.RingSensor(angle, influence).signal(run)
        passing = float(signal["angle"][int(np.argmax(signal.values))])
        assert 0 < passing - angle < 0.3


def elastic_turn(z: tuple[int, int, int], softer: float = 0.0) -> np.ndarray:
    """Amplitudes of the acceleration by order of the carrier, of a ring on a bush by its modes."""
    sun, planet = (fem.Gear(z=n, m_n=3 * mm, b=25 * mm, d_bore=20 * mm, s_n=4.6 * mm) for n in z[:2])
    pair, bush = fem.GearPair(sun, planet), fem.Bush(radial=1e8, tangential=1e8)
    sizes = {"d_a": (-z[2] - 1.6) * 3 * mm, "d_rim": (-z[2] + 10.5) * 3 * mm}
    ring = fem.Gear(z=z[2], m_n=3 * mm, b=25 * mm, support=bush, **sizes)
    ring_pair = fem.GearPair(planet, ring, a=-pair.a)
    phase, force = np.arange(16) / 16, np.array([0.0, 500.0, 2000.0, 6000.0])

    def mesh(factor: float) -> xr.Dataset:
        te = np.multiply.outer(force, factor * 6e-8 * (1 + 0.05 * np.cos(2 * np.pi * phase)))
        return fem.ste_map(ring_pair, force * planet.r_b, phase, te)

    equal = mesh(1.0)
    members = {"sun": exugear.Shaft("sun", {0.0: sun}), "ring": exugear.Shaft("ring", {0.0: ring})}
    members["carrier"] = exugear.Shaft("carrier", {}, inertia=0.02, mass=5.0)
    meshes = {"sun_mesh": waving_law(0.0), "ring_mesh": [mesh(1 + softer) if softer else equal, equal, equal]}
    modes = fem.ring_modes(ring_pair, 13, resolution=COARSE)
    of_set = exugear.Planetary(
        **members, **meshes, sun_pair=pair, damping=3e4, ring_modes=modes, ring_damping_ratio=0.05
    )
    turn, number = 0.4, 12 * abs(z[2])
    options = {"sample": turn / number, "step": turn / number / 34, "progress": False, "checks": 0}
    drive = {"sun": 2 * np.pi / turn * (1 + abs(z[2]) / z[0])}
    model = exugear.build(exugear.Gearbox([of_set], held="ring"))
    run = exugear.run(model, drives=drive, loads={"carrier": 600.0}, duration=1.25 * turn, **options)
    signal = exugear.RingSensor(0.3, quantity="acceleration").signal(run.data.isel(time=slice(-number, None)))
    return 2 * np.abs(np.fft.rfft(signal.values)) / signal.size


@pytest.mark.slow
def test_an_elastic_ring_is_heard_at_multiples_of_the_number_of_planets():
    """In a run with the modes of the ring: 96 and 102 by bending, 99 by breathing; of 92 teeth 90 and 93."""
    bending, neighbours = elastic_turn((21, 39, -99)), elastic_turn((22, 35, -92))
    for lines in (bending, neighbours):
        between = np.arange(1, 300) % 3 != 0
        assert lines[1:300][between].max() < 1e-3 * lines[1:300].max()
    assert bending[99] < 0.1 * min(bending[96], bending[102])
    assert sorted(np.argsort(neighbours[80:105])[-2:] + 80) == [90, 93]
    unequal = elastic_turn((21, 39, -99), 0.05)
    assert unequal[[97, 98, 100, 101]].min() > 0.2 * unequal[96]
