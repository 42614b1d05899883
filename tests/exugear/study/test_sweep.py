"""Sweeps: labels, failures, seeds, executors, the store."""

import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
import pandas as pd
import pytest
import scenes
import studies
import xarray as xr

import exugear
import fem
from fem.units import mm, rpm

RADII = [{"radius": 1.0}, {"radius": 2.0, "colour": "blue"}, {"radius": 0.5}]
quiet_sweep = partial(exugear.sweep, progress=False)


def processes(number=2):
    return ProcessPoolExecutor(number, mp_context=get_context("spawn"))


def test_results_are_labelled_by_their_cases():
    data = quiet_sweep(studies.circle, RADII)
    assert data["perimeter"].dims == ("case",)
    assert data["area"].dims == ("case", "size")
    assert data["area"].sel(case=1).values == pytest.approx(np.pi * np.array([4.0, 16.0]))
    assert data["radius"].values.tolist() == [1.0, 2.0, 0.5]
    assert data["colour"].values.tolist() == ["", "blue", ""]
    assert (data["failure"] == "").all()
    assert data.where(data["radius"] > 0.8, drop=True).sizes["case"] == 2


def test_rows_of_a_data_frame_are_cases_with_its_index():
    frame = pd.DataFrame({"radius": [1.0, 3.0]}, index=["small", "large"])
    data = quiet_sweep(studies.labelled_circle, frame)
    assert float(data["perimeter"].sel(case="large")) == pytest.approx(6 * np.pi)
    assert data["perimeter"].attrs["units"] == "m"
    assert data.attrs == {"shape": "circle"}  # what is the same in all cases


def test_arrays_among_the_values_are_coordinates_too():
    def largest(deviations):
        return float(np.max(deviations))

    data = quiet_sweep(largest, [{"deviations": np.array([1.0, 2.0])}, {"deviations": np.array([4.0, 3.0])}])
    assert data["deviations"].dims == ("case", "deviations_0")
    assert data["result"].values.tolist() == [2.0, 4.0]


def test_a_failed_case_is_told_and_loses_no_other():
    with pytest.warns(UserWarning, match=r"2 of 4 cases failed; case 1: ValueError: 1 is odd \(studies.py, line \d+\)"):
        data = quiet_sweep(studies.odd_fails, [{"number": k} for k in range(4)])
    assert data["result"].values == pytest.approx([0, np.nan, 2, np.nan], nan_ok=True)
    assert data["failure"].sel(case=3).item().startswith("ValueError: 3 is odd")


def test_a_sweep_of_which_all_cases_fail_stops():
    with pytest.raises(exugear.SweepStopped, match="1 is odd") as stop:
        quiet_sweep(studies.odd_fails, [{"number": 1}, {"number": 3}])
    assert stop.value.data.sizes["case"] == 2


ODD = {
    "an array without dims": ([1.0, 2.0], r"must return a number.*got \[1.0, 2.0\]$"),
    "nothing": ({}, r"must return a number.*got \{\}$"),
    "the name of a value": ({"number": 1.0}, "names of the case"),
}


@pytest.mark.parametrize("what", ODD)
def test_odd_results_are_failures_without_a_line_of_ours(what):
    returned, words = ODD[what]
    with pytest.raises(exugear.SweepStopped, match=words):
        quiet_sweep(lambda number: returned, [{"number": 1}])


def test_an_array_of_one_number_is_a_number():
    assert quiet_sweep(lambda x: np.array(2 * x), [{"x": 1.5}])["result"].values.tolist() == [3.0]


def test_results_of_different_names_are_told():
    with pytest.warns(UserWarning, match="b in case 0; a in case 1|a in case 1; b in case 0"):
        data = quiet_sweep(lambda x: {"a": x} if x < 2 else {"b": x}, [{"x": 1.0}, {"x": 2.0}])
    assert data["a"].values == pytest.approx([1.0, np.nan], nan_ok=True)


def test_a_function_that_changes_its_arguments_leaves_the_case_alone(tmp_path):
    def longer(listed):
        listed.append(0.0)
        return float(len(listed))

    cases = [{"listed": [1.0, 2.0]}]
    for _ in range(2):
        data = quiet_sweep(longer, cases, store=tmp_path)
        assert data["listed"].values.tolist() == [[1.0, 2.0]]
    assert len(list(tmp_path.glob("*.nc"))) == 1


def test_rows_under_two_labels_are_cases_that_files_hold(tmp_path):
    index = pd.MultiIndex.from_tuples([("fast", 1), ("slow", 2)])
    data = quiet_sweep(studies.circle, pd.DataFrame({"radius": [1.0, 3.0]}, index=index))
    assert data["case"].values.tolist() == ["fast, 1", "slow, 2"]
    with pytest.raises(ValueError, match=r"columns of different names, \['radius'\] occur twice"):
        quiet_sweep(studies.circle, pd.DataFrame([[1.0, 2.0]], columns=["radius", "radius"]))


