"""Stresses along runs: slow runs reproduce the map; between torques and at the ends of the map; the back flank."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import xarray as xr
from paper_gears import paper_pair
from scenes import smooth_box

import exugear
import fem
from fem.units import MPa, mm, rpm

R_B = paper_pair().pinion.r_b


def root_at(torque, phase):
    """Root stress of the pinion by formula, with an asymmetric course over the phase [Pa]."""
    return torque * MPa * (1 + 0.5 * np.cos(2 * np.pi * phase) + 0.2 * np.sin(4 * np.pi * phase))


def inputs_of(pair: fem.GearPair) -> dict:
    """Inputs of a pair, as maps hold them in their attributes."""
    return fem.ste_map(pair, [0, 1.0], [0.0], np.zeros((2, 1))).attrs


def stresses(torque=(0.0, 50.0, 150.0, 350.0), phases: int = 200) -> xr.Dataset:
    """A map of stresses by formula: the wheel has twice the stress of the pinion, the pressure that of Hertz."""
    torque, phase = np.array(torque), np.arange(phases) / phases
    root = root_at(torque[:, None], phase)
    pressure = np.sqrt(torque[:, None]) * 50 * MPa * (1 + phase)
    roots, grid = np.stack([root, 2 * root]), ("torque", "phase")
    data = {"root_stress": (("gear", *grid), roots), "tangent_stress": (("gear", *grid), 0.9 * roots)}
    data |= {"hertz_pressure": (grid, pressure), "peak_pressure": (grid, 1.1 * pressure)}
    axes = {"gear": ["pinion", "wheel"], "torque": torque, "phase": phase}
    return xr.Dataset(data, axes, inputs_of(paper_pair()))


def slow_run(load: float = 150.0, **changes) -> exugear.Run:
    """About five mesh cycles at 30 rpm, where the mesh force is the static one."""
    options = {"speed": 30 * rpm, "load": load, "duration": 0.18, "progress": False, "checks": 0} | changes
    return exugear.run_up(exugear.build(smooth_box()), **options)


def test_phase_of_a_run_is_the_angle_of_the_pinion_in_pitches():
    data = slow_run().data
    phase = data["phase"].values[0]
    expected = 57 * 30 / 60 * data["time"].values
    assert (phase - phase[0]) == pytest.approx(expected, abs=1e-9)


def test_slow_run_reproduces_the_map_over_the_phase():
    run = slow_run()
    stress = exugear.dynamic_stress(run, stresses())
    phase = run.data["phase"].values[0]
    expected = root_at(150.0, phase)
    assert stress["root_stress"].sel(gear="pinion").values == pytest.approx(expected, rel=5e-3)
    assert stress["root_stress"].sel(gear="wheel").values == pytest.approx(2 * expected, rel=5e-3)
    force = run.data["mesh_force"].values[0]
    exact = root_at(force * R_B, phase)
    assert stress["root_stress"].sel(gear="pinion").values == pytest.approx(exact, rel=1e-3)
    within = (phase % 1) < 0.995
    pressure = np.sqrt(force * R_B) * 50 * MPa * (1 + phase % 1)
    assert stress["hertz_pressure"].values[within] == pytest.approx(pressure[within], rel=1e-3)


def under(run: exugear.Run, torques, phases, data: xr.Dataset) -> xr.Dataset:
    """Stresses by a map where the samples of a run had these torques [N m] at these phases."""
    first = run.data.isel(time=slice(0, len(torques)))
    held = {"mesh_force": np.array(torques) / R_B, "phase": np.array(phases)}
    rows = {name: (("stage", "time"), values[None]) for name, values in held.items()}
    return exugear.dynamic_stress(replace(run, data=first.assign(rows)), data)


def test_map_is_exact_at_its_grid_and_vanishes_with_the_force():
    run, data = slow_run(), stresses()
    torques, samples = np.array(list(product((50.0, 150.0, 350.0), (0, 77, 199)))).T
    at = under(run, torques, samples / 200 + 3, data)
    for k, (torque, sample) in enumerate(zip(torques, samples.astype(int), strict=True)):
        expected = data.sel(torque=torque).isel(phase=sample)
        assert at["root_stress"].values[..., k].ravel() == pytest.approx(expected["root_stress"].values, rel=1e-12)
        assert at["peak_pressure"].values[..., k] == pytest.approx(expected["peak_pressure"].item(), rel=1e-12)
    light = under(run, [0.0, 1.0], [0.0, 0.0], data)
    assert light["root_stress"].sel(gear="pinion").values.ravel() == pytest.approx([0, root_at(1.0, 0.0)])
    assert light["hertz_pressure"].values.ravel() == pytest.approx([0, 50 * MPa])


def test_map_of_one_torque_scales_with_the_force():
    at = under(slow_run(), [75.0, 75.0], [0.3, 0.3], stresses(torque=(150.0,)))
    assert at["root_stress"].sel(gear="pinion").values == pytest.approx(root_at(75.0, 0.3), rel=1e-3)
    assert at["hertz_pressure"].values == pytest.approx(np.sqrt(75.0) * 50 * MPa * 1.3, rel=1e-3)


def test_back_flank_has_the_stress_of_the_mirrored_contact():
    run = slow_run(load=-150.0)
    stress = exugear.dynamic_stress(run, stresses())
    mirrored = paper_pair().back_phase - run.data["phase"].values[0]
    assert (run.data["mesh_force"].values < 0).all()
    assert stress["root_stress"].sel(gear="pinion").values == pytest.approx(root_at(150.0, mirrored), rel=5e-3)


def test_envelope_holds_the_largest_stress_of_every_window():
    run = slow_run(duration=0.5)
    stress = exugear.dynamic_stress(run, stresses())
    envelope = exugear.stress_envelope(stress, windows=5)
    largest = root_at(150.0, np.linspace(0, 1, 2001)).max()
    assert envelope["root_stress"].dims == ("gear", "speed")
    assert envelope["root_stress"].shape == (2, 5)
    assert envelope["root_stress"].sel(gear="pinion").values == pytest.approx(largest, rel=5e-3)
    assert envelope["speed"].values == pytest.approx(30 * rpm)
    assert envelope["root_stress"].attrs["units"] == "Pa"
    short = stress.isel(time=slice(0, 200))
    within_a_cycle = exugear.stress_envelope(short, windows=5)
    assert within_a_cycle["root_stress"].values == pytest.approx(short["root_stress"].max("time").values[:, None])


def test_the_order_of_the_gears_in_the_map_does_not_matter():
    run = slow_run(duration=0.02)
    of_map = exugear.dynamic_stress(run, stresses())
    assert exugear.dynamic_stress(run, stresses().isel(gear=[1, 0])).identical(of_map)
    with pytest.raises(ValueError, match=r"stresses must have the gears .*, got .'wheel'."):
        exugear.dynamic_stress(run, stresses().isel(gear=[1]))


def test_unequal_teeth_have_stresses_of_their_own_over_as_many_pitches_as_the_law():
    """Three pitches of which the second has half the stress again: told by whole pitches of the phase."""
    data = slow_run().data
    label = str(data["stage"].values[0])
    uneven, one = data.assign_attrs({f"{label}_pitches": 3}), stresses()
    pitches = [one.assign_coords(phase=one["phase"] + k) * (1.5 if k == 1 else 1.0) for k in range(3)]
    stress = exugear.dynamic_stress(uneven, xr.concat(pitches, "phase").assign_attrs(one.attrs))["root_stress"]
    phase = data["phase"].values[0]
    number = np.floor(phase % 3)
    factor = np.where(number == 1, 1.5, 1.0)
    clear = (phase % 1) < 0.99
    expected = factor * root_at(data["mesh_force"].values[0] * R_B, phase)
    assert stress.sel(gear="pinion").values[clear] == pytest.approx(expected[clear], rel=1e-3)
    with pytest.raises(ValueError, match=r"stresses run over 1 pitch, the law of stage .* over 3: its teeth differ"):
        exugear.dynamic_stress(uneven, one)
    with pytest.raises(ValueError, match=r"stresses run over 3 pitches, the law of stage .* over 1"):
        exugear.dynamic_stress(data, xr.concat(pitches, "phase").assign_attrs(one.attrs))


def test_runs_beyond_the_map_and_foreign_maps_are_refused(tmp_path):
    run = slow_run(duration=0.02)
    with pytest.raises(ValueError, match=r"stresses end at 100 N m, the run reaches 1[45]"):
        exugear.dynamic_stress(run, stresses(torque=(0.0, 100.0)))
    pair = paper_pair()
    foreign = stresses().assign_attrs(inputs_of(replace(pair, wheel=replace(pair.wheel, d_bore=50 * mm))))
    with pytest.raises(ValueError, match="must be those of the pair"):
        exugear.dynamic_stress(run, foreign)
    with pytest.raises(ValueError, match="older versions"):
        exugear.dynamic_stress(run.data.drop_vars("phase"), stresses())
    with pytest.raises(ValueError, match=r"fem\.root_stress"):
        exugear.dynamic_stress(run, run.data)
    with pytest.raises(ValueError, match=r"exugear\.dynamic_stress"):
        exugear.stress_envelope(run.data)
    exugear.dynamic_stress(run, stresses()).to_netcdf(tmp_path / "stress.nc", engine="h5netcdf")


@pytest.mark.slow
def test_slow_run_reproduces_the_root_stress_of_finite_elements():
    """At the solved phases the stress of the run is that of the map, in proportion to the force."""
    coarse, phases = fem.Density(flank=4, fillet=4, land=2, tooth=3, rim=2, body=3, width=1), np.arange(4) / 4
    solved = fem.root_stress(paper_pair(), 160.0, phases, density=coarse, progress=False)
    assert fem.pair_of(solved) == paper_pair()
    run = slow_run()
    stress, phase = exugear.dynamic_stress(run, solved)["root_stress"], run.data["phase"].values[0] % 1
    for k in range(phases.size):
        at = np.abs(phase - phases[k]).argmin()
        assert stress.values[:, at] == pytest.approx(solved["root_stress"].values[:, 0, k] * 150 / 160, rel=0.01)
