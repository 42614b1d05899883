"""Resonances that are planted are found, with the harmonic that excites them, and no others."""

import numpy as np
import pytest
import xarray as xr
from sweeps import DAMPING, MODE, receptance, swept_by_two_stages

import exugear

TEETH, TOP, NATURAL, DURATION = 57, 3000.0, 2000.0, 8.0
#: Amplitude of the mesh harmonics that excite the oscillator [m].
EXCITATION = {1: 4e-6, 2: 2e-6, 3: 1e-6}


def swept(harmonics: dict[int, float], noise: float = 0.0) -> xr.Dataset:
    """Run-up from 150 Hz of mesh frequency of an oscillator that mesh harmonics excite; data of a run."""
    time = np.arange(0, DURATION, 4e-5)
    frequency = 150 + (TOP - 150) * time / DURATION
    cycles = 150 * time + (TOP - 150) * time**2 / (2 * DURATION)
    dte = sum(
        amplitude * receptance(k * frequency, NATURAL) * np.cos(2 * np.pi * k * cycles)
        for k, amplitude in harmonics.items()
    )
    dte = dte + noise * np.random.default_rng(2).normal(size=time.size)
    return xr.Dataset(
        {
            "speed": ("time", 2 * np.pi * frequency / TEETH),
            "mesh_frequency": (("stage", "time"), [frequency]),
            "dte": (("stage", "time"), [dte]),
            "mesh_force": (("stage", "time"), [0 * time]),
        },
        coords={"time": time, "stage": ["a-b"]},
    )


def test_superharmonics_are_labelled_with_their_harmonic():
    table = exugear.resonances(swept(EXCITATION))
    assert table["harmonic"].values.tolist() == [3, 2, 1]
    assert table["mesh_frequency"].values == pytest.approx([NATURAL / k for k in (3, 2, 1)], rel=0.01)
    assert table["response_frequency"].values == pytest.approx(NATURAL, rel=0.01)
    assert table.attrs["resonances"].startswith("3 of ")
    heights = [EXCITATION[k] * receptance(NATURAL, NATURAL) for k in (3, 2, 1)]
    assert table["harmonic_amplitude"].values == pytest.approx(heights, rel=0.02)
    assert table["amplitude"].values[-1] == pytest.approx(heights[-1], rel=0.05)
    assert table["mesh_frequency"].attrs["units"] == "Hz"


def test_noise_makes_no_marks():
    noisy = exugear.resonances(swept(EXCITATION, noise=1e-7))
    assert noisy["harmonic"].values.tolist() == [3, 2, 1]
    none = exugear.resonances(swept({1: 0.0}, noise=1e-6))
    assert none.sizes["peak"] == 0


def test_a_tone_of_constant_frequency_is_no_resonance_of_the_mesh():
    """Its burst lifts the envelope at 900 Hz of mesh frequency, but no mesh harmonic peaks there."""
    run = swept(EXCITATION)
    time = run["time"].values
    burst = 2e-5 * np.exp(-(((run["mesh_frequency"].values[0] - 1300) / 60) ** 2)) * np.sin(2 * np.pi * 777 * time)
    run["dte"] = run["dte"] + burst
    envelope = exugear.dte_envelope(run)
    assert envelope.peaks().abscissa.size == 4
    assert exugear.resonances(run)["harmonic"].values.tolist() == [3, 2, 1]


@pytest.mark.slow
def test_resonances_that_another_stage_excites_name_that_stage():
    """The same vibration in the DTE of a stage whose mesh frequency is 2.3 times as high."""
    run = swept(EXCITATION)
    frequency, dte = (run[name].values[0] for name in ("mesh_frequency", "dte"))
    rows = {"mesh_frequency": [frequency, 2.3 * frequency], "dte": [dte, dte], "mesh_force": [0 * dte, 0 * dte]}
    data = xr.Dataset({name: (("stage", "time"), values) for name, values in rows.items()} | {"speed": run["speed"]})
    table = exugear.resonances(data.assign_coords(stage=["a-b", "b-c"], time=run["time"]), 1)
    assert table["exciting_stage"].values.tolist() == ["a-b"] * 3
    assert table["harmonic"].values.tolist() == [3, 2, 1]
    assert table["mesh_frequency"].values == pytest.approx([2.3 * NATURAL / k for k in (3, 2, 1)], rel=0.01)
    assert table["response_frequency"].values == pytest.approx(NATURAL, rel=0.01)


@pytest.mark.parametrize("stage", [0, 1])
def test_resonances_by_close_orders_of_two_stages_are_told_apart(stage):
    """The higher order reaches the mode first; either has the amplitude that it has at the peak of the envelope."""
    table = exugear.resonances(swept_by_two_stages(8.0), stage)
    assert table["exciting_stage"].values.tolist() == ["b-c", "a-b"]
    assert table["harmonic"].values.tolist() == [1, 1]
    assert table["response_frequency"].values == pytest.approx(MODE, rel=0.01)
    heights = 4e-6 * receptance(table["response_frequency"].values, MODE, DAMPING)
    assert table["harmonic_amplitude"].values == pytest.approx(heights, rel=0.07)


def test_peaks_of_the_envelope_at_one_peak_of_a_harmonic_are_one_resonance():
    """Beats of 10 Hz split the peak of the envelope at the main resonance."""
    run = swept(EXCITATION)
    run["dte"] = run["dte"] * (1 + 0.2 * np.sin(2 * np.pi * 10 * run["time"]))
    envelope = exugear.dte_envelope(run)
    assert envelope.peaks().abscissa.size == 5
    table = exugear.resonances(run)
    assert sorted(table["harmonic"].values.tolist()) == [1, 2, 3]


def test_close_orders_stay_together_in_a_run_that_changes_its_speed_too_fast():
    assert set(exugear.resonances(swept_by_two_stages(0.5))["harmonic"].values) == {1}


def test_a_run_without_resonances_says_over_which_frequencies():
    data = swept(EXCITATION)
    table = exugear.resonances(data.isel(time=slice(0, 20000)), harmonics=1)
    assert table.sizes["peak"] == 0
    assert "peaks of the envelope, at 15" in table.attrs["resonances"]
