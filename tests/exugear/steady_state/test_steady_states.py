"""Steady states of gearboxes against settled runs in Exudyn, and what they refuse."""

from dataclasses import replace
from time import process_time

import numpy as np
import pytest
from paper_gears import paper_gear
from scenes import linear_law, smooth_box, smooth_map

import exugear
import fem
from exugear.steady_state.force_error import force_error
from exugear.steady_state.gearbox_reduction import reduced
from fem.units import deg, mm, rpm

TOP, LOAD = 3500 * rpm, 150.0
BALL = exugear.Bearing(radial=2e8, axial=1e8, damping=2e-5)


@pytest.fixture(scope="module")
def spinning() -> exugear.Model:
    return exugear.build(smooth_box())


@pytest.fixture(scope="module")
def spinning_states(spinning):
    return exugear.steady_states(spinning, (0.0, TOP), LOAD)


def swept(model: exugear.Model, speeds, load: float, step: float) -> list[np.ndarray]:
    """DTE over 20 mesh cycles at each of the speeds, of a run in steps [s] that ramps from each to the next."""
    box, hold, before, parts, last = model.gearbox, 0.2, speeds[0], [], None
    for speed in speeds:
        ramp, kept = 0.08, 20 / (model.mesh_cycles[0] * speed)
        times = np.array([0.0, ramp, ramp + hold + kept])
        drives = {box.driving.name: exugear.Speed((times, np.array([before, speed, speed])))}
        options = {"duration": times[-1], "step": step, "sample": step, "progress": False, "checks": 0}
        last = exugear.run(model, drives=drives, loads={box.driven.name: load}, initial=last, **options)
        time, before = last.data["time"].values, speed
        parts.append(last.data["dte"].values[0, time >= time[-1] - kept])
    return parts


def picked(data, number: int) -> np.ndarray:
    """Stable points away from folds, by rising speed."""
    frequency, folds = data["mesh_frequency"].values, data["mesh_frequency"].values[data["bifurcation"] == "fold"]
    near = (np.abs(frequency[:, None] / folds - 1) < 0.04).any(axis=1)
    stable = np.flatnonzero(data["stable"].values & ~near & (data["speed"].values > 300 * rpm))
    chosen = stable[np.linspace(0, stable.size, number + 2).astype(int)[1:-1]]
    return chosen[np.argsort(frequency[chosen])]


def compare(model: exugear.Model, data, load: float, number: int, step: float) -> None:
    """Compare orbits with a run that sweeps up, or else down, through their speeds."""
    orbits = [data.isel(point=point) for point in picked(data, number)]
    speeds = [float(orbit["speed"]) for orbit in orbits]
    up = swept(model, [200 * rpm, *speeds], load, step)[1:]
    down = swept(model, [TOP, *reversed(speeds)], load, step)[:0:-1]
    for orbit, *runs in zip(orbits, up, down, strict=True):
        rms, mean, peak_to_peak = (float(orbit[name]) for name in ("rms", "mean", "peak_to_peak"))
        dte = min(runs, key=lambda dte: abs(dte.std() / rms - 1))
        assert dte.std() == pytest.approx(rms, rel=1e-3), float(orbit["mesh_frequency"])
        assert np.ptp(dte) == pytest.approx(peak_to_peak, rel=1e-3)
        assert dte.mean() == pytest.approx(mean, abs=1e-3 * peak_to_peak)


