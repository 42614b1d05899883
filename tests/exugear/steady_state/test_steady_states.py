"""Steady states of gearboxes against settled runs in Exudyn, and what they refuse."""

from time import process_time

import numpy as np
import pytest
from coarse_maps import COARSE
from elastic_boxes import elastic_box
from paper_gears import paper_gear
from scenes import smooth_box, smooth_map, smooth_stage
from settled_runs import LOAD, TOP, compare

import exugear
import fem
from exugear.steady_state.force_error import force_error
from exugear.steady_state.gearbox_reduction import reduced
from fem.units import deg, mm, rpm

BALL = exugear.Bearing(radial=2e8, axial=1e8, damping_time=2e-5)


@pytest.fixture(scope="module")
def spinning_states(spinning):
    return exugear.steady_states(spinning, speed=(0.0, TOP), load=LOAD)


def test_stable_orbits_are_those_of_settled_runs(spinning, spinning_states):
    compare(spinning, spinning_states, LOAD, number=1, step=2e-6)


@pytest.mark.slow
@pytest.mark.parametrize("load", [150.0, 350.0])
def test_stable_orbits_are_those_of_settled_runs_at_twenty_speeds(spinning, load):
    compare(spinning, exugear.steady_states(spinning, speed=(0.0, TOP), load=load), load, number=20, step=3e-6)


@pytest.mark.slow
@pytest.mark.parametrize("load", [150.0, 350.0])
def test_all_branches_of_the_pair_take_less_time_than_a_run_up_of_70_s(spinning, load, measured):
    """Half as long was measured, about 3 s on a slow machine."""
    exugear.steady_states(spinning, speed=(0.0, 0.1 * TOP), load=load)  # compiles
    began = process_time()
    exugear.steady_states(spinning, speed=(0.0, TOP), load=load)
    branches_found = process_time()
    exugear.run_up(spinning, speed=(0.0, TOP), duration=70.0, load=load)
    of_branches, of_run = branches_found - began, process_time() - branches_found
    row = "all steady states of the paper's pair, 0 to 3500 rpm, 150 and 350 N m, over a run-up of 70 s"
    measured.number(row, of_branches / of_run, "{} of its time")
    assert of_branches < of_run


def test_a_run_up_follows_the_stable_branch_and_jumps_at_its_fold(spinning, spinning_states):
    run = exugear.run_up(spinning, speed=(300 * rpm, TOP), duration=3.0, load=LOAD, progress=False, checks=0)
    outline = exugear.dte_envelope(run, windows=150)
    fold = float(spinning_states["mesh_frequency"][spinning_states["bifurcation"].values == "fold"].max())
    unstable = np.flatnonzero(~spinning_states["stable"].values)
    lower = spinning_states.isel(point=slice(0, unstable[0]))
    upper = spinning_states.isel(point=slice(unstable[-1] + 1, None))
    for frequency, rms in zip(outline.abscissa, outline.rms, strict=True):
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
    data = exugear.steady_states(model, speed=(1500 * rpm, TOP), load=load)
    assert 1e-12 < data.attrs["force_error"] < 1e-6
    compare(model, data, load, number=1, step=5e-6)


def helical_on_bearings(levers: tuple[float, ...] = (-4e-4, 0.0, 4e-4)) -> exugear.Model:
    """An unequal helical pair in space, its map over the misalignment, or at 0 with the centroids of the force."""
    size = {"m_n": 2.5 * mm, "b": 20 * mm, "d_bore": 20 * mm}
    pair = fem.GearPair(fem.Gear(z=23, beta=18 * deg, **size), fem.Gear(z=41, beta=-18 * deg, **size))
    options = {"offsets": fem.Offsets(misalignment=levers), "resolution": fem.Slices(COARSE.density, 10)}
    ste = fem.static_transmission_error(pair, [0, 2, 10, 30, 100, 200], 16, **options, progress=False)
    fast = exugear.Shaft("fast", {0.0: BALL, 25 * mm: pair.pinion, 60 * mm: BALL})
    slow = exugear.Shaft("slow", {0.0: BALL, 25 * mm: pair.wheel, 60 * mm: BALL})
    return exugear.build(exugear.Gearbox([exugear.Stage(fast, slow, ste, damping=1500.0, backlash=0.08 * mm)]))


