"""Arguments that ask for more values than memory holds are refused at once, with what to pass instead."""

import numpy as np
import pytest
from scenes import smooth_box

import exugear

TIME = np.linspace(0, 10, 20001)
#: From 10 to 110 revolutions a second, 200 to 18 samples a revolution; and from rest.
SIGNAL = exugear.recorded_signal(TIME, 2 * np.pi * (10 + 10 * TIME), np.sin(TIME))
FROM_REST = exugear.recorded_signal(TIME, 2 * np.pi * 10 * TIME, np.sin(TIME))
TOO_COARSE = "no 8 revolutions are sampled well enough for order .*; sample finer, or pass 8"


@pytest.mark.parametrize(
    ("function", "arguments", "words"),
    [
        (exugear.order_tracking, {"highest_order": 1e9}, TOO_COARSE),
        (exugear.order_tracking, {"highest_order": 1e300}, TOO_COARSE),
        (exugear.order_tracking, {"highest_order": 10, "revolutions": 1e300}, "a window takes 1e.300; record longer"),
        (
            exugear.over_angle,
            {"highest_order": 1e9},
            r"highest_order = 1e\+09 asks for .* 5e\+08; pass .* at most",
        ),
        (exugear.over_angle, {"highest_order": 1e300}, "at most"),
        (exugear.order_cut, {"orders": [1e9]}, "no period of an order .* sample finer"),
        (exugear.order_cut, {"orders": [1, 1e9]}, "a window of 2 orders up to 1e.09 asks for .*; pass fewer or lower"),
        (exugear.order_cut, {"orders": [1, 1e300]}, "pass fewer or lower orders"),
        (exugear.order_cut, {"orders": np.arange(1, 5000) / 50}, "a window of 4999 orders up to 99.98 asks for"),
        (exugear.order_cut, {"orders": [1, 1 + 1e-9]}, "a window of 4e.09 revolutions"),
        (exugear.order_cut, {"orders": [1, 2], "overlap": 1 - 1e-12}, "overlap = 0.999999999999 asks for"),
        (exugear.spectrogram, {"resolution": 1e-300}, "resolution must lie in"),
    ],
)
@pytest.mark.parametrize("signal", [SIGNAL, FROM_REST])
def test_maps_that_memory_cannot_hold_are_refused(signal, function, arguments, words):
    with pytest.raises(ValueError, match=words):
        function(signal, **arguments)


def test_spectra_that_overlap_almost_wholly_are_refused_where_memory_cannot_hold_them():
    time = np.arange(200_000) / 2e4
    long = exugear.recorded_signal(time, np.full(time.size, 2 * np.pi), np.sin(time))
    for function, arguments in (
        (exugear.spectrogram, {"resolution": 2.0}),
        (exugear.order_tracking, {"highest_order": 8000, "revolutions": 1.0}),
    ):
        with pytest.raises(ValueError, match="let the windows overlap less, or pass fewer channels"):
            function(long, **arguments, overlap=1 - 1e-9)


def test_a_waterfall_of_more_lines_than_spectra_has_all_spectra():
    spectra = exugear.spectrogram(SIGNAL, overlap=0.75)
    assert exugear.waterfall(SIGNAL, lines=10**12).sizes["speed"] == spectra.sizes["time"]


def test_numbers_of_harmonics_windows_and_speeds_are_bounded():
    model = exugear.build(smooth_box())
    run = exugear.run_up(model, speed=(50.0, 60.0), load=100.0, duration=0.1, progress=False, checks=0)
    for function, arguments, words in (
        (exugear.mesh_orders, {"harmonics": 10**9}, r"harmonics must lie in \[1, 1000\]"),
        (exugear.mesh_orders, {"side_bands": 10**9}, r"side_bands must lie in \[0, 1000\]"),
        (exugear.resonances, {"harmonics": 10**9}, r"harmonics must lie in \[1, 100\]"),
    ):
        with pytest.raises(ValueError, match=words):
            function(run, **arguments)
    with pytest.raises(ValueError, match="speed must hold 10000 values at most"):
        exugear.campbell(model, speed=np.linspace(0.0, 60.0, 10001), load=100.0)
    with pytest.raises(ValueError, match="rate must lie in"):
        exugear.write_sound("none.wav", exugear.signal(run, "dte"), rate=10**12)
