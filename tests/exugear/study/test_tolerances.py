"""Monte Carlo over tolerances, rank correlation and Sobol indices."""

from dataclasses import replace

import numpy as np
import pytest
import scipy
import studies
import xarray as xr

import exugear
import fem
from fem.units import mm, um

UNIFORM = scipy.stats.uniform(-np.pi, 2 * np.pi)
THREE = {"a": UNIFORM, "b": UNIFORM, "c": UNIFORM}


def test_draws_have_the_percentiles_of_their_distributions():
    data = exugear.monte_carlo(lambda level: level, {"level": scipy.stats.norm(2.0, 0.5)}, number=2000, progress=False)
    low, middle, high = data["result"].quantile([0.05, 0.5, 0.95], "case").values
    assert middle == pytest.approx(2.0, abs=0.04)
    assert (high - low) / 2 == pytest.approx(0.5 * 1.645, rel=0.03)


def test_a_longer_study_begins_with_the_cases_of_a_shorter_one():
    short, long = (exugear.monte_carlo(studies.ishigami, THREE, number=n, seed=3, progress=False) for n in (5, 20))
    xr.testing.assert_identical(short, long.isel(case=slice(5)))
    other = exugear.monte_carlo(studies.ishigami, THREE, number=5, seed=4, progress=False)
    assert not np.isin(other["a"], long["a"]).any()


def test_functions_may_draw_deviations_of_their_own():
    tolerances = {"level": scipy.stats.uniform(1, 1e-9)}
    first, again = (exugear.monte_carlo(studies.noisy, tolerances, number=50, progress=False) for _ in range(2))
    xr.testing.assert_identical(first, again)
    assert np.unique(first["drawn"]).size == 50


def test_rank_correlation_tells_the_tolerances_that_matter():
    def measured(steep, gentle, idle):
        return {"noise": np.exp(3 * steep - gentle), "two": ("k", [steep, -(idle**3)])}

    normal = scipy.stats.norm(0, 1)
    tolerances = {"steep": normal, "gentle": normal, "idle": normal}
    data = exugear.monte_carlo(measured, tolerances, number=400, progress=False)
    ranks = exugear.rank_correlation(data)
    # of two normal variables with the correlation r, Spearman's is 6/pi arcsin(r/2); r = 3/sqrt(10) and -1/sqrt(10)
    expected = 6 / np.pi * np.arcsin(np.array([3, -1]) / np.sqrt(10) / 2)
    assert ranks["noise"].values[:2] == pytest.approx(expected, abs=0.1)
    assert abs(float(ranks["noise"].sel(parameter="idle"))) < 0.1
    assert ranks["two"].sel(parameter="idle").values[1] == pytest.approx(-1)
    assert float(ranks["noise_p_value"].sel(parameter="steep")) < 1e-10


def test_sobol_indices_are_those_of_the_function_of_ishigami():
    indices = exugear.sobol_indices(studies.ishigami, THREE, number=1024, progress=False)
    assert indices["result_first_order"].values == pytest.approx([0.3139, 0.4424, 0.0], abs=0.02)
    assert indices["result_total"].values == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.04)
    assert float(indices["result_variance"]) == pytest.approx(13.8446, rel=0.02)


def test_a_truth_value_has_a_share_of_the_variance():
    indices = exugear.sobol_indices(lambda a, b: bool(a > 0.1 * b), {"a": UNIFORM, "b": UNIFORM}, progress=False)
    assert float(indices["result_first_order"].sel(parameter="a")) > 0.8


REFUSED_BY_SOBOL = {
    "tolerances must be two or more": (lambda a: a, {"a": UNIFORM}),
    "function must return finite numbers, result is not in": (lambda a, b: np.inf if a > 0 else b, THREE),
    "must have its parameters": (lambda a, b: a + b, {"a": scipy.stats.norm, "b": UNIFORM}),
    "must be of one number": (lambda a, b: a + b, {"a": scipy.stats.norm([0, 1], 1), "b": UNIFORM}),
}


@pytest.mark.parametrize("words", REFUSED_BY_SOBOL)
def test_sobol_indices_refuse_what_they_cannot_tell(words):
    function, tolerances = REFUSED_BY_SOBOL[words]
    two = {name: tolerances[name] for name in ("a", "b") if name in tolerances}
    with pytest.raises(ValueError, match=words):
        exugear.sobol_indices(function, two, number=16, progress=False)


def test_bad_tolerances_are_refused():
    with pytest.raises(ValueError, match=r"scipy.stats, say .* got 1.0 for 'a'"):
        exugear.monte_carlo(studies.ishigami, {"a": 1.0}, progress=False)
    with pytest.raises(ValueError, match="power of two"):
        exugear.sobol_indices(studies.ishigami, THREE, number=100, progress=False)
    with pytest.raises(ValueError, match="must not draw rng"):
        exugear.sobol_indices(studies.noisy, {"level": UNIFORM}, progress=False)
    with pytest.raises(ValueError, match="10 cases or more"):
        exugear.rank_correlation(exugear.monte_carlo(studies.ishigami, THREE, number=5, progress=False))
    with pytest.raises(ValueError, match="median of a must be finite"):
        exugear.monte_carlo(studies.ishigami, {"a": scipy.stats.norm(0, -1)}, progress=False)


@pytest.mark.slow
def test_measures_of_cases_are_those_of_single_calls(paper_pair):
    """Cases share the compliances of the gears and nothing else."""

    def made(C_a, helix):
        gear = replace(paper_pair.pinion, flank=[fem.TipRelief(C_a, 2.5 * mm), fem.HelixSlope(helix)])
        return fem.GearPair(gear, paper_pair.wheel, a=paper_pair.a)

    def options(misalignment):
        offsets = fem.Offsets(misalignment=misalignment)
        return {"phases": 10, "offsets": offsets, "resolution": fem.Slices(), "progress": False}

    def measures(C_a, helix, misalignment):
        names = "peak_to_peak", "hertz_pressure"
        return fem.flank_measures(made(C_a, helix), [150, 350], names, **options(misalignment))

    normal = scipy.stats.norm
    tolerances = {"C_a": normal(10 * um, 2 * um), "helix": normal(0, 3 * um), "misalignment": normal(0, 1e-4)}
    data = exugear.monte_carlo(measures, tolerances, number=4, progress=False)
    for case in data["case"].values:
        C_a, helix, misalignment = (float(data[name][case]) for name in tolerances)
        ste = fem.static_transmission_error(made(C_a, helix), [150, 350], **options(misalignment))
        swing, pressure = fem.peak_to_peak(ste)["peak_to_peak"], ste["hertz_pressure"].max("phase")
        assert data["peak_to_peak"][case].values == pytest.approx(swing.values, rel=1e-12)
        assert data["hertz_pressure"][case].values == pytest.approx(pressure.values, rel=1e-12)
