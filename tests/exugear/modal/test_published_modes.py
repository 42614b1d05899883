"""Published natural frequencies: a pair on bearings, and planetary sets."""

import numpy as np
import planetary_set
import pytest
from measured_rows import deviation
from modal_boxes import FOUR_PLANETS, THREE_PLANETS, pair_of_shafts, planets

import exugear

#: Both gears free to spin and to move along the line of action on a spring (validation, section 2) [N/m, Hz].
ON_BEARINGS = {1e9: (2078.72, 2851.86, 4765.41), 2e8: (1002.75, 1275.39, 4417.94)}


@pytest.mark.parametrize("k", ON_BEARINGS)
def test_pair_on_bearings_has_the_known_frequencies(k, measured):
    """Across the line of action both shafts move alone."""
    data = exugear.modes(pair_of_shafts(exugear.Bearing(k, 1e9, 1e6)), load=1.0, drive="free")
    low, middle, high = ON_BEARINGS[k]
    rigid, *elastic = data["frequency"].values
    assert rigid == 0
    error = deviation(elastic, [low, middle, middle, middle, high])
    measured("modes of a pair on bearings, ky 1e9 and 2e8 N/m", error, 1e-4)


@pytest.mark.parametrize(("number", "published"), [(3, THREE_PLANETS), (4, FOUR_PLANETS)])
def test_planetary_set_has_the_published_frequencies(number, published, measured):
    data = exugear.modes(planets(number))
    assert data["frequency"].values[0] == published[0] == 0
    error = deviation(data["frequency"].values[1:], published[1:])
    measured(f"all modes of a planetary set with {number} planets", error, 5e-4)
    assert "sun-planet 1" in data["stage"]
    assert float(data["energy_share"].sel(mode=slice(2, None)).sum("element").min()) == pytest.approx(1, rel=1e-12)


def test_planets_translate_the_sun_in_pairs_of_modes_and_spin_it_in_single_ones():
    data = exugear.modes(planets(3))
    moved = np.hypot(data["shape"], data["shape_imaginary"]).sel(coordinate=["sun x", "sun y", "sun spin"]).values
    x, y, spin = moved.T * np.array([1.0, 1.0, planetary_set.R_SUN])[:, None]
    translation = np.array([1, 2, 3, 4, 6, 7, 9, 10])
    assert (spin[translation] < 1e-4 * np.hypot(x, y)[translation]).all()
    assert (np.hypot(x, y)[[0, 5, 8, 11]] < 1e-4 * spin[[0, 5, 8, 11]]).all()