def test_stable_orbits_are_those_of_settled_runs(spinning, spinning_states):
    compare(spinning, spinning_states, LOAD, number=3, step=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("load", [150.0, 350.0])
def test_stable_orbits_are_those_of_settled_runs_at_twenty_speeds(spinning, load):
    compare(spinning, exugear.steady_states(spinning, (0.0, TOP), load), load, number=20, step=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("load", [150.0, 350.0])
def test_all_branches_of_the_pair_within_three_seconds(spinning, load):
    exugear.steady_states(spinning, (0.0, TOP), load)
    began = process_time()
    exugear.steady_states(spinning, (0.0, TOP), load)
    assert process_time() - began < 3.0


def test_a_run_up_follows_the_stable_branch_and_jumps_at_its_fold(spinning, spinning_states):
    run = exugear.run_up(spinning, speed=(300 * rpm, TOP), duration=3.0, load=LOAD, progress=False, checks=0)
    outline = exugear.dte_envelope(run, windows=150)
    fold = float(spinning_states["mesh_frequency"][spinning_states["bifurcation"].values == "fold"].max())
    unstable = np.flatnonzero(~spinning_states["stable"].values)
    lower = spinning_states.isel(point=slice(0, unstable[0]))
    upper = spinning_states.isel(point=slice(unstable[-1] + 1, None))
    for frequency, rms in zip(outline.place, outline.rms, strict=True):
        if abs(frequency - fold) > 0.03 * fold:
            branch = lower if frequency < fold else upper
            on_branch = np.interp(frequency, *(branch.sortby("mesh_frequency")[x] for x in ("mesh_frequency", "rms")))
            assert rms == pytest.approx(on_branch, rel=0.03)


def test_mesh_forces_surround_the_static_force_and_vanish_where_teeth_part(spinning_states):
    static = LOAD / paper_gear().r_b
    assert (spinning_states["smallest_force"] < static).all()
    assert (spinning_states["largest_force"] > static).all()
    apart = spinning_states["share_without_contact"].values > 0
    assert spinning_states["smallest_force"].values[apart].max() <= 0
    assert 0.5 < float(spinning_states["share_without_contact"].max()) < 1


def test_harmonics_hold_the_power_of_the_signal(spinning_states):
    power = (spinning_states["harmonics"] ** 2).sum("harmonic") / 2
    share = power / spinning_states["rms"] ** 2
    assert float(share.max()) < 1 + 1e-6
    assert float(share[spinning_states["mesh_frequency"] > 1000].min()) > 0.99
    assert float(spinning_states["harmonics"].sel(harmonic=[0.5, 1.5]).max()) < 1e-12


@pytest.mark.parametrize("load", [LOAD, -LOAD])
def test_a_planar_gearbox_on_bearings(load):
    """The back flank opens with the centre distance against the DTE."""
    model = exugear.build(smooth_box(parts={0 * mm: BALL, 60 * mm: BALL}))
    data = exugear.steady_states(model, (1500 * rpm, TOP), load)
    assert 1e-12 < data.attrs["force_error"] < 1e-6
    compare(model, data, load, number=1, step=5e-6)


def helical_on_bearings(levers: tuple[float, ...] = (-4e-4, 0.0, 4e-4)) -> exugear.Model:
    """An unequal helical pair in space, its map over the misalignment, or at 0 with the centroids of the force."""
    size = {"m_n": 2.5 * mm, "b": 20 * mm, "d_bore": 20 * mm}
    pair = fem.GearPair(fem.Gear(z=23, beta=18 * deg, **size), fem.Gear(z=41, beta=-18 * deg, **size))
    options = {"offsets": fem.Offsets(misalignment=levers), "resolution": fem.Slices()}
    ste = fem.static_transmission_error(pair, [0, 2, 10, 30, 100, 200], 16, **options, progress=False)
    fast = exugear.Shaft("fast", {0.0: BALL, 25 * mm: pair.pinion, 60 * mm: BALL})
    slow = exugear.Shaft("slow", {0.0: BALL, 25 * mm: pair.wheel, 60 * mm: BALL})
    return exugear.build(exugear.Gearbox([exugear.Stage(fast, slow, ste, damping=1500.0, backlash=0.08 * mm)]))


def test_a_helical_pair_on_bearings_has_the_tilting_stiffness_of_its_mesh():
    """Without it the DTE at 350 rad/s is 1.3 % larger."""
    model = helical_on_bearings()
    data = exugear.steady_states(model, (345.0, 355.0), 100.0)
    orbit = data.isel(point=int(np.abs(data["speed"].values - 350.0).argmin()))
    options = {"duration": 0.2, "step": 8e-6, "sample": 8e-6, "progress": False, "checks": 0}
    run = exugear.run_up(model, speed=float(orbit["speed"]), load=100.0, **options).data
    late = run["time"].values >= run["time"].values[-1] - 60 / float(orbit["mesh_frequency"])
    dte = run["dte"].values[0, late]
    assert dte.std() == pytest.approx(float(orbit["rms"]), rel=2e-3)
    assert np.ptp(dte) == pytest.approx(float(orbit["peak_to_peak"]), rel=2e-3)


def test_forces_of_gears_that_spin_are_those_of_the_whole_law(spinning_states):
    assert spinning_states.attrs["force_error"] < 1e-12


def test_the_error_of_the_forces_shows_a_drive_at_a_wrong_angle(spinning):
    reduction = reduced(spinning, LOAD, [0], speed=100.0, drive="held")
    at_rest = np.zeros(reduction.system.size), 100.0
    assert force_error(spinning, reduction, *at_rest) < 1e-12
    assert force_error(spinning, reduction._replace(angle=reduction.angle + 1e-3), *at_rest) > 1e-3


def test_a_map_without_misalignment_is_tilted_by_the_equilibrium():
    """Its force centroid gives the first order over the misalignment, which counts from 0, not from the equilibrium."""
    data = exugear.steady_states(helical_on_bearings((0.0,)), (345.0, 355.0), 100.0)
    assert 1e-12 < data.attrs["force_error"] < 1e-5


def test_a_drive_behind_a_coupling():
    coupling = exugear.Coupling(torsion=2e4, damping=2.0, inertia=0.02)
    shafts = [
        exugear.Shaft("fast", {0.0: coupling, 30 * mm: paper_gear()}),
        exugear.Shaft("slow", {30 * mm: paper_gear()}),
    ]
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, smooth_map(), damping=2700.0)]))
    compare(model, exugear.steady_states(model, (1500 * rpm, TOP), LOAD), LOAD, number=1, step=5e-6)


