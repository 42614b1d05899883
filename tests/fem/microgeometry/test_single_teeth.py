"""Deviations around the gear and of single teeth: where material is removed, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from coarse_maps import COARSE
from ring_gears import thin_ring_pair

import fem
from fem.units import mm, um


def gear(z: int = 23, beta: float = 0.0, **changes) -> fem.Gear:
    return fem.Gear(z=z, m_n=3 * mm, b=20 * mm, beta=beta, d_bore=20 * mm, **changes)


def pair(pinion=(), wheel=(), beta: float = 0.0) -> fem.GearPair:
    return fem.GearPair(gear(23, beta, flank=pinion), gear(47, -beta, flank=wheel))


@pytest.mark.parametrize(("beta", "turning"), [(0.0, "pinion"), (np.radians(20), "wheel")])
def test_waviness_is_continuous_along_the_generation(beta, turning):
    """Unloaded, the transmission error is the undulation, whichever tooth pair touches."""
    part = fem.Waviness(5, 2 * um, 0.4)
    z = 23 if turning == "pinion" else 47
    phase, coarse = np.arange(40) / 4.0, fem.Resolution(COARSE.density)
    waved = pair(**{turning: part}, beta=beta)
    te = fem.static_transmission_error(waved, 0, phase, resolution=coarse, progress=False)["te"].values[0]
    wave = np.exp(1j * 2 * np.pi * 5 * phase / z)
    basis = np.array([wave.real, wave.imag]).T
    amplitudes, *_ = np.linalg.lstsq(basis, te, rcond=None)
    assert np.hypot(*amplitudes) == pytest.approx(2 * um, rel=0.01)
    assert np.abs(te - basis @ amplitudes).max() < 0.03 * um


def test_waviness_of_both_sides_belongs_to_the_same_teeth():
    """The mirror image of the mirror image is the gear."""
    flank = fem.Sides(
        (fem.Waviness(3, 2 * um, 0.1), fem.OnTooth(4, fem.LeadCrowning(um))), fem.PitchDeviation.run_out(23, um)
    )
    given = fem.GearPair(gear(flank=flank), gear(47))
    again = fem.mirror_image(fem.mirror_image(given))
    one, two = (x.pinion.drive_flank for x in (given, again))
    assert [type(part) for part in one] == [type(part) for part in two]
    assert two[0].angle == pytest.approx(0.1) and two[1] == one[1]
    assert again.pinion.coast_flank == given.pinion.coast_flank


def test_a_spall_softens_its_tooth_and_a_crack_does_so_more_at_the_tip():
    crack = fem.crack(gear(), lost=0.3)
    torque, phase = 300.0, np.array([0.0, 0.2])
    options = {"progress": False, "resolution": fem.Slices()}
    sound, spalled, cracked = (
        fem.static_transmission_error(pair(flank), torque, phase, **options)["te"].values[0]
        for flank in (
            (fem.OnTooth(0, ()),),
            (fem.OnTooth(0, fem.Spall(d=69 * mm, height=2 * mm, width=8 * mm)),),
            (fem.OnTooth(0, crack),),
        )
    )
    assert spalled[0] > 1.03 * sound[0] and spalled[1] == pytest.approx(sound[1], rel=0.02)
    added = cracked - sound
    assert added[0] > 0.05 * sound[0]
    twice = fem.crack(gear(), lost=0.6)
    assert twice.turn / crack.turn == pytest.approx((0.6 / 0.4) / (0.3 / 0.7))


def test_a_missing_tooth_leaves_its_load_to_its_neighbours():
    """Where it alone would carry, the flanks beside the path touch, and te rises by some 10 um."""
    phase = np.array([0.0, 0.5])
    whole = (fem.static_transmission_error(pair(x), 100.0, phase, progress=False)["te"].values[0] for x in missing())
    broken, sound = whole
    assert broken[0] > sound[0] + 5 * um


def missing() -> tuple:
    return fem.PitchDeviation.missing(23, [0]), fem.PitchDeviation([0.0] * 23)


def missing_teeth(*teeth: int) -> fem.PitchDeviation:
    return fem.PitchDeviation.missing(23, teeth)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fem.Waviness(0, um), r"order must be a whole number in \[1, 1e4\), got 0"),
        (lambda: fem.Waviness(2.5, um), "order must be a whole number"),
        (lambda: fem.Waviness(3, 5.0), "amplitude must lie in"),
        (lambda: fem.OnTooth(1.5, ()), "tooth must be a whole number"),
        (lambda: fem.OnTooth(1, 5), "flank must hold modifications"),
        (lambda: fem.OnTooth(1, fem.Waviness(3, um)), "holds .'Waviness'., which are of all teeth"),
        (lambda: gear(flank=fem.OnTooth(23, fem.HelixSlope(um))), "tooth must be one of 23 teeth, 0 to 22, got 23"),
        (lambda: gear(flank=fem.OnTooth(1, fem.Spall(d=30 * mm, height=mm, width=mm))), "d, where a relief begins"),
        (lambda: fem.Spall(d=69 * mm, height=mm, width=5.0), r"width must lie in \[1e-05, 1\] m"),
        (lambda: fem.crack(gear(), lost=1.0), r"lost must lie in \(0, 1\)"),
        (lambda: fem.crack(thin_ring_pair().wheel, lost=0.5), "gear must be external"),
        (lambda: fem.PitchDeviation.missing(23, [0.5]), "teeth must be whole numbers"),
        (lambda: fem.PitchDeviation.missing(23, [23]), "teeth must be among 23 teeth, 0 to 22, got .23."),
        (lambda: fem.tooth_pair_map(pair(missing_teeth(3, 4)), 10.0), r"3, 4. of the pinion are missing.* 3 pitches"),
        (lambda: fem.tooth_pair_map(pair(missing_teeth(*range(23))), 10.0), "are missing: others would have to bridge"),
        (lambda: fem.tooth_pair_map(pair(), 0.0), "torque must be > 0 N m"),
        (lambda: fem.tooth_pair_map(pair(), 10.0, checks=-1), "checks must be a number of phases >= 0"),
    ],
)
def test_bad_input_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_maps_of_single_teeth_need_all_pitches():
    given = replace(pair(), pinion=gear(flank=fem.OnTooth(2, fem.HelixSlope(5 * um))))
    ste = fem.static_transmission_error(given, [0, 100], [0, 0.5, 1.5], progress=False, resolution=fem.Slices())
    assert ste.attrs["pitches"] == 2
