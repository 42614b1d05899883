"""Modes of planetary sets as data: published frequencies, kinds of modes, and what a turning carrier does to them."""

import numpy as np
import pytest
from modal_boxes import FOUR_PLANETS, THREE_PLANETS
from planetary_boxes import PIN, helical_box, planar_box, planetary_box, waving_law

import exugear
import fem
from fem.units import deg, mm


def lin_and_parker(planets: int) -> exugear.Model:
    """The set of Lin and Parker (1999): masses [kg], inertias over the squared base radius [kg], stiffnesses [N/m]."""
    gear = fem.Gear(z=30, m_n=3 * mm, alpha_n=24.6 * deg, b=25 * mm, d_bore=30 * mm)
    pairs = {"sun_pair": fem.GearPair(gear, gear, a=90 * mm), "ring_pair": exugear.RingPair(gear, -90, a=-90 * mm)}
    law = exugear.MeshForce([0.0], np.array([0, 1 * mm]), np.array([[0, 5e8 * mm]]), damping=0.0)
    bearing, r_s, r_r = exugear.Bearing(radial=1e8, axial=1e8, tilt=1e6), gear.r_b, 3 * gear.r_b

    def shaft(name, mass, inertia, radius, *parts):
        return exugear.Shaft(name, {0.0: [*parts]}, mass=mass, inertia=inertia * radius**2)

    gears = exugear.Planetary(
        sun=shaft("sun", 0.4, 0.39, r_s, gear, bearing),
        ring=shaft("ring", 2.35, 3.0, r_r, pairs["ring_pair"].wheel, bearing, exugear.TorqueSupport(1e9 * r_r**2)),
        carrier=shaft("carrier", 5.43, 6.29, 90 * mm, bearing),
        planet=shaft("planet", 0.66, 0.61, r_s, gear),
        **{"planets": planets, "pin": bearing, "sun_mesh": law, "ring_mesh": law} | pairs,
    )
    return exugear.build(exugear.Gearbox([gears]))


@pytest.mark.parametrize(("planets", "published"), [(3, THREE_PLANETS), (4, FOUR_PLANETS)])
def test_frequencies_and_kinds_of_modes_are_the_published_ones(planets, published, measured):
    """Single frequencies rotate or move planets alone, pairs translate; planet modes need four planets."""
    data = exugear.modes(lin_and_parker(planets), load=1.0, drive="free")
    frequency, kinds = data["frequency"].values, data["kind"].values.tolist()
    error = np.abs(frequency[1:] / np.array(published)[1:] - 1).max()
    measured(f"modes of the set of Lin and Parker with {planets} planets", float(error), 5e-4)
    assert frequency[0] == 0.0
    assert [kinds.count(kind) for kind in ("rotational", "translational", "planet")] == [6, 12, 3 * (planets - 3)]
    translational = frequency[np.array(kinds) == "translational"].reshape(-1, 2)
    assert translational[:, 0] == pytest.approx(translational[:, 1], rel=1e-6)


def test_a_turning_carrier_parts_translational_pairs_and_leaves_the_trace():
    """Translations u'' + 2 W J u' + (K / m - W^2) u = 0: the sum of omega^2 is tr(K / m) + W^2 (4 / 2 - 1) for each."""
    model, speed = lin_and_parker(3), 2000.0
    rest, turning = (exugear.modes(model, load=1.0, drive="free", speed=w) for w in (0.0, speed))
    squares = [float(np.sum((2 * np.pi * data["frequency"].values) ** 2)) for data in (rest, turning)]
    translations, carrier = 12, speed / 4
    assert squares[1] - squares[0] == pytest.approx(carrier**2 * translations, rel=0.03)
    pairs = turning["frequency"].values[turning["kind"].values == "translational"].reshape(-1, 2)
    assert (np.diff(pairs, axis=1) > 1.0).all()
    single = rest["kind"].values == "rotational"
    assert turning["frequency"].values[single] == pytest.approx(rest["frequency"].values[single], rel=0.01)


