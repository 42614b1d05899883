"""Peak to peak of maps of few phases: the curve through them, and bounds of it and of the phases' own range."""

import numpy as np
import pytest
from coarse_maps import STRIPS, map_of
from modified_pairs import fzg_type_c
from paper_gears import paper_pair

import fem
from fem.units import mm, um


def map_over(phase, te, **attributes):
    return fem.ste_map(paper_pair(), np.arange(1.0, 1 + len(te)), phase, te, **attributes)


def test_peak_to_peak_of_a_wave_between_its_phases():
    """12 phases beside the crest and the trough of a cosine; where they meet these, both measures are exact."""
    phase = np.arange(12) / 12
    waves = um * np.array([np.cos(2 * np.pi * (phase - shift)) for shift in (0, 1 / 24)])
    on_crest, beside = fem.peak_to_peak(map_over(phase, waves))["peak_to_peak"].values
    assert on_crest == pytest.approx(2 * um, rel=1e-12)
    assert np.ptp(waves[1]) == pytest.approx(2 * um * np.cos(np.pi / 12), rel=1e-12)
    assert abs(beside - 2 * um) < 0.5 * abs(np.ptp(waves[1]) - 2 * um)


def test_maps_of_several_pitches_and_offsets_have_one_peak_to_peak_each():
    phase = np.arange(24) / 8
    te = um * np.cos(2 * np.pi * phase / 3) * np.array([1.0, 2.0])[:, None]
    over = fem.peak_to_peak(
        map_over(phase, te, pitches=3).expand_dims("misalignment").assign_coords(misalignment=[0.0])
    )
    assert over["peak_to_peak"].dims == ("misalignment", "torque")
    assert over["peak_to_peak"].values[0] == pytest.approx([2 * um, 4 * um], rel=1e-9)
    assert np.isnan(over["error"]).all() and "accuracy=" in over["error"].attrs["reason"]
    with pytest.raises(ValueError, match="ste must have 12 phases or more, 4 in a pitch, for a peak to peak, got 8"):
        fem.peak_to_peak(map_over(phase[:8], te[:, :8], pitches=3))


def relieved(C_a: float) -> fem.GearPair:
    """33 and 34 teeth of module 2 mm with tip relief over 2 mm of the roll length."""
    pinion, wheel = (
        fem.Gear(z=z, m_n=2 * mm, b=20 * mm, d_bore=z * mm, flank=(fem.TipRelief(C_a, 2 * mm),)) for z in (33, 34)
    )
    return fem.GearPair(pinion, wheel, a=67.04 * mm)


@pytest.mark.parametrize(
    ("C_a", "misalignment", "torque", "phases"),
    [pytest.param(30 * um, 5e-5, 200, 24, marks=pytest.mark.slow), (20 * um, 1e-4, 100, 30)],
)
def test_stated_errors_of_a_relieved_misaligned_pair_hold(C_a, misalignment, torque, phases):
    """The phases' own range is 0.157 and 0.064 um too small; the true peak to peak is that of 240 phases."""
    pair, offsets = relieved(C_a), fem.Offsets(misalignment=misalignment)
    ste = fem.static_transmission_error(pair, [0, torque], phases, accuracy=0.01, offsets=offsets, progress=False)
    dense = fem.static_transmission_error(pair, torque, 240, offsets=offsets, progress=False)
    true, te = np.ptp(dense["te"].values), ste["te"].values[1]
    curve = fem.peak_to_peak(ste).isel(torque=1)
    assert 0.06 * um < true - np.ptp(te) < ste["error_p2p"][1] < 3 * (true - np.ptp(te))
    assert abs(curve["peak_to_peak"] - true) < curve["error"] < ste["error_p2p"][1]
    assert abs(curve["peak_to_peak"] - true) < true - np.ptp(te)


def test_stated_error_covers_the_peak_to_peak_of_a_map_of_few_phases():
    """24 phases by slices rank two reliefs in the wrong order; the estimated error covers the difference."""
    for C_a in (40 * um, 50 * um):
        pair = fzg_type_c(C_a)
        ste = fem.static_transmission_error(pair, [302], 24, accuracy=0.1, progress=False)
        true = np.ptp(map_of(pair, [302], 96, STRIPS)["te"].values)
        stated = fem.peak_to_peak(ste).isel(torque=0)
        assert 0 < abs(stated["peak_to_peak"] - true) < stated["error"]
        assert abs(np.ptp(ste["te"].values) - true) < ste["error_p2p"][0]
