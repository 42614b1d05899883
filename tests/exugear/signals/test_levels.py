"""Levels re stated values, sums of channels."""

import numpy as np
import pytest
import xarray as xr

import exugear


def test_levels_re_iso_1683():
    """1 Pa is 94 dB re 20 uPa, 1 m/s^2 and 1 N are 120 dB, 1 m/s is 180 dB, 1 um is 120 dB."""
    for units, rms, expected in (
        ("Pa", 1, 93.979),
        ("m/s^2", 1, 120),
        ("N", 1, 120),
        ("m/s", 1, 180),
        ("m", 1e-6, 120),
    ):
        level = exugear.level(xr.DataArray(float(rms), attrs={"units": units}))
        assert float(level) == pytest.approx(expected, abs=1e-3)
        assert level.attrs["units"] == "dB"
        assert units in level.attrs["long_name"]


def test_levels_of_numbers_need_a_reference():
    assert exugear.level([1.0, 10.0, 0.0], 0.1) == pytest.approx([20, 40, -200])
    for rms, reference, words in (
        (1.0, None, "reference must be given for the units '1'"),
        (1.0, 0.0, "reference must be > 0"),
        (1.0, np.inf, "reference must be > 0 and finite"),
        ([1.0, -2.0], 1.0, "rms must be >= 0, got -2"),
    ):
        with pytest.raises(ValueError, match=words):
            exugear.level(rms, reference)


def test_two_bearings_of_the_same_rms_are_3_db_more():
    channels = xr.DataArray(np.full((2, 3), 5.0), dims=("bearing", "direction"), attrs={"units": "N"})
    total = exugear.rms_sum(channels, over="bearing")
    assert exugear.level(total).values - exugear.level(channels).values[0] == pytest.approx(3.0103)
    assert float(exugear.rms_sum(channels, over=["bearing", "direction"])) == pytest.approx(5 * np.sqrt(6))
    with pytest.raises(ValueError, match="over must be different dimensions of the channels"):
        exugear.rms_sum(channels, over="stage")
    for over in ([], ["bearing", "bearing"]):
        with pytest.raises(ValueError, match="over must be different dimensions of the channels"):
            exugear.rms_sum(channels, over=over)
    assert exugear.rms_sum(channels * np.exp(0.7j), over="bearing").values == pytest.approx(total.values)


def test_a_channel_that_is_missing_makes_the_sum_missing():
    channels = xr.DataArray([[3.0, np.nan], [4.0, 1.0]], dims=("bearing", "time"))
    assert exugear.rms_sum(channels, over="bearing").values == pytest.approx([5.0, np.nan], nan_ok=True)