def test_the_line_of_a_failure_is_that_of_the_user():
    def asks_for_a_wheel(z):
        return fem.Gear(z=z, m_n=2 * mm, b=20 * mm).r

    with pytest.raises(exugear.SweepStopped, match=r"\(test_sweep.py, line \d+\)"):
        quiet_sweep(asks_for_a_wheel, [{"z": 0}])


def test_cases_of_different_size_are_failures_beside_the_first_one():
    def walk(steps):
        return {"x": ("step", np.arange(steps))}

    with pytest.warns(UserWarning, match="same size"):
        data = quiet_sweep(walk, [{"steps": 3}, {"steps": 4}, {"steps": 3}])
    assert np.isnan(data["x"].sel(case=1)).all()
    assert data["x"].sel(case=2).values.tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    "make",
    [None, lambda: ThreadPoolExecutor(3)],
    ids=["here", "threads"],
)
def test_seeds_repeat_the_draws_bit_for_bit_on_any_executor(make):
    cases = [{"level": 1.0}] * 6
    here = quiet_sweep(studies.noisy, cases, seed=4)
    assert np.unique(here["drawn"]).size == 6
    if make is None:
        repeated = quiet_sweep(studies.noisy, cases[:4], seed=4)
        xr.testing.assert_identical(repeated, here.isel(case=slice(4)))
        return
    with make() as executor:
        xr.testing.assert_identical(quiet_sweep(studies.noisy, cases, seed=4, executor=executor), here)


def test_finished_cases_are_not_computed_again(tmp_path):
    store, cases = tmp_path / "store", [{"number": k, "folder": str(tmp_path)} for k in range(3)]
    first = quiet_sweep(studies.counted, cases, store=store)
    further = quiet_sweep(studies.counted, [*cases, {"number": 7, "folder": str(tmp_path)}], store=store)
    assert (tmp_path / "calls").read_text().split() == ["0", "1", "2", "7"]
    assert further["result"].values.tolist() == [0, 1, 4, 49]
    xr.testing.assert_identical(quiet_sweep(studies.counted, cases, store=store), first)


def test_changed_cases_are_computed_anew_and_draws_belong_to_their_number(tmp_path):
    first = quiet_sweep(studies.noisy, [{"level": 1.0}, {"level": 2.0}], seed=1, store=tmp_path)
    swapped = quiet_sweep(studies.noisy, [{"level": 2.0}, {"level": 1.0}], seed=1, store=tmp_path)
    assert swapped["drawn"].values * [0.5, 2.0] == pytest.approx(first["drawn"].values)
    other_seed = quiet_sweep(studies.noisy, [{"level": 1.0}, {"level": 2.0}], seed=2, store=tmp_path)
    assert not np.isin(other_seed["drawn"].values, first["drawn"].values).any()


def test_a_changed_function_is_refused(tmp_path):
    scale = 2.0

    def scaled(x):
        return scale * x

    quiet_sweep(scaled, [{"x": 1.0}], store=tmp_path)
    assert float(quiet_sweep(scaled, [{"x": 1.0}], store=tmp_path)["result"][0]) == 2.0
    scale = 3.0
    with pytest.raises(ValueError, match="another function, or this one before it was changed"):
        quiet_sweep(scaled, [{"x": 1.0}], store=tmp_path)
    with pytest.raises(ValueError, match="another function"):
        quiet_sweep(partial(studies.circle, colour="blue"), [{"radius": 1.0}], store=tmp_path)


def test_a_store_that_holds_something_else_is_refused(tmp_path):
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(ValueError, match=r"holds other files \(letter.txt\)"):
        quiet_sweep(studies.circle, RADII, store=tmp_path)
    with pytest.raises(ValueError, match="is a file"):
        quiet_sweep(studies.circle, RADII, store=tmp_path / "letter.txt")
    (tmp_path / "sweep.json").write_text("[]")
    with pytest.raises(ValueError, match=r"another sweep.json"):
        quiet_sweep(studies.circle, RADII, store=tmp_path)


def test_a_damaged_file_is_told_and_computed_again(tmp_path):
    whole = quiet_sweep(studies.circle, RADII, store=tmp_path)
    damaged = next(tmp_path.glob("*.nc"))
    damaged.write_bytes(damaged.read_bytes()[:900])
    with pytest.warns(UserWarning, match="damaged"):
        repeated = quiet_sweep(studies.circle, RADII, store=tmp_path)
    xr.testing.assert_identical(repeated, whole)


