"""Stepped planets and coupled sets as data: exact ratios, phases against the teeth they tell, assembly, refusals."""

from fractions import Fraction
from math import cos, pi

import numpy as np
import pytest
from coupled_sets import carrier_shaft, gear, ravigneaux, ring_shaft, simpson, stepped
from planetary_boxes import GEAR, planetary, waving_law

import exugear
import fem
from fem.units import deg, mm

#: Gears of a Ravigneaux set 30, 42 / 105: driving and held member, speed of the ring (Willis).
RAVIGNEAUX = {
    ("small", "carrier"): Fraction(2, 7),
    ("small", "large"): Fraction(7, 12),
    ("carrier", "large"): Fraction(7, 5),
    ("large", "carrier"): Fraction(-2, 5),
    ("large", "small"): Fraction(5, 12),
}
#: Of a Simpson set of 30 / 90, z_s / z_r = 1/3: 1 / (2 + 1/3), 1 / (1 + 1/3), -1/3.
SIMPSON = {
    ("front ring", "rear carrier"): Fraction(3, 7),
    ("front ring", "sun"): Fraction(3, 4),
    ("sun", "rear carrier"): Fraction(-1, 3),
}


def tooth_angles(box: exugear.Gearbox, name: str, axial: float) -> np.ndarray:
    """Angle about z of a tooth of a gear, as each of its meshes tells it [rad]; of rings that of a flank."""
    angles = []
    for stage, phase, sense in zip(box.stages, box.phases, box.flank_senses, strict=True):
        for side, end in enumerate(stage.ends):
            if end == (name, axial):
                of_stage = (stage.pair.pinion, stage.pair.wheel)[side]
                if of_stage.z < 0:
                    angles.append(stage.angle + sense * phase * 2 * pi / abs(of_stage.z))
                    continue
                r_w = of_stage.r_b / cos(stage.pair.alpha_wt)
                half = of_stage.z * of_stage.thickness(r_w) / (4 * pi * r_w)
                turned = (phase - half) * sense if side == 0 else of_stage.z / 2 - (phase + half) * sense
                angles.append(stage.angle + turned * 2 * pi / of_stage.z)
    return np.array(angles)


def apart(angles, z: int) -> float:
    """Largest difference of angles [pitches], up to whole pitches."""
    shares = (np.asarray(angles) - angles[0]) * abs(z) / (2 * pi)
    return float(np.abs(shares - np.round(shares)).max())


@pytest.mark.parametrize(("ends", "ratio"), RAVIGNEAUX.items())
def test_the_gears_of_a_ravigneaux_set_have_exact_ratios(ends, ratio):
    assert exugear.exact_ratios(ravigneaux(), driving=ends[0], held=ends[1])["ring"] == ratio


@pytest.mark.parametrize(("ends", "ratio"), SIMPSON.items())
def test_the_gears_of_a_simpson_set_have_exact_ratios_and_balanced_torques(ends, ratio):
    assert exugear.exact_ratios(simpson(), driving=ends[0], held=ends[1])["out"] == ratio
    box = exugear.Gearbox(simpson(), driving=ends[0], held=ends[1], driven="out")
    torques = dict(zip([shaft.name for shaft in box.shafts], -box.rows.T @ box.static_forces(100.0), strict=True))
    assert torques[ends[0]] + torques["out"] + torques[ends[1]] == pytest.approx(0.0, abs=1e-9)
    assert abs(torques[ends[0]]) == pytest.approx(100.0 * abs(ratio), rel=1e-12)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("driving", "held"), [("small", "carrier"), ("large", "carrier"), ("small", "large")])
def test_all_meshes_of_a_ravigneaux_set_tell_the_same_teeth(driving, held, side):
    sets = ravigneaux(side=side)
    box = exugear.Gearbox(sets, driving=driving, held=held, driven="ring")
    for shaft in box.shafts:
        for axial, of_shaft in shaft.gears.items():
            assert apart(tooth_angles(box, shaft.name, axial), of_shaft.z) < 1e-9
    table = sets[1].mesh_phases(direction=box.flank_senses[6])
    miss = np.r_[table["sun_phase"].values - box.phases[6::2], table["planet_phase"].values - box.phases[7::2]]
    assert np.abs(miss - np.round(miss)).max() < 1e-9


def test_a_stepped_set_has_the_ratio_of_both_its_steps():
    """Held ring: w_s / w_c = 1 + z_1 |z_r| / (z_s z_2)."""
    ratios = stepped().ratios("sun", "ring")
    assert ratios["carrier"] == 1 / (1 + Fraction(36 * 81, 24 * 21))


