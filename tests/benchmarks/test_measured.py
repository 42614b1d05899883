"""Numbers of examples/MEASURED.md that no other test shows: pytest tests/benchmarks/test_measured.py -m slow -n 0 -s.

Each test prints its row of a table. Times mean little on a busy machine, and only values are asserted.
"""

import resource
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import korta_pair
import numpy as np
import pytest
from helical_gears import helical
from modified_pairs import fzg_type_c, wide_helical
from paper_gears import paper_gear

import exugear
import fem
from exugear.post.plots import CYCLES
from fem.contact.resolution import Resolution, Slices
from fem.units import deg, mm, rpm, um

pytestmark = pytest.mark.slow
DEFAULT = Resolution()
ADJACENT = Resolution(fem.Density(flank=24, width=4), neighbours=1)
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
        (DEFAULT, (8.583, 19.403), (0.714, 1.345)),
        (DEFAULT.finer_inside(), (8.590, 19.420), (0.719, 1.356)),
        (ADJACENT, (8.549, 19.288), (0.673, 1.161)),
        (ADJACENT.finer_inside(), (8.558, 19.310), (0.674, 1.165)),
        (replace(DEFAULT, neighbours=1), None, (0.667, 1.149)),
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
        for resolution in (DEFAULT, replace(DEFAULT, neighbours=1))
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


@pytest.mark.parametrize("resolution", [DEFAULT, *(Slices(slices=n) for n in (20, 40, 80))], ids=str)
def test_wide_pair_by_resolution(resolution):
    ste = fem.static_transmission_error(wide_helical(), 25_465, 28, resolution=resolution, progress=False)
    print(f"peak to peak {peak_to_peak(ste['te'])} um")
    assert 1.7 < peak_to_peak(ste["te"])[0] < 2.2


@pytest.mark.parametrize("load", [150.0, 350.0])
@pytest.mark.parametrize("ratio", [0.05, 0.07, 0.08, 0.1])
def test_resonances_by_mesh_damping(ratio, load):
    """Peaks at 1/4, 1/3, 1/2 and all of the main resonance; more damping raises its frequency."""
    ste = fem.static_transmission_error(paper_pair(), korta_pair.MAP_TORQUES, korta_pair.MAP_PHASES, progress=False)
    peaks = korta_pair.shares_of_main(korta_pair.run(korta_pair.gearbox(ste, ratio), load))
    print(f"{ratio:.0%} of critical damping, {load:g} N m: {peaks.round()} Hz")
    assert 1850 < peaks[-1] < 2080


@pytest.mark.parametrize("load", [150.0, 350.0])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-4])
def test_folded_harmonics_between_the_mesh_orders(tolerance, load):
    """Largest amplitude at least 0.2 mesh orders away from each order, median of the lines from 2450 rpm on."""
    ste = fem.static_transmission_error(paper_pair(), korta_pair.MAP_TORQUES, korta_pair.MAP_PHASES, progress=False)
    model = exugear.build(korta_pair.gearbox(ste))
    conditions = {"speed": (0, korta_pair.TOP_SPEED), "duration": korta_pair.DURATION, "progress": False}
    data = exugear.run_up(model, load=load, tolerance=tolerance, **conditions).data.isel(stage=0)
    speed = 2 * np.pi * data["mesh_frequency"].values
    lines = exugear.order_spectrum(data["time"].values, speed, data["dte"].values, orders=3.2, revolutions=CYCLES)
    between = (lines.order > 0.5) & (np.abs(lines.order - np.round(lines.order)) > 0.2)
    fast = lines.speed > 57 * 2450 * rpm
    level = 20 * np.log10(lines.amplitude[fast][:, between].max(axis=1) / um)
    peak = 20 * np.log10(lines.amplitude[:, lines.order > 0.5].max() / um)
    print(f"tolerance {tolerance:g}, {load:g} N m: {np.median(level):.0f} dB, main resonance {peak:.0f} dB re 1 um")
    assert np.median(level) < (-20 if tolerance > 5e-4 else -35)


STATES = {
    "spur": (paper_pair, ()),
    "spur, tip relief": (paper_pair, (TIP_RELIEF,)),
    "spur, lead crowning": (paper_pair, (LEAD_CROWNING,)),
    "helix 15 deg": (helical_pair, ()),
    "helix 15 deg, relief and crowning": (helical_pair, (TIP_RELIEF, LEAD_CROWNING)),
}


def state_time(pair: fem.GearPair, torque, executor=None) -> float:
    """Median time of a state [ms] in maps of 30 phases, compliances in the cache."""
    times = []
    for _ in range(6):
        start = time.perf_counter()
        ste = fem.static_transmission_error(pair, torque, 30, executor=executor, progress=False)
        times.append((time.perf_counter() - start) / ste["te"].size * 1e3)
    return float(np.median(times[1:]))


@pytest.mark.parametrize("name", STATES)
def test_time_of_a_state(name):
    make, flank = STATES[name]
    pair, torques = make(*flank), np.linspace(150, 350, 5)
    single, pairwise, several = (state_time(pair, torque) for torque in ([350], [150, 350], torques))
    further = (several * 5 - pairwise * 2) / 3
    with ProcessPoolExecutor(PROCESSES, mp_context=get_context("spawn")) as executor:
        spread = state_time(pair, [350], executor)
    print(f"{name}: further torque {further:.1f}, 150 and 350 N m {pairwise:.1f}, 350 N m {single:.1f} ms")
    print(f"  over {PROCESSES} processes {spread:.1f} ms")
    assert further < single


def test_helical_curve_with_nothing_cached(tmp_path, monkeypatch):
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path))
    start = time.perf_counter()
    ste = fem.static_transmission_error(helical_pair(), [150, 350], 30, progress=False)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"{time.perf_counter() - start:.1f} s, {memory:.2f} GB at the peak")
    assert ste["te"].size == 60