@pytest.mark.slow
def test_campbell_follows_the_modes_of_a_set():
    model = exugear.build(planar_box())
    data = exugear.campbell(model, speed=[0.0, 200.0, 400.0], load=400.0)
    at_end = exugear.modes(model, load=400.0, speed=400.0)["frequency"].values
    assert np.sort(data["frequency"].values[:, -1]) == pytest.approx(at_end, rel=1e-9)
    ratio = data["order_ratio"].sel(order="1 x mesh sun-planet 1")
    assert float(ratio) == pytest.approx(30 * 0.75)


def test_a_set_of_spins_has_rotational_and_planet_modes():
    """N = 3: three spins of planets apart, two modes of which move no other member."""
    kinds = exugear.modes(exugear.build(planetary_box()), load=400.0, drive="free")["kind"].values.tolist()
    assert (kinds.count("planet"), kinds.count("rotational")) == (2, len(kinds) - 2)


@pytest.mark.parametrize("planets", [3, 4])
def test_a_helical_set_has_single_axial_modes_and_pairs_that_tilt(planets):
    """Eritenel and Parker (2009): 12 single modes, 12 pairs, and 6 (N - 3) in which planets move alone.

    Of the single modes that of the planets' tilts about their radii moves hardly anything beside them.
    """
    support = exugear.TorqueSupport(1e8)
    box = helical_box(waving_law(amplitude=0.0), (), ring_parts=(support,), planets=planets)
    data = exugear.modes(exugear.build(box), load=100.0, drive="free")
    kinds, frequency = data["kind"].values, data["frequency"].values
    assert frequency[0] == 0.0
    assert ((kinds == "translational").sum(), kinds.size) == (24, 12 + 24 + 6 * (planets - 3))
    pairs = frequency[kinds == "translational"].reshape(-1, 2)
    assert pairs[:, 0] == pytest.approx(pairs[:, 1], rel=1e-4)


def test_modes_in_space_hold_those_in_the_plane_and_whirls_seen_from_the_carrier():
    """The sun tilts at J_t w^2 -+ J s w - k = 0, but for the mesh force: w -+ W in the carrier's frame."""
    box, speed = planar_box(bearings=PIN), 2000.0
    built = [exugear.build(box, plan=plan) for plan in (exugear.plan(box), exugear.plan(box).with_bodies())]
    for at in (0.0, speed):
        planar, space = (exugear.modes(model, load=400.0, speed=at)["frequency"].values for model in built)
        assert max(np.abs(space / frequency - 1).min() for frequency in planar) < 1e-9
    sun = box.shafts[0]
    root = np.sqrt((sun.inertia * speed) ** 2 + 4 * sun.transverse * 1e6)
    forward, backward = (root + side * sun.inertia * speed for side in (1, -1))
    whirls = np.array([forward / (2 * sun.transverse) - speed / 4, backward / (2 * sun.transverse) + speed / 4])
    assert np.abs(space[:, None] / (whirls / (2 * np.pi)) - 1).min(axis=0).max() < 1e-4


def test_pins_and_supports_stand_among_the_elements():
    data = exugear.modes(exugear.build(planar_box()), load=400.0)
    assert {"planet 1 pin", "sun bearing at 0 mm"} <= set(data["element"].values.tolist())
    assert data["energy_share"].sum("element").values == pytest.approx(1.0, abs=1e-6)


def test_bearings_that_differ_in_x_and_y_are_refused_at_speed():
    uneven = np.diag([1e8, 2e8, 1e8, 1e6, 1e6, 0.0])
    model = exugear.build(planar_box(sun_bearing=exugear.Bearing(matrix=uneven)))
    exugear.modes(model, load=400.0)
    with pytest.raises(ValueError, match="bearings of shaft 'sun' must be the same in x and y"):
        exugear.modes(model, load=400.0, speed=10.0)