def two_stages(law=None, damping: float = 2700.0) -> exugear.Model:
    """Three shafts of the paper's gears; the second stage with a law of its own."""
    shafts = [exugear.Shaft(name, {30 * mm: paper_gear()}) for name in ("first", "second", "third")]
    second = {"pair": smooth_box().stages[0].pair} if law else {"damping": damping}
    stages = [
        exugear.Stage(*shafts[:2], smooth_map(), damping=damping),
        exugear.Stage(*shafts[1:], law or smooth_map(), **second),
    ]
    return exugear.build(exugear.Gearbox(stages))


def test_a_second_stage_of_constant_stiffness_leaves_nothing_out():
    model = two_stages(replace(linear_law(k=(3e8, 3e8, 3e8)), damping=2700.0))
    data = exugear.steady_states(model, (1000 * rpm, 2000 * rpm), LOAD)
    assert data.attrs["variation_of_other_meshes"] < 1e-9
    compare(model, data, LOAD, number=1, step=5e-6)


def settled_dte(model: exugear.Model, orbit, load: float, step: float, cycles: int) -> np.ndarray:
    """(n_stage, n_time) DTE over mesh cycles of the first stage at the end of a run at the speed of an orbit."""
    options = {"duration": 0.3, "step": step, "sample": step, "progress": False, "checks": 0}
    data = exugear.run_up(model, speed=float(orbit["speed"]), load=load, **options).data
    kept = cycles / (model.mesh_cycles[0] * float(orbit["speed"]))
    return data["dte"].values[:, data["time"].values >= data["time"].values[-1] - kept]