def test_a_helical_pair_on_bearings_has_the_tilting_stiffness_of_its_mesh():
    """Without it the DTE at 350 rad/s is 1.3 % larger."""
    model = helical_on_bearings()
    data = exugear.steady_states(model, speed=(345.0, 355.0), load=100.0)
    orbit = data.isel(point=int(np.abs(data["speed"].values - 350.0).argmin()))
    options = {"duration": 0.1, "step": 8e-6, "sample": 8e-6, "progress": False, "checks": 0}
    run = exugear.run_up(model, speed=float(orbit["speed"]), load=100.0, **options).data
    late = run["time"].values >= run["time"].values[-1] - 60 / float(orbit["mesh_frequency"])
    dte = run["dte"].values[0, late]
    assert dte.std() == pytest.approx(float(orbit["rms"]), rel=2e-3)
    assert np.ptp(dte) == pytest.approx(float(orbit["peak_to_peak"]), rel=2e-3)


def test_forces_of_gears_that_spin_are_those_of_the_whole_law(spinning_states):
    assert spinning_states.attrs["force_error"] < 1e-12


def test_the_error_of_the_forces_shows_a_drive_at_a_wrong_angle(spinning):
    reduction = reduced(spinning, {"slow": LOAD}, [0], speed=100.0, drive="held")
    at_rest = np.zeros(reduction.system.size), 100.0
    assert force_error(spinning, reduction, *at_rest) < 1e-12
    assert force_error(spinning, reduction._replace(angle=reduction.angle + 1e-3), *at_rest) > 1e-3


def test_a_map_without_misalignment_is_tilted_by_the_equilibrium():
    """Its force centroid gives the first order over the misalignment, which counts from 0, not from the equilibrium."""
    data = exugear.steady_states(helical_on_bearings((0.0,)), speed=(345.0, 355.0), load=100.0)
    assert 1e-12 < data.attrs["force_error"] < 1e-5


def test_a_drive_behind_a_coupling():
    coupling = exugear.Coupling(torsion=2e4, damping=2.0, inertia=0.02)
    shafts = [
        exugear.Shaft("fast", {0.0: coupling, 30 * mm: paper_gear()}),
        exugear.Shaft("slow", {30 * mm: paper_gear()}),
    ]
    model = exugear.build(exugear.Gearbox([smooth_stage(*shafts, damping=2700.0)]))
    compare(model, exugear.steady_states(model, speed=(1500 * rpm, TOP), load=LOAD), LOAD, number=1, step=5e-6)


def test_free_shafts_resonate_higher_than_a_held_drive(spinning, spinning_states):
    free = exugear.steady_states(spinning, speed=(1000 * rpm, TOP), load=LOAD, drive="free")
    assert free.attrs["resonance"] == pytest.approx(np.sqrt(2) * spinning_states.attrs["resonance"], rel=1e-6)


def test_the_back_flank_carries_a_negative_load(spinning):
    data = exugear.steady_states(spinning, speed=(1000 * rpm, 1500 * rpm), load=-LOAD)
    assert (data["smallest_force"] < -LOAD / paper_gear().r_b).all()
    touching = data["share_without_contact"] == 0
    assert (data["mean"][touching] < -spinning.gearbox.stages[0].force.backlash).all()
    compare(spinning, data, -LOAD, number=1, step=5e-6)


def test_a_narrow_range_finds_the_branch_that_enters_from_higher_speeds(spinning):
    narrow = exugear.steady_states(spinning, speed=(1500 * rpm, 1550 * rpm), load=LOAD)
    assert np.unique(narrow["branch"]).size == 3
    assert sorted(narrow["stable"].groupby(narrow["branch"]).mean().values.tolist()) == [0.0, 1.0, 1.0]


