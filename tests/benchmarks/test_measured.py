"""Numbers of examples/MEASURED.md that no other test shows.

    pytest tests/benchmarks/test_measured.py -m measured -n 0 -s

Each test prints its row of a table. Times mean little on a busy machine, and only values are asserted.
"""

import resource
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context

import korta_pair
import numpy as np
import pytest
import two_stage_helical
from benchmark_run_up import on_bearings
from benchmark_states import KINDS, MODES, OLD, pair_of_kind, state_time
from helical_gears import helical
from modified_pairs import fzg_type_c, wide_helical
from paper_gears import paper_gear

import exugear
import fem
from fem.units import deg, mm, rpm, um

pytestmark = pytest.mark.measured
DEFAULT = fem.Resolution()
FINER = DEFAULT.finer_inside()
ADJACENT = fem.Resolution(fem.Density(flank=24, width=4), neighbours=1)
TIP_RELIEF, LEAD_CROWNING = fem.TipRelief(15 * um, 2.5 * mm), fem.LeadCrowning(10 * um)
PROCESSES = 2


def paper_pair(*flank) -> fem.GearPair:
    gear = paper_gear(flank=flank)
    return fem.GearPair(gear, gear, a=150 * mm)


def helical_pair(*flank) -> fem.GearPair:
    return fem.GearPair(helical(1, flank=flank), helical(-1, flank=flank), a=150 * mm)


def peak_to_peak(te) -> np.ndarray:
    return np.ptp(np.asarray(te), axis=-1) / um


@pytest.mark.parametrize(
    ("resolution", "mean", "swing"),
    [
        (DEFAULT, (8.587, 19.415), (0.716, 1.352)),
        (FINER, (8.593, 19.433), (0.720, 1.364)),
        (ADJACENT, (8.553, 19.302), (0.676, 1.165)),
        (ADJACENT.finer_inside(), (8.560, 19.322), (0.674, 1.168)),
        (replace(DEFAULT, neighbours=1), None, (0.670, 1.153)),
    ],
    ids=["coupled", "coupled, finer", "adjacent, flank 24", "adjacent, finer", "adjacent, default"],
)
def test_helical_pair_by_resolution(resolution, mean, swing):
    ste = fem.static_transmission_error(helical_pair(), [150, 350], 30, resolution=resolution, progress=False)
    te = ste["te"].values
    half_cycle = peak_to_peak(te[:, :16:3])
    print(f"mean {te.mean(axis=1) / um} um, peak to peak {peak_to_peak(te)} um, of six phases {half_cycle} um")
    assert mean is None or te.mean(axis=1) / um == pytest.approx(mean, rel=1e-3)
    assert peak_to_peak(te) == pytest.approx(swing, rel=5e-3)


@pytest.mark.parametrize("phase", [0.0, 0.1])
def test_coupling_of_teeth_two_pitches_apart(phase):
    coupled, adjacent = (
        fem.static_transmission_error(helical_pair(), [150, 350], [phase], resolution=resolution, progress=False)["te"]
        for resolution in (FINER, replace(FINER, neighbours=1))
    )
    difference = (coupled - adjacent).values[:, 0] / um
    print(f"phase {phase}: {difference} um")
    assert difference == pytest.approx({0.0: (0.106, 0.306), 0.1: (0.085, 0.265)}[phase], rel=0.02)


def spur_and_helix(beta: float) -> fem.GearPair:
    pinion = fem.Gear(z=25, m_n=2 * mm, b=20 * mm, d_bore=20 * mm, beta=beta)
    return fem.GearPair(pinion, fem.Gear(z=47, m_n=2 * mm, b=20 * mm, d_bore=40 * mm, beta=-beta))


REQUESTS = {
    "paper": (paper_pair(), 350, (0.02, 0.005)),
    "tip relief": (paper_pair(TIP_RELIEF), 350, (0.02, 0.005)),
    "lead crowning": (paper_pair(LEAD_CROWNING), 350, (0.02,)),
    "helix 20 deg": (spur_and_helix(20 * deg), 100, (0.02,)),
    "FZG C, 40 um": (fzg_type_c(40 * um), 302, (0.02,)),
    "FZG C, 50 um": (fzg_type_c(50 * um), 302, (0.02,)),
    "wide": (wide_helical(), 25_465, (0.02,)),
}