def agree(orbit, dte: np.ndarray) -> None:
    """The orbit of every stage is that of a run, within 1e-3."""
    assert dte.std(axis=1) == pytest.approx(orbit["rms"].values, rel=1e-3)
    assert np.ptp(dte, axis=1) == pytest.approx(orbit["peak_to_peak"].values, rel=1e-3)
    assert dte.mean(axis=1) == pytest.approx(orbit["mean"].values, rel=1e-3)


def test_meshes_beside_an_idler_excite_together():
    model, speeds = two_stages(damping=8000.0), (2770 * rpm, 2800 * rpm)
    data = exugear.steady_states(model, speeds, LOAD, stage=(0, 1))
    assert data.attrs["exciting_stages"] == ["first-second", "second-third"]
    assert data.attrs["common_period"] == 1
    stable = data.isel(point=np.flatnonzero(data["stable"]))
    orbit = stable.isel(point=int(stable["rms"].values[:, 0].argmin()))
    agree(orbit, settled_dte(model, orbit, LOAD, 2e-6, 40))
    of_stage = exugear.steady_states(model, speeds, LOAD, stage=1)
    assert of_stage.attrs["exciting_stages"] == ["second-third", "first-second"]
    ends = data["rms"].sel(stage="second-third").values[[0, -1]]
    assert sorted(of_stage["rms"].values[[0, -1]]) == pytest.approx(sorted(ends))


def two_stages_in_space() -> exugear.Model:
    """The paper's pair, and behind it a pair of other numbers of teeth whose stiffness varies by 7 %."""
    gears = [fem.Gear(z=z, m_n=3 * mm, b=25 * mm, d_bore=25 * mm) for z in (38, 53)]
    pair = fem.GearPair(*gears, a=136.6 * mm)
    law = replace(linear_law(k=(3e8, 3.3e8, 2.85e8), reach=3e-4), damping=2500.0)
    bearing = exugear.Bearing(5e8, 3e8, 2e5, 1e-5)
    first = exugear.Shaft("first", {0.0: bearing, 30 * mm: paper_gear()})
    middle = exugear.Shaft("middle", {0.0: bearing, 30 * mm: paper_gear(), 80 * mm: gears[0], 120 * mm: bearing})
    last = exugear.Shaft("last", {60 * mm: bearing, 80 * mm: gears[1]})
    stages = [exugear.Stage(first, middle, smooth_map(), damping=2700.0), exugear.Stage(middle, last, law, pair=pair)]
    return exugear.build(exugear.Gearbox(stages))


def test_meshes_of_different_frequencies_excite_over_their_common_period():
    model, load = two_stages_in_space(), 250.0
    data = exugear.steady_states(model, (1200 * rpm, 1210 * rpm), load, stage=(0, 1))
    assert data.attrs["common_period"] == 3
    orbit = data.isel(point=0)
    assert orbit["mesh_frequency"].values == pytest.approx(model.mesh_cycles * float(orbit["speed"]), rel=1e-12)
    agree(orbit, settled_dte(model, orbit, load, 4e-6, 3 * 40))


def amplitudes_in_run(model: exugear.Model, speed: float, load: float, number: int) -> np.ndarray:
    """Amplitudes of the DTE of the first stage at its own mesh orders in a settled run, fitted beside those of both."""
    options = {"load": load, "step": 4e-6, "sample": 4e-6, "progress": False, "checks": 0}
    data = exugear.run_up(model, speed=speed, duration=0.35, **options).data
    late = data["time"].values > 0.15
    angle = 2 * np.pi * np.outer(data["time"].values[late], model.mesh_cycles * speed)
    waves = np.exp(1j * (angle[:, :, None] * np.arange(1, number + 3)).reshape(len(angle), -1))
    columns = np.column_stack([np.ones(len(waves)), waves.real, waves.imag])
    fit = np.linalg.lstsq(columns, data["dte"].values[0, late], rcond=None)[0]
    return np.hypot(fit[1 : 1 + number], fit[1 + waves.shape[1] :][:number])


