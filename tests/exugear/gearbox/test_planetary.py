"""Planetary sets as data: speeds, phases, assembly, and what is refused."""

from fractions import Fraction
from itertools import permutations
from math import cos, pi

import numpy as np
import pytest
from planetary_boxes import GEAR, RING_PAIR, SUN_PAIR, members, planetary, planetary_box, published_set, waving_law

import exugear
import fem
from exugear.gearbox.planetary_kinematics import MeshOfMembers, motions, speeds_of_members
from fem.units import deg, mm, um

#: Speed of sun, ring and carrier over that of the driving member (driving, held), Willis with z_s = 30, |z_r| = 90.
MODES_OF_OPERATION = {
    ("sun", "ring"): (1, 0, Fraction(1, 4)),
    ("sun", "carrier"): (1, Fraction(-1, 3), 0),
    ("ring", "sun"): (0, 1, Fraction(3, 4)),
    ("ring", "carrier"): (-3, 1, 0),
    ("carrier", "ring"): (4, 0, 1),
    ("carrier", "sun"): (0, Fraction(4, 3), 1),
}
#: Planets of the set of Shweiki et al. (ISMA 2016), z 21/39/-99, with meshes in sequence.
SEQUENCE = (0.0, 126 * deg, 252 * deg)


@pytest.mark.parametrize(("ends", "speeds"), MODES_OF_OPERATION.items())
def test_the_six_modes_of_operation_have_exact_ratios(ends, speeds):
    ratios = planetary().ratios(*ends)
    assert tuple(ratios[name] for name in ("sun", "ring", "carrier")) == speeds
    box = planetary_box(held=ends[1], driving=ends[0])
    assert {name: float(ratio) for name, ratio in ratios.items()} == box.ratios


def test_seven_planets_do_not_fit_but_nearest_angles_do():
    with pytest.raises(ValueError, match="nearest angles that fit are 0, 51, 102, 153, 207, 258, 309 deg: angles="):
        exugear.planetary_phases(SUN_PAIR, RING_PAIR, planets=7)


def test_a_ravigneaux_set_has_the_ratios_of_its_closed_forms():
    """Small sun 28, large sun 32, short planets 20, long ones 22, ring 78 drives out; two speeds are to be imposed."""
    meshes = [
        MeshOfMembers("small", "short", 28, 20, "carrier"),
        MeshOfMembers("short", "long", 20, 22, "carrier"),
        MeshOfMembers("large", "long", 32, 22, "carrier"),
        MeshOfMembers("long", "ring", 22, -78, "carrier"),
    ]
    assert len(motions(meshes)[1]) == 2
    assert speeds_of_members(meshes, "small", ["carrier"])["ring"] == Fraction(28, 78)
    assert speeds_of_members(meshes, "small", ["large"])["ring"] == Fraction(28 * (78 + 32), 78 * (28 + 32))
    assert speeds_of_members(meshes, "large", ["carrier"])["ring"] == Fraction(-32, 78)


def test_in_every_mode_the_torques_balance_and_all_flanks_push():
    """T_s : T_r : T_c = z_s : |z_r| : -(z_s + |z_r|), whichever member drives."""
    for driving, driven, held in permutations(("sun", "ring", "carrier")):
        box = planetary_box(held=held, driving=driving, driven=driven)
        forces = np.array(box.static_forces(100.0))
        torques = dict(zip([shaft.name for shaft in box.shafts], -box.rows.T @ forces, strict=True))
        assert forces.min() > 0
        assert [torques[f"planet {k}"] for k in (1, 2, 3)] == pytest.approx([0.0] * 3, abs=1e-10)
        assert torques["ring"] == pytest.approx(3 * torques["sun"], rel=1e-12)
        assert torques["carrier"] == pytest.approx(-4 * torques["sun"], rel=1e-12)
        assert abs(torques[driven]) == pytest.approx(100.0, rel=1e-12)


@pytest.mark.parametrize("driving", ["sun", "carrier"])
def test_phases_of_a_gearbox_are_those_of_the_closed_form(driving):
    """The assembly along gears that mesh, and p_s = -d z_s psi / 2 pi, p_r = p_s + h_s + h_r + z_p / 2."""
    box = exugear.Gearbox([planetary(**published_set(), angles=SEQUENCE)], held="ring", driving=driving)
    direction, pairs = 1 if driving == "sun" else -1, (published_set()[name] for name in ("sun_pair", "ring_pair"))
    expected = exugear.planetary_phases(*pairs, angles=SEQUENCE, direction=direction)
    phases = np.array(box.phases)
    miss = np.r_[phases[::2] - expected.sun, phases[1::2] - expected.ring]
    assert np.abs(miss - np.round(miss)).max() < 1e-9
    assert expected.sun * direction % 1 == pytest.approx([0.0, 0.65, 0.3])


def test_a_planet_touches_the_ring_with_its_other_flank_where_the_phases_say():
    """Its tooth that meets the ring stands half a turn and half its two thicknesses from the one that meets the sun."""
    sun_pair, ring_pair = (published_set()[name] for name in ("sun_pair", "ring_pair"))
    phases, planet = exugear.planetary_phases(sun_pair, ring_pair), sun_pair.wheel
    r_w = [planet.r_b / cos(pair.alpha_wt) for pair in (sun_pair, ring_pair)]
    flanks = [planet.thickness(r) / (2 * r) for r in r_w]
    # At phase 0 with the sun its tooth lies flanks[0] ahead of the line of centres; it meets the ring with flanks[1]
    # behind the opposite direction, to which it turns by pi. It turns by a pitch as the phase grows by one.
    to_ring = (pi + flanks[0] + flanks[1]) * planet.z / (2 * pi)
    assert phases.ring[0] == pytest.approx(to_ring % 1, abs=1e-12)