@pytest.mark.parametrize(
    ("name", "accuracy"), [(name, accuracy) for name, (*_, requested) in REQUESTS.items() for accuracy in requested]
)
def test_requested_accuracy(name, accuracy):
    pair, torque, _ = REQUESTS[name]
    start = time.perf_counter()
    ste = fem.static_transmission_error(pair, fem.UpTo(torque), phases=None, accuracy=accuracy, progress=False)
    spent, error = time.perf_counter() - start, float(ste["error_p2p"][-1]) / um
    swing = peak_to_peak(ste["te"])[-1]
    size = f"{ste['torque'].size} x {ste['phase'].size}"
    print(f"{name}, {accuracy}: {size}, peak to peak {swing:.2f} +- {error:.2f} um, {spent:.1f} s")
    assert error < 5 * accuracy * swing * 3.1


@pytest.mark.parametrize("resolution", [DEFAULT, *(fem.Slices(slices=n) for n in (20, 40, 80))], ids=str)
def test_wide_pair_by_resolution(resolution):
    ste = fem.static_transmission_error(wide_helical(), 25_465, 28, resolution=resolution, progress=False)
    print(f"peak to peak {peak_to_peak(ste['te'])} um")
    assert 1.7 < peak_to_peak(ste["te"])[0] < 2.2


@pytest.mark.parametrize("load", [150.0, 350.0])
@pytest.mark.parametrize(
    ("ratio", "d_bore", "low", "high"),
    [
        *((ratio, 60 * mm, 1840, 2090) for ratio in (0.06, 0.08, 0.1, 0.11, 0.125)),
        *((0.1, bore, 1790, 2100) for bore in (40 * mm, 50 * mm, 70 * mm, 80 * mm)),
    ],
)
def test_resonances_by_what_is_chosen(ratio, d_bore, low, high, load):
    """Peaks at 1/4, 1/3, 1/2 and all of the main resonance, by damping ratio and bore, which the paper leaves open.

    More damping and a stiffer body raise the main resonance.
    """
    pair = korta_pair.paper_pair(d_bore)
    ste = fem.static_transmission_error(pair, korta_pair.MAP_TORQUES, korta_pair.MAP_PHASES, progress=False)
    box = korta_pair.gearbox(ste, ratio)
    peaks = exugear.spectrum.superharmonics(korta_pair.envelope_peaks(korta_pair.run(box, load)))
    damping = f"damping ratio {ratio:g}, {box.stages[0].force.damping:.0f} N s/m"
    print(f"bore {d_bore / mm:g} mm, {damping}, {load:g} N m: {peaks.round()} Hz")
    assert low < peaks[-1] < high


@pytest.mark.parametrize(
    ("load", "frequencies"),
    [(150.0, (301, 419, 520, 699, 1040, 1909.5)), (350.0, (363, 433, 543, 711, 1055, 2006))],
)
def test_superharmonics_by_mesh_harmonic(load, frequencies):
    """The series of the paper's pair: each peak with the mesh harmonic that excites it, and no other mark."""
    ste = fem.static_transmission_error(paper_pair(), korta_pair.MAP_TORQUES, korta_pair.MAP_PHASES, progress=False)
    table = exugear.resonances(korta_pair.run(korta_pair.gearbox(ste), load))
    print(table.to_dataframe().to_string())
    assert table["harmonic"].values.tolist() == [7 if load == 150 else 6, 5, 4, 3, 2, 1]
    assert table["mesh_frequency"].values == pytest.approx(frequencies, abs=1.0)
    assert np.ptp(table["response_frequency"].values[:-1]) < 70


@pytest.mark.parametrize("load", [150.0, 350.0])
@pytest.mark.parametrize(("tolerance", "step"), [(1e-3, None), (1e-4, None), (1e-4, 6e-6)])
def test_folded_harmonics_between_the_mesh_orders(tolerance, step, load):
    """Largest amplitude at least 0.05 mesh orders away from each order, in lines from 2450 rpm on."""
    ste = fem.static_transmission_error(paper_pair(), korta_pair.MAP_TORQUES, korta_pair.MAP_PHASES, progress=False)
    model = exugear.build(korta_pair.gearbox(ste))
    conditions = {"speed": (0, korta_pair.TOP_SPEED), "duration": korta_pair.DURATION, "progress": False}
    run = exugear.run_up(model, load=load, tolerance=tolerance, step=step, **conditions)
    data = run.data.isel(stage=0)
    speed = 2 * np.pi * data["mesh_frequency"].values
    dte = exugear.recorded_signal(data["time"].values, speed, data["dte"].values)
    lines = exugear.order_tracking(dte, highest_order=3.2, revolutions=400)
    level, order = 20 * np.log10(lines["amplitude"].values / um), lines["order"].values
    between = (order > 0.5) & (np.abs(order - np.round(order)) > 0.05)
    folded = level[lines["speed"].values > paper_gear().z * 2450 * rpm][:, between].max(axis=1)
    print(f"step {run.step / 1e-6:.1f} us, {load:g} N m: median {np.median(folded):.0f}, largest {folded.max():.0f} dB")
    print(f"  main resonance {level[:, order > 0.5].max():.0f} dB re 1 um")
    assert np.median(folded) < (-30 if tolerance > 5e-4 else -45)