def test_the_model_keeps_its_state(spinning):
    before = spinning.mbs.systemData.GetODE2Coordinates()
    exugear.steady_states(spinning, speed=(1000 * rpm, 1050 * rpm), load=LOAD)
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
        ({"stage": 1}, "stage must be 0 to 0, or a label, got 1; the stages are"),
        ({"stage": (0, 0)}, "stage must be a stage number >= 0 or label, or several distinct ones"),
        ({"stage": -1}, "stage must be a stage number"),
        ({"stage": "none"}, "stage must be 0 to 0, or a label, got 'none'"),
        ({"stage": ()}, "stage must be a stage number"),
        ({"drive": "loose"}, "drive must be one of"),
        ({"harmonics": 0}, "harmonics must"),
    ],
)
def test_refusals(spinning, changes, message):
    with pytest.raises(ValueError, match=message):
        exugear.steady_states(spinning, **{"speed": (100.0, 200.0), "load": LOAD} | changes)


def test_the_reason_why_no_orbit_is_reached_is_named():
    speed = 2000 * rpm, 2010 * rpm
    undamped = exugear.build(smooth_box(damping=0.0))
    with pytest.raises(RuntimeError, match=r"need damping: .* not damped, .*; give Stage"):
        exugear.steady_states(undamped, speed=speed, load=LOAD)
    stage = exugear.Stage(*smooth_box().shafts, smooth_map((0, 1, 20, 100, LOAD)), damping=2700.0)
    with pytest.raises(ValueError, match=r"load: all motions at .* 1900 to 1910 Hz leave the maps: deflection"):
        exugear.steady_states(exugear.build(exugear.Gearbox([stage])), speed=speed, load=LOAD)


def test_friction_and_drag_are_refused():
    braked = exugear.build(smooth_box(exugear.Drag(0.1)))
    with pytest.raises(ValueError, match="drag"):
        exugear.steady_states(braked, speed=(100.0, 200.0), load=LOAD)


def test_branches_that_leave_the_map_are_returned_up_to_there():
    """The largest orbit lies at the end of the map, which its samples pass; the next one gives the force error."""
    shafts = smooth_box().shafts
    stage = exugear.Stage(*shafts, smooth_map((0, 1, 20, 100, 250)), damping=2700.0)
    data = exugear.steady_states(
        exugear.build(exugear.Gearbox([stage])), speed=(1500 * rpm, TOP), load=LOAD, progress=False
    )
    assert data.attrs["broken_branches"]
    assert data.attrs["force_error"] < 1e-6
    assert np.isfinite(data["rms"]).all()


@pytest.mark.slow
@pytest.mark.parametrize("shafts", ["rigid", "elastic"])
def test_bearing_forces_vibrate_as_in_a_settled_run(shafts):
    parts = {0 * mm: BALL, 60 * mm: BALL}
    model = exugear.build(elastic_box() if shafts == "elastic" else smooth_box(parts=parts))
    speed = (1000 * rpm, 1100 * rpm)
    states = exugear.steady_states(model, speed=speed, load=LOAD, bearing_forces=True, progress=False)
    point = int(np.flatnonzero(states["stable"].values)[0])
    run = exugear.run_up(model, speed=float(states["speed"][point]), load=LOAD, duration=0.4, progress=False, checks=0)
    settled = run.data["bearing_force"].isel(time=slice(run.data.sizes["time"] // 2, None)).std("time")
    vibration = states["bearing_force_rms"].isel(point=point)
    assert vibration["bearing"].values.tolist() == settled["bearing"].values.tolist()
    assert vibration.values == pytest.approx(settled.values, rel=1e-2, abs=1e-3 * float(settled.max()))


def test_bearing_forces_need_bearings(spinning):
    with pytest.raises(ValueError, match="bearing_forces must be False where all shafts only spin"):
        exugear.steady_states(spinning, speed=(200.0, 210.0), load=LOAD, bearing_forces=True, progress=False)