def test_harmonics_that_leave_the_torque_push_the_sun():
    """Shweiki et al. in sequence: sums over the planets in the torque, and of the larger wave in the lateral force."""
    in_sequence = planetary(**published_set(), angles=SEQUENCE)
    table = in_sequence.mesh_phases()
    assert table["torque_sum"].values == pytest.approx([0.0585, 0.1273, 0.9674, 0.2060], abs=5e-5)
    assert table["lateral_sum"].values == pytest.approx([1.0, 0.9674, 0.2060, 0.9674], abs=5e-5)
    assert "order 1, 2, 3, at 0, 0.35, 0.7 of a pitch" in str(in_sequence)
    in_phase = planetary(**published_set())
    assert in_phase.words[0] == "all planets mesh in phase"
    assert "a tooth of the sun meets every 3. tooth of the planet" in str(in_phase)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"angles": (0.0, 121 * deg, 240 * deg)}, "cannot be assembled.*nearest angles that fit are 0, 120, 240 deg"),
        ({"angles": (0.0, 60 * deg, 180 * deg)}, "planets 1 and 2 overlap.*fewer planets"),
        ({"planets": 6}, "planets .* overlap"),
        ({"planets": 4, "angles": (0.0, pi)}, "planets is 4, but angles hold 2; leave one"),
        ({"ring_pair": exugear.RingPair(GEAR, -91, a=-91.5 * mm)}, "a of sun_pair and -a of ring_pair must agree"),
        ({"sun_pair": None}, "sun_mesh is a MeshForce, which knows no gears; pass sun_pair too"),
        ({"pin_errors": (1 * um, 0.0)}, r"pin_errors must be \(3,\), \(3, 2\) or \(3, 4\)"),
        ({"planet": [GEAR, GEAR]}, "planet must have an entry for each of 3 planets, got 2"),
        ({"carrier": members()["sun"]}, "carrier must be a third shaft"),
    ],
)
def test_sets_that_cannot_be_are_refused_in_words(changes, words):
    with pytest.raises(ValueError, match=words):
        planetary(**changes)


def test_unlike_planets_are_refused_unless_a_shaft_carries_both_gears():
    coarse = fem.Gear(z=20, m_n=4 * mm, alpha_n=20 * deg, b=25 * mm, d_bore=30 * mm)
    with pytest.raises(
        ValueError, match=r"must share the planet, they have .*stepped planets are shafts: planet=Shaft"
    ):
        planetary(ring_pair=exugear.RingPair(coarse, -65, a=-90 * mm))
    with pytest.raises(ValueError, match="step_angle and tooth belong to stepped planets"):
        planetary(step_angle=0.1)


def test_a_set_without_a_reaction_member_is_refused_with_the_remedy():
    with pytest.raises(ValueError, match=r"2 speeds are free.*hold one of .*'ring'.*held="):
        exugear.Gearbox([planetary()])
    with pytest.raises(ValueError, match="the train jams"):
        exugear.Gearbox([planetary()], held=("ring", "carrier"))
    with pytest.raises(ValueError, match=r"held: no shafts \['hub'\]"):
        exugear.Gearbox([planetary()], held="hub")


def test_sets_and_stages_share_a_gearbox():
    """A set whose carrier drives the sun of a second one, and a stage behind: ratio 4 x 4 x 2."""
    shafts = members()
    middle = exugear.Shaft("middle", {0.0: GEAR}, inertia=0.02)
    first = planetary(**shafts | {"carrier": middle, "name": "first"})
    out = exugear.Shaft("out", {60 * mm: GEAR}, inertia=0.02)
    second_ring = exugear.Shaft("ring 2", {0.0: RING_PAIR.wheel}, inertia=0.05, mass=5.0)
    second = planetary(sun=middle, ring=second_ring, carrier=out, name="second")
    wheel = fem.Gear(z=60, m_n=3 * mm, alpha_n=20 * deg, b=25 * mm, d_bore=30 * mm)
    last = exugear.Shaft("last", {60 * mm: wheel})
    stage = exugear.Stage(out, last, waving_law(), pair=fem.GearPair(GEAR, wheel, a=135 * mm))
    box = exugear.Gearbox([first, second, stage], held=("ring", "ring 2"))
    assert box.ratios["last"] == -1 / 32
    assert (box.driving.name, box.driven.name) == ("sun", "last")
    assert min(box.static_forces(10.0)) > 0
    assert box.inertias["middle"] == pytest.approx(0.02 + 3 * GEAR.mass * SUN_PAIR.a**2)


def test_a_stage_refuses_a_shaft_without_its_gear():
    """A carrier may be a shaft without gears; a pinion or a wheel may not."""
    bare = exugear.Shaft("bare", {}, inertia=0.02, mass=5.0)
    with pytest.raises(ValueError, match="shaft 'bare' carries no gear; add the pair's wheel to its parts"):
        exugear.Stage(exugear.Shaft("fast", {0.0: GEAR}), bare, waving_law(), pair=SUN_PAIR)


def test_stages_on_a_carrier_by_hand_are_those_of_the_set():
    """The closed form of a set, written mesh by mesh."""
    gears, hand = planetary(), []
    for stage in gears.stages:
        place = {"angle": stage.angle, "carrier": gears.carrier}
        hand.append(exugear.Stage(stage.fast, stage.slow, waving_law(), pair=stage.pair, **place))
    by_hand, box = exugear.Gearbox(hand, held="ring"), exugear.Gearbox([gears], held="ring")
    assert (by_hand.ratios, by_hand.flank_senses) == (box.ratios, box.flank_senses)
    assert by_hand.phases == pytest.approx(box.phases)