@pytest.mark.slow
def test_two_stages_in_space_within_a_minute():
    """Alone, the mesh of the first stage has amplitudes of its orders that differ from a run by 4 %."""
    model, load = two_stages_in_space(), 250.0
    began = process_time()
    of_meshes = exugear.steady_states(model, (500 * rpm, TOP), load, stage=(0, 1))
    alone = exugear.steady_states(model, (500 * rpm, TOP), load)
    assert process_time() - began < 60.0
    assert of_meshes.attrs["variation_of_other_meshes"] == 0.0
    assert 0.05 < alone.attrs["variation_of_other_meshes"] < 0.1
    for point in picked(of_meshes.isel(stage=0), 4):
        orbit = of_meshes.isel(point=point)
        agree(orbit, settled_dte(model, orbit, load, 4e-6, 3 * 40))


def test_free_shafts_resonate_higher_than_a_held_drive(spinning, spinning_states):
    free = exugear.steady_states(spinning, (1000 * rpm, TOP), LOAD, drive="free")
    assert free.attrs["resonance"] == pytest.approx(np.sqrt(2) * spinning_states.attrs["resonance"], rel=1e-6)


def test_the_back_flank_carries_a_negative_load(spinning):
    data = exugear.steady_states(spinning, (1000 * rpm, 1500 * rpm), -LOAD)
    assert (data["smallest_force"] < -LOAD / paper_gear().r_b).all()
    touching = data["share_without_contact"] == 0
    assert (data["mean"][touching] < -spinning.gearbox.stages[0].force.backlash).all()
    compare(spinning, data, -LOAD, number=1, step=5e-6)


def test_a_narrow_range_finds_the_branch_that_enters_from_higher_speeds(spinning):
    narrow = exugear.steady_states(spinning, (1500 * rpm, 1550 * rpm), LOAD)
    assert np.unique(narrow["branch"]).size == 3
    assert sorted(narrow["stable"].groupby(narrow["branch"]).mean().values.tolist()) == [0.0, 1.0, 1.0]


def test_the_model_keeps_its_state(spinning):
    before = spinning.mbs.systemData.GetODE2Coordinates()
    exugear.steady_states(spinning, (1000 * rpm, 1050 * rpm), LOAD)
    assert spinning.mbs.systemData.GetODE2Coordinates() == pytest.approx(before, abs=0)


def test_the_data_are_written_as_netcdf(spinning_states, tmp_path):
    spinning_states.to_netcdf(tmp_path / "states.nc")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"speed": (100.0, 50.0)}, "speed must be"),
        ({"speed": (0.0, 5.0)}, "speed must reach beyond"),
        ({"speed": (5.0,)}, "speed must be"),
        ({"speed": (0.0, np.inf)}, "speed must be"),
        ({"speed": (0.0, 1e9)}, "speed must be"),
        ({"load": 0.0}, "load must be finite and not 0"),
        ({"load": 1e5}, "load"),
        ({"stage": 1}, "stage must be a number from 0 to 0"),
        ({"stage": (0, 0)}, "stage must be the number of a stage, or different ones"),
        ({"stage": -1}, "stage must be the number of a stage"),
        ({"stage": ()}, "stage must be the number of a stage"),
        ({"drive": "loose"}, "drive must be one of"),
        ({"harmonics": 0}, "harmonics must"),
    ],
)
def test_refusals(spinning, changes, message):
    with pytest.raises(ValueError, match=message):
        exugear.steady_states(spinning, **{"speed": (100.0, 200.0), "load": LOAD} | changes)


def test_friction_and_drag_are_refused():
    braked = exugear.build(smooth_box(exugear.Drag(0.1)))
    with pytest.raises(ValueError, match="drag"):
        exugear.steady_states(braked, (100.0, 200.0), LOAD)
