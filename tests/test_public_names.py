"""Public names: what `dir()` shows, names of earlier versions, the order of arguments, one meaning a name."""

import importlib
import inspect

import numpy as np
import pytest
import xarray as xr
from scenes import smooth_box

import exugear
import fem
from exugear import plots, spectrum

MODULES = (
    *(fem, fem.units, fem.nonlinear, fem.dynamic, fem.explicit, fem.stress, fem.iso6336),
    *(exugear, exugear.plots, exugear.spectrum, exugear.graphics),
)
TIME = np.linspace(0.0, 1.0, 2001)


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_dir_shows_public_names_only(module):
    assert sorted(dir(module)) == sorted(module.__all__)
    assert all(hasattr(module, name) for name in module.__all__)
    private = [name for name in dir(module) if name.startswith("_") and name != "__version__"]
    assert private == []


def functions() -> dict:
    """All public functions of exugear and of its plots."""
    named = {name: getattr(home, name) for home in (exugear, plots, spectrum) for name in home.__all__}
    return {name: value for name, value in named.items() if inspect.isfunction(value)}


def test_speed_stands_before_load_and_both_are_keywords():
    for name, function in functions().items():
        parameters = inspect.signature(function).parameters
        for speed, load in (("speed", "load"), ("speeds", "loads")):
            if {speed, load} <= parameters.keys():
                order = list(parameters)
                assert order.index(load) == order.index(speed) + 1, name
                assert order.index(speed) == 1, name


#: Names of arguments with one meaning: those of a kind that is a number, and those that hold several values.
WHOLE_NUMBERS, SEVERAL = {"harmonics", "side_bands", "windows", "frames"}, {"orders", "frequencies"}


def test_a_name_of_an_argument_has_one_meaning():
    """harmonics: how many; orders: which; revolutions: the length of a window."""
    for name, function in functions().items():
        for argument, parameter in inspect.signature(function).parameters.items():
            kind = inspect.get_annotations(function, eval_str=True).get(argument)
            if argument in WHOLE_NUMBERS:
                assert kind is int, f"{name}({argument})"
            if argument in SEVERAL:
                assert kind not in (int, float), f"{name}({argument})"
            assert parameter.name not in ("found", "place"), name


@pytest.fixture(scope="module")
def run() -> exugear.Run:
    model = exugear.build(smooth_box())
    return exugear.run_up(model, speed=(100.0, 250.0), load=100.0, duration=0.3, progress=False, checks=0)


@pytest.fixture(scope="module")
def recorded() -> xr.DataArray:
    return exugear.recorded_signal(TIME, 2 * np.pi * (10 + 10 * TIME), np.cos(300 * TIME), units="N")


def earlier(run, recorded) -> dict:
    """Words that the warning holds -> call by the earlier name, call by the present one."""
    outline = exugear.dte_envelope(run)
    x, y = outline.abscissa, outline.amplitude
    columns = recorded["time"].values, recorded["speed"].values, recorded.values
    spectra = exugear.waterfall(recorded, lines=5, resolution=20.0)
    axes = plots.figure().axes[0]
    return {
        "use highest_order=": (
            lambda: exugear.over_angle(recorded, orders=5.0).values,
            lambda: exugear.over_angle(recorded, highest_order=5.0).values,
        ),
        "orders= is deprecated": (
            lambda: exugear.order_tracking(recorded, orders=5.0)["amplitude"].values,
            lambda: exugear.order_tracking(recorded, highest_order=5.0)["amplitude"].values,
        ),
        "use exugear.order_tracking": (
            lambda: exugear.order_spectrum(*columns, orders=5.0).amplitude,
            lambda: exugear.order_tracking(recorded, highest_order=5.0)["amplitude"].values,
        ),
        "use exugear.resonances": (
            lambda: exugear.resonance_table(run)["mesh_frequency"].values,
            lambda: exugear.resonances(run)["mesh_frequency"].values,
        ),
        "use exugear.peaks": (lambda: exugear.resonances(x, y, 0.01).height, lambda: exugear.peaks(x, y, 0.01).height),
        "use abscissa=": (
            lambda: exugear.envelope(place=x, signal=y, windows=9).high,
            lambda: exugear.envelope(x, y, windows=9).high,
        ),
        "use Envelope.abscissa": (lambda: outline.place, lambda: x),
        "use Peaks": (lambda: spectrum.Resonances(x, y).height, lambda: spectrum.Peaks(x, y).height),
        "use plot_waterfall": (
            lambda: plots.plot_cascade(spectra, axes).lines[0].get_ydata(),
            lambda: plots.plot_waterfall(spectra, plots.figure().axes[0]).lines[0].get_ydata(),
        ),
        "use plot_mesh_order_map": (
            lambda: plots.plot_waterfall(run, axes, 0, 2.2).collections[-1].get_array(),
            lambda: plots.plot_mesh_order_map(run, plots.figure().axes[0], top=2.2).collections[0].get_array(),
        ),
        "use resonances=": (
            lambda: [text.get_text() for text in plots.plot_run_up(run, axes, found=[1000.0]).texts],
            lambda: [text.get_text() for text in plots.plot_run_up(run, plots.figure().axes[0], 0, [1000.0]).texts],
        ),
        "use damping_time=": (
            lambda: exugear.Bearing(radial=1e8, damping=1e-5).damping_time,
            lambda: exugear.Bearing(radial=1e8, damping_time=1e-5).damping_time,
        ),
        "use Bearing.damping_time": (
            lambda: exugear.Bearing(1e8, 0.0, 0.0, 1e-5).damping,
            lambda: exugear.Bearing(1e8, 0.0, 0.0, 1e-5).damping_time,
        ),
        "use order_map=": (
            lambda: plots.plot_order_map(orders=exugear.order_tracking(recorded, highest_order=5.0)).get_xlabel(),
            lambda: plots.plot_order_map(exugear.order_tracking(recorded, highest_order=5.0)).get_xlabel(),
        ),
    }


def test_names_of_earlier_versions_work_and_name_the_present_ones(run, recorded):
    for words, (before, now) in earlier(run, recorded).items():
        with pytest.warns(DeprecationWarning, match=words):
            value = before()
        assert np.array_equal(value, now()), words


def test_a_keyword_given_by_both_names_is_refused():
    with pytest.raises(TypeError, match="abscissa must be given once, got place too, its earlier name"):
        exugear.envelope(abscissa=TIME, place=TIME, signal=TIME)


def test_unknown_names_are_attribute_errors():
    for module in (exugear.plots, exugear.spectrum):
        with pytest.raises(AttributeError, match="nothing"):
            _ = importlib.import_module(module.__name__).nothing


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: exugear.Rule.trapezoidal(np.nan), "step must be > 0"),
        (lambda: exugear.Rule.fourth_order(0.0), "step must be > 0"),
        (lambda: exugear.Rule(0.0, 1e-5), r"beta must lie in \(0, 1\]"),
        (lambda: exugear.Rule(1 / 12, 1e-5, 1.5), "spectral_radius must lie in"),
    ],
)
def test_rules_out_of_range_are_refused(call, words):
    with pytest.raises(ValueError, match=words):
        call()
