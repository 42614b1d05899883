"""Order maps: amplitudes at the orders, nothing aliased, all windows."""

import numpy as np
import pytest
import xarray as xr
from sweeps import linear_sweep, with_orders

import exugear

MESH = {57: (lambda speed: 2 + 0 * speed, 0.0), 114: (lambda speed: 0.5 + speed / 400, 1.0)}


@pytest.mark.parametrize("window", ["hann", "flattop", ("kaiser", 9.0)])
def test_a_map_holds_the_amplitude_of_each_order_over_speed(window):
    tracked = exugear.order_tracking(with_orders(linear_sweep(), MESH, mean=7.0), highest_order=150, window=window)
    for order, (amplitude, _) in MESH.items():
        cut = tracked["amplitude"].sel(order=order)
        assert cut.values == pytest.approx(amplitude(tracked["speed"].values), rel=2e-3)
    away = np.abs(tracked["order"].values[:, None] - list(MESH)).min(axis=1) > 2
    assert tracked["amplitude"].values[:, away].max() < 2e-3


def test_a_flat_top_window_reads_amplitudes_between_the_lines_of_order():
    signal = with_orders(linear_sweep(), {57.06: (lambda speed: 1 + 0 * speed, 0.0)})
    hann, flat = (exugear.order_tracking(signal, highest_order=100, window=name) for name in ("hann", "flattop"))
    assert flat["amplitude"].max("order").values == pytest.approx(1, abs=0.002)
    assert hann["amplitude"].max("order").values == pytest.approx(0.84, abs=0.02)


def test_lines_overlap_as_asked():
    signal = with_orders(linear_sweep(), MESH)
    half, quarter = (exugear.order_tracking(signal, highest_order=150, overlap=share) for share in (0.5, 0.75))
    assert quarter.sizes["time"] == pytest.approx(2 * half.sizes["time"], abs=1)
    for window in ("round", ("kaiser", "a"), ("kaiser", np.nan), 5.0):
        with pytest.raises(ValueError, match="window must be one of scipy"):
            exugear.order_tracking(signal, highest_order=150, window=window)
    assert exugear.order_tracking(signal, highest_order=150, window=("general_gaussian", 1, 2.0)).sizes["time"]


def test_results_are_written_as_netcdf_and_have_units(tmp_path):
    signal = with_orders(linear_sweep(2.0), MESH)
    results = {
        "cut": exugear.order_cut(signal, list(MESH)),
        "map": exugear.order_tracking(signal, highest_order=120, revolutions=4),
        "waterfall": exugear.waterfall(signal, resolution=50.0),
    }
    for name, result in results.items():
        result.to_netcdf(tmp_path / f"{name}.nc", engine="h5netcdf")
        xr.testing.assert_identical(xr.load_dataset(tmp_path / f"{name}.nc", engine="h5netcdf"), result)
        assert all({"units", "long_name"} <= set(values.attrs) for values in result.variables.values())
