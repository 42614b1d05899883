"""`fem.Slices`: slices at the edge of the contact carry load on a part of their width."""

import numpy as np
import pytest
from paper_gears import paper_gear

import fem
from fem import Density
from fem.units import deg, mm, um

ROUGH = Density(flank=10, fillet=2, tooth=2, rim=2, body=3, width=3)


def pair_of(z: tuple[int, int], m_n: float, b: float, beta: float, **pinion) -> fem.GearPair:
    gears = zip(z, (beta, -beta), (pinion, {}), strict=True)
    return fem.GearPair(
        *(fem.Gear(z=n, m_n=m_n, b=b, beta=hand, d_bore=n * m_n / 2, **part) for n, hand, part in gears)
    )


HELICAL = [pair_of((19, 43), 4 * mm, 50 * mm, 25 * deg), pair_of((26, 31), 3 * mm, 42 * mm, 30 * deg)]
CROWNED = pair_of((30, 30), 3 * mm, 30 * mm, 0.0, flank=(fem.LeadCrowning(8 * um),))
#: Pinion torque per line load [N m / (N/mm)]
PER_LINE_LOAD = 1e3 * CROWNED.b * CROWNED.pinion.r_b


def map_of(pair, torque, phases=16, resolution=None, misalignment=0.0):
    offsets, resolution = fem.Offsets(misalignment=misalignment), resolution or fem.Slices(ROUGH)
    return fem.static_transmission_error(pair, torque, phases, offsets=offsets, resolution=resolution, progress=False)


@pytest.mark.parametrize(("pair", "torque"), [(HELICAL[0], 400), (HELICAL[1], 300)], ids=("19/43", "26/31"))
def test_peak_to_peak_of_helical_pairs_needs_few_slices(pair, torque):
    """Today within 20 nm; slices that are in or out by their middle are 0.1 to 0.3 um off."""
    few, many = (np.ptp(map_of(pair, torque, 32, fem.Slices(ROUGH, n))["te"].values) for n in (20, 48))
    assert few == pytest.approx(many, abs=0.04 * um)


def test_light_loads_on_crowned_misaligned_flanks_deflect_as_resolved_by_strips():
    torque, tilt = PER_LINE_LOAD * np.array([0, 0.1, 1, 10]), 2e-4
    te = [
        map_of(CROWNED, torque, 4, resolution, tilt)["te"].values
        for resolution in (fem.Slices(ROUGH), fem.Resolution(ROUGH))
    ]
    assert te[0][0] == pytest.approx(te[1][0], abs=1e-3 * um)
    deflection = [(loaded[1:] - loaded[0]).mean(axis=1) for loaded in te]
    assert deflection[0] == pytest.approx(deflection[1], rel=0.01)


@pytest.mark.parametrize(
    ("pair", "torque", "tilt"),
    [(CROWNED, 0.1 * PER_LINE_LOAD, 2e-4), (CROWNED, 30 * PER_LINE_LOAD, 2e-4), (HELICAL[0], 400, 1e-4)],
)
def test_stiffness_is_the_slope_of_the_force(pair, torque, tilt):
    step = 2e-4
    ste = map_of(pair, torque * np.array([1 - step, 1, 1 + step]), 4, misalignment=tilt)
    slope = 2 * step * torque / pair.pinion.r_b / (ste["te"].values[2] - ste["te"].values[0])
    assert ste["stiffness"].values[1] == pytest.approx(slope, rel=1e-3)


def test_misalignment_and_force_are_conservative():
    """Of the complementary energy V, te = dV/dF and F centroid = dV/dmisalignment: the mixed derivatives are equal."""
    step, tilt, loads = 1e-3, 2e-4 + np.array([-1e-6, 0, 1e-6]), PER_LINE_LOAD * np.array([0.3, 30])
    torque = np.outer(loads, [1 - step, 1, 1 + step]).ravel()
    ste = map_of(CROWNED, torque, 4, misalignment=tuple(tilt)).transpose("misalignment", ...)
    te, centroid = ste["te"].values[:, 1::3], ste["centroid"].values[1]
    by_misalignment = (te[2] - te[0]) / (tilt[2] - tilt[0])
    by_force = ((1 + step) * centroid[2::3] - (1 - step) * centroid[0::3]) / (2 * step)
    assert by_misalignment == pytest.approx(by_force, rel=5e-3)


@pytest.mark.parametrize("length", [1 * mm, 2 * mm])
def test_heavy_loads_on_reliefs_deflect_as_resolved_by_strips(length):
    """Teeth that turn touch at corners where they had a gap: a contact that begins by a jump is not found."""
    gear = paper_gear(flank=(fem.TipRelief(15 * um, length),))
    pair, torque = fem.GearPair(gear, gear, a=150 * mm), [2, 10, 30, 70, 150, 250, 350, 450, 700, 1200]
    slices = map_of(pair, torque, 24, fem.Slices())["te"].values
    strips = map_of(pair, torque[6::3], 24, fem.Resolution())["te"].values
    assert (np.diff(slices, axis=0) > 0).all()
    assert slices[6::3].mean(axis=1) == pytest.approx(strips.mean(axis=1), rel=4e-3)


def test_helical_maps_by_strips_say_how_far_their_peak_to_peak_may_be_off():
    """Twice the difference from `Slices` bounds the error that 20 slices inside the loaded width leave."""
    pair, torque = HELICAL[1], [0, 1000]
    few, many = (map_of(pair, torque, 16, fem.Resolution(ROUGH, slices)) for slices in (20, 48))
    error = np.abs(np.ptp(few["te"].values, axis=1) - np.ptp(many["te"].values, axis=1))
    assert few["error_slices"].dims == ("torque",)
    assert few["error_slices"].values[0] == 0
    assert error[1] < few["error_slices"].values[1] < 0.5 * np.ptp(few["te"].values[1])
    assert "error_slices" not in map_of(CROWNED, 10 * PER_LINE_LOAD, 4, fem.Resolution(ROUGH))