@pytest.mark.parametrize("driving", ["sun", "carrier"])
@pytest.mark.parametrize("angles", [(0.0, 120 * deg, 240 * deg), (0.0, 93 * deg, 93 * deg + 2 * pi / 1140 * 499)])
def test_the_gears_of_stepped_planets_stand_as_their_steps_say(driving, angles):
    """The tooth at the sun is the one to put in; from tooth 0 the other gear has a tooth at step_angle."""
    angles = tuple(np.round(np.array(angles) * 1140 / (2 * pi)) * 2 * pi / 1140)
    gears = stepped(angles=angles, step_angle=3 * deg)
    box = exugear.Gearbox([gears], held="ring", driving=driving)
    d, z_s, z_1, z_2 = box.flank_senses[0], 24, 36, 21
    for n, angle in enumerate(angles):
        at_sun, at_ring = (tooth_angles(box, f"planet {n + 1}", axial)[0] for axial in (0.0, 40 * mm))
        # Unreduced phases say which tooth tooth_angles has; the one to put in is counted at d = 1.
        whole = round(-d * z_s * angle / (2 * pi) - box.phases[2 * n])
        counted = np.floor(-z_s * angle / (2 * pi) + 1e-6)
        tooth_0 = at_sun - (gears.teeth[n] - counted + d * whole) * 2 * pi / z_1
        assert apart([tooth_0 + 3 * deg, at_ring], z_2) < 1e-9
    assert apart(tooth_angles(box, "ring", 40 * mm), 81) < 1e-9


def test_teeth_are_chosen_so_that_stepped_planets_fit_or_angles_and_steps_that_would_are_named():
    fine = 2 * pi / 1140
    assert stepped(angles=(0.0, 361 * fine, 722 * fine)).teeth != (0, 0, 0)
    with pytest.raises(ValueError, match=r"z_1 .z_ring. . z_2 z_sun = 3420 .* multiple of 3.*angles=.*step_angle="):
        stepped(angles=(0.0, 380.4 * fine, 760 * fine))
    with pytest.raises(ValueError, match=r"with the teeth \[0, 1, 0\] .* these fit: tooth=\(0, 0, 0\)"):
        stepped(tooth=(0, 1, 0))
    with pytest.raises(ValueError, match="step_angle must be a number or have a value for each of 3 planets"):
        stepped(step_angle=(0.1, 0.2))


def test_step_angles_that_are_advised_fit():
    """A planet whose gears are turned against each other by 1/10 of what assembles."""
    least = 2 * pi * 3 / (36 * 21)
    with pytest.raises(ValueError, match="or turn their gears: step_angle="):
        stepped(step_angle=(0.0, 0.1 * least, 0.0))
    assert stepped(step_angle=(0.0, least, 0.0)).teeth != (0, 0, 0)


def test_words_of_a_stepped_set_tell_both_meshes():
    text = str(stepped(angles=tuple(2 * pi * k / 4 for k in range(4))))
    assert "24/36-21/-81 teeth" in text
    assert "at the sun: all planets mesh in phase" in text
    assert "at the ring: planets mesh in sequence" in text
    assert "teeth at the sun when it is assembled" in text


def test_inner_planets_that_cannot_be_are_refused_in_words():
    outer, inner = ravigneaux()
    parts = {"outer": outer, "sun": inner.sun, "sun_mesh": waving_law(), "planet_mesh": waving_law()}
    tiny, long = gear(14), outer.sun_pair.wheel
    with pytest.raises(ValueError, match="must form a triangle"):
        pairs = {"sun_pair": zero_pair(gear(12), tiny), "planet_pair": zero_pair(tiny, long)}
        exugear.InnerPlanets(**parts | pairs)
    with pytest.raises(ValueError, match=r"inner planets cannot be assembled.*angles of the outer set that fit"):
        small = gear(31)
        pairs = {"sun_pair": zero_pair(small, gear(20)), "planet_pair": inner.planet_pair}
        exugear.InnerPlanets(**parts | pairs | {"sun": exugear.Shaft("small", {0.0: small})})
    with pytest.raises(ValueError, match="side must be"):
        exugear.InnerPlanets(**parts, sun_pair=inner.sun_pair, planet_pair=inner.planet_pair, side=0)


def zero_pair(pinion: fem.Gear, wheel: fem.Gear) -> fem.GearPair:
    return fem.GearPair(pinion, wheel, a=(pinion.z + wheel.z) * 1.5 * mm)


def test_coupled_sets_without_a_reaction_member_name_the_members_to_hold():
    with pytest.raises(ValueError, match=r"2 speeds are free.*hold one of \['large', 'carrier', 'ring'\].*speeds="):
        exugear.Gearbox(ravigneaux(), driving="small", driven="ring")


def test_a_sun_with_two_gears_must_say_which_one_meshes():
    first, second = simpson()
    assert [stage.axial_positions[0] for stage in (first.stages[0], second.stages[0])] == [0.0, 60 * mm]
    with pytest.raises(ValueError, match=r"carries its gear at \[0.0, 60.0\] mm; say which one"):
        pairs = {"sun_pair": first.sun_pair, "ring_pair": first.ring_pair}
        planetary(sun=first.sun, carrier=carrier_shaft(), ring=ring_shaft("ring", first.ring_pair), **pairs)
    with pytest.raises(ValueError, match=r"axial_position must be one of \[0.0\] mm"):
        planetary(sun=exugear.Shaft("sun", {0.0: GEAR}), axial_position=10 * mm)