@pytest.mark.slow
def test_a_process_that_dies_leaves_what_was_finished(tmp_path):
    cases = [{"number": k} for k in range(8)]
    with (
        processes(1) as executor,
        pytest.raises(exugear.SweepStopped, match="of 8 cases are finished and kept") as stop,
    ):
        quiet_sweep(studies.dies, cases, executor=executor, store=tmp_path)
    assert stop.value.data["result"].values[:3].tolist() == [0, 1, 2]
    assert len(list(tmp_path.glob("*.nc"))) == 3


def test_ctrl_c_says_how_far_the_sweep_is(tmp_path):
    with pytest.raises(KeyboardInterrupt) as stop:
        quiet_sweep(studies.interrupted, [{"number": k} for k in range(6)], store=tmp_path)
    assert stop.value.__notes__ == [f"3 of 6 cases are finished and kept in {tmp_path}; repeat the sweep to go on"]
    with ThreadPoolExecutor(1) as executor, pytest.raises(KeyboardInterrupt):
        quiet_sweep(studies.interrupted, [{"number": k} for k in range(6)], executor=executor)


KILLED = """
import sys, time
from functools import partial
import exugear
import fem
from fem.units import mm, rpm
def slow(number):
    time.sleep(0.02)
    with open(sys.argv[2], "a") as calls:
        calls.write(f"{number}\\n")
    return number * 0.1
exugear.sweep(slow, [{"number": k} for k in range(40)], store=sys.argv[1], progress=False)
print("whole")
"""


@pytest.mark.slow
def test_a_killed_sweep_goes_on_without_loss_and_repetition(tmp_path):
    script, calls, store = tmp_path / "killed.py", tmp_path / "calls", tmp_path / "store"
    script.write_text(KILLED)
    command = [sys.executable, str(script), str(store), str(calls)]
    with subprocess.Popen(command) as process:
        while len(list(store.glob("*.nc"))) < 10:
            time.sleep(0.01)
        process.kill()
    kept = len(list(store.glob("*.nc")))
    assert 10 <= kept < 40
    assert subprocess.run(command, capture_output=True, text=True, check=True).stdout == "whole\n"
    computed = calls.read_text().split()
    assert set(computed) == {str(k) for k in range(40)}
    assert len(computed) <= 41  # the case under way as the process was killed


def test_bad_sweeps_are_refused_before_they_begin():
    with pytest.raises(ValueError, match="case 1 does not: got an unexpected keyword argument 'color'"):
        quiet_sweep(studies.circle, [{"radius": 1.0}, {"radius": 1.0, "color": "red"}])
    with pytest.raises(ValueError, match="a row or more"):
        quiet_sweep(studies.circle, [])
    with pytest.raises(ValueError, match="seed must be given"):
        quiet_sweep(studies.noisy, [{"level": 1.0}])
    with pytest.raises(ValueError, match="must take an argument rng"):
        quiet_sweep(studies.circle, RADII, seed=1)
    with pytest.raises(ValueError, match="names of the result"):
        quiet_sweep(lambda case: 1.0, [{"case": 1}])
    with pytest.raises(exugear.SweepStopped, match="name the dims of arrays"):
        quiet_sweep(lambda x: {"y": np.ones(3)}, [{"x": 1}])
    with pytest.raises(exugear.SweepStopped, match="names of the case"):
        quiet_sweep(lambda x: {"x": 1.0}, [{"x": 1}])
    with ProcessPoolExecutor(1) as pool, pytest.raises(ValueError, match="define it at the top of a module"):
        quiet_sweep(lambda x: x, [{"x": 1}], executor=pool)


@pytest.mark.slow
def test_stiffer_bearings_raise_the_resonance_and_damping_lowers_its_height():
    """A sweep over a gearbox: steady states of the paper's pair on bearings share a map."""
    ste = scenes.smooth_map()

    def resonance(stiffness, ratio):
        pair, ball = fem.pair_of(ste), exugear.Bearing(radial=stiffness, axial=1e8, damping_time=5e-6)
        parts = [{-30 * mm: ball, 0.0: gear, 30 * mm: ball} for gear in (pair.pinion, pair.wheel)]
        shafts = [exugear.Shaft(name, part) for name, part in zip(("fast", "slow"), parts, strict=True)]
        model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, ste, damping_ratio=ratio)]))
        states = exugear.steady_states(model, speed=(900 * rpm, 2400 * rpm), load=150.0, progress=False)
        largest = states.isel(point=int(states["rms"].argmax("point")))
        return {"frequency": largest["mesh_frequency"], "rms": largest["rms"]}

    grid = [{"stiffness": k, "ratio": ratio} for k in (2e8, 1e9, 5e9) for ratio in (0.13, 0.2)]
    data = quiet_sweep(lambda **case: {k: float(x) for k, x in resonance(**case).items()}, grid)
    assert (np.diff(data["frequency"].values.reshape(3, 2), axis=0) > 0).all()
    assert (np.diff(data["rms"].values.reshape(3, 2), axis=1) < 0).all()