@pytest.mark.parametrize("load", [150.0, 350.0])
def test_energy_balance_of_the_whole_run_up(load):
    """Over 70 s, and over random windows from 5 ms to 1 s; 2.7 GB."""
    ste = fem.static_transmission_error(paper_pair(), korta_pair.MAP_TORQUES, korta_pair.MAP_PHASES, progress=False)
    model, began = exugear.build(korta_pair.gearbox(ste)), time.perf_counter()
    conditions = {"speed": (0, korta_pair.TOP_SPEED), "duration": korta_pair.DURATION, "progress": False}
    run = exugear.run_up(model, load=load, power=True, checks=0, **conditions)
    random, whole = np.random.default_rng(0), run.energy_balance()
    starts, lengths = random.uniform(0.5, korta_pair.DURATION - 1, 300), 10 ** random.uniform(np.log10(5e-3), 0, 300)
    windows = [run.energy_balance(*window).relative for window in zip(starts, starts + lengths, strict=True)]
    middle, high, largest = np.quantile(windows, [0.5, 0.95, 1.0])
    print(f"\n{load:g} N m, {time.perf_counter() - began:.0f} s: whole {whole.relative:.1e} of the throughput")
    print(f"  windows: median {middle:.1e}, 95th percentile {high:.1e}, largest {largest:.1e}")
    print(whole)
    assert whole.relative < 1e-7 and high < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_time_of_a_state(kind):
    """Also over two processes, at the largest torque alone."""
    pair, times = pair_of_kind(*KINDS[kind]), {}
    for mode, before, (torque, resolution) in zip(MODES, OLD[kind], MODES.values(), strict=True):
        times[mode] = state_time(pair, torque, resolution), before
    with ProcessPoolExecutor(PROCESSES, mp_context=get_context("spawn")) as executor:
        spread = partial(fem.static_transmission_error, pair, [350], 30, executor=executor, progress=False)
        spread()
        wall = measured_time(spread) / 30 * 1e3
    print(f"{kind}: {times}; over {PROCESSES} processes {wall:.2f} ms")
    assert wall > 0


def measured_time(call) -> float:
    """Time of a call [s], printed with the peak memory of the process."""
    start = time.perf_counter()
    call()
    spent = time.perf_counter() - start
    print(f"{spent:.1f} s, {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6:.2f} GB at the peak")
    return spent


@pytest.mark.parametrize("pair", [paper_pair(), helical_pair()], ids=["spur", "helical"])
@pytest.mark.parametrize(
    "call",
    [lambda pair: fem.stress.solid_fields(pair, 150, 0.0), lambda pair: fem.root_stress(pair, 150, 8, progress=False)],
    ids=["solid fields", "root stress"],
)
def test_time_of_stresses(call, pair):
    assert measured_time(partial(call, pair)) > 0


def test_helical_curve_with_nothing_cached(tmp_path, monkeypatch):
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path))
    curve = partial(fem.static_transmission_error, helical_pair(), [150, 350], 30, progress=False)
    assert measured_time(curve) > 0


def test_time_of_two_helical_stages_on_bearings():
    """Time of a step and a mesh beside that of a spur pair in space on bearings."""
    ste = fem.static_transmission_error(paper_pair(), korta_pair.MAP_TORQUES, korta_pair.MAP_PHASES, progress=False)
    elastic = on_bearings(korta_pair.gearbox(ste))
    single = exugear.build(elastic, plan=exugear.plan(elastic).with_bodies())
    double = exugear.build(two_stage_helical.gearbox(two_stage_helical.laws(), two_stage_helical.pairs()))
    conditions = {"speed": two_stage_helical.SPEED, "duration": 10.0, "progress": False}
    runs = [exugear.run_up(model, load=load, **conditions) for model, load in ((single, 150.0), (double, 600.0))]
    of_pair, of_stages = (run.wall_time * run.step / 10.0 / 1e-6 / run.data["stage"].size for run in runs)
    print(f"{runs[1].wall_time:.1f} s; a step takes {of_pair:.1f} and {of_stages:.1f} us per mesh")
    assert runs[1].data["dte"].sizes["stage"] == 2
