"""Extreme masses, bearings, maps and gears: the right answer, or a refusal with its reason."""

import numpy as np
import pytest
from scenes import INERTIA, paper_gear, paper_pair, ran, rms, smooth_map

import exugear
import fem
from fem import ste_map
from fem.units import mm, rpm, um

R_B, TEETH = paper_pair().wheel.r_b, 57
FORCE = 150 / R_B
SMOOTH = smooth_map()


def heavy(fast: float, slow: float, damping: float = 2700.0) -> exugear.Model:
    """The smooth pair with its inertia times a factor on each shaft."""
    inertias = {"fast": fast * INERTIA, "slow": slow * INERTIA}
    shafts = [exugear.Shaft(name, {0.0: paper_gear()}, inertia=x) for name, x in inertias.items()]
    return exugear.build(exugear.Gearbox([exugear.Stage(*shafts, SMOOTH, damping=damping)]))


def held(fast: float, slow: float) -> exugear.Model:
    """The smooth pair with a bearing of a stiffness [N/m] under each gear, so that the shafts do not tilt."""
    stiffness = {"fast": fast, "slow": slow}
    ends = {name: exugear.Bearing(k, k, tilt=1e-3 * k, damping_time=1e-5) for name, k in stiffness.items()}
    shafts = [exugear.Shaft(name, {0.0: [paper_gear(), end]}) for name, end in ends.items()]
    return exugear.build(exugear.Gearbox([exugear.Stage(*shafts, SMOOTH, damping=2700.0)]))


def meshing(law, pair: fem.GearPair, damping: float | None = 2700.0) -> exugear.Model:
    shafts = [exugear.Shaft(name, {0.0: gear}) for name, gear in (("fast", pair.pinion), ("slow", pair.wheel))]
    return exugear.build(exugear.Gearbox([exugear.Stage(*shafts, law, pair=pair, damping=damping)]))


@pytest.fixture(scope="module")
def unit() -> np.ndarray:
    return ran(heavy(1, 1))["dte"].values


@pytest.mark.parametrize("share", [1e-3, 1e3, 1e6])
def test_masses_over_decades_are_similar(share, unit):
    """Times scale with the root of the inertia, speeds and damping accordingly: the deflections stay the same."""
    slower = share**0.5
    times = {"speed": 1000 * rpm / slower, "duration": 0.2 * slower, "sample": 4e-5 * slower}
    dte = ran(heavy(share, share, damping=2700 * slower), **times)["dte"].values
    assert dte == pytest.approx(unit, abs=1e-6 * np.ptp(unit))


@pytest.mark.parametrize("share", [1e-3, 1e3, 1e6])
def test_inertia_of_the_driving_shaft_does_not_matter(share):
    """From a thousandth to a million times the inertia of the slow shaft."""
    conditions = {"duration": 0.1, "step": 3e-6, "sample": 1.2e-5, "tolerance": 1e-6}
    dte, reference = (ran(heavy(fast, 1), **conditions)["dte"].values for fast in (share, 1))
    assert dte == pytest.approx(reference, abs=1e-6 * np.ptp(reference))


@pytest.mark.parametrize(("fast", "slow"), [(1e12, 1e6), (1e6, 1e12)])
def test_bearings_a_million_times_apart_carry_the_mesh_force(fast, slow):
    """At rest; while running, half the step gives the same force."""
    model = held(fast, slow)
    rest = ran(model, speed=0.0, duration=1e-3, load=15.0)
    assert rest["mesh_force"].values == pytest.approx(FORCE / 10, rel=1e-9)
    carried = np.linalg.norm(rest["bearing_force"].isel(time=0, direction=slice(2)).values, axis=1)
    assert carried == pytest.approx(FORCE / 10, rel=1e-6)
    conditions = {"duration": 0.02, "speed": 1500 * rpm, "load": 15.0}
    half = ran(model, **conditions, step=model.plan.step() / 2)
    assert rms(ran(model, **conditions), 4) == pytest.approx(rms(half, 4), rel=5e-3)


@pytest.mark.parametrize("soft", [1e5, 5e5])
def test_bearings_that_let_the_teeth_part_are_named(soft):
    """They yield by 22 and 4 mm; at 1.3 mm more centre distance the contact ratio falls to 1."""
    with pytest.raises(RuntimeError, match=r"bearings of fast-slow yield .* mm, .* try less load or stiffer bearings"):
        ran(held(1e11, soft), duration=0.005)


def test_a_map_of_a_single_torque_defines_the_secant_law_alone():
    """Its law is that of the whole map at this torque."""
    single, pair = SMOOTH.sel(torque=[150.0]), paper_pair()
    law_of_whole_map, law = (exugear.MeshForce.secant(ste, 150.0, damping=2700.0) for ste in (SMOOTH, single))
    phase = np.linspace(0, 1, 101)
    assert law(phase, 5 * um) == pytest.approx(law_of_whole_map(phase, 5 * um), rel=1e-6)
    crawl = ran(meshing(law, pair, None), speed=1 * rpm, load=50.0, duration=0.01)
    assert crawl["dte"].values[0, -1] * 3 == pytest.approx(single["te"].values[0, 0], rel=1e-2)
    with pytest.raises(ValueError, match=r"torque needs 0 and two loads .*MeshForce.secant"):
        meshing(single, pair)
    with pytest.raises(ValueError, match=r"torque must be > 0 and lie in \[150, 150\] N m"):
        exugear.MeshForce.secant(single, 100.0)


@pytest.mark.parametrize(("phases", "error"), [(30, 0.005), (20, 0.03), (10, 0.1), (6, 0.25)])
def test_coarse_maps_are_as_good_as_their_phases(phases, error):
    """rms of the DTE below the resonances against a map of 60 phases."""
    fine, coarse = (rms(ran(meshing(smooth_map(phases=n), paper_pair()), speed=400 * rpm)) for n in (60, phases))
    assert np.abs(coarse / fine - 1).mean() < error


@pytest.mark.parametrize("phases", [1, 2])
def test_maps_of_too_few_phases_are_refused(phases):
    with pytest.raises(ValueError, match="phase needs at least 3 values"):
        meshing(smooth_map(phases=phases), paper_pair())


def noisy(wave: float, each: float):
    """The smooth map with random errors [m] of the flanks, at all torques alike, and of each measured value."""
    random, te = np.random.default_rng(5), SMOOTH["te"].values
    errors = wave * random.normal(size=te.shape[1]) + each * random.normal(size=te.shape)
    return ste_map(paper_pair(), SMOOTH["torque"].values, SMOOTH["phase"].values, te + errors)


@pytest.mark.parametrize("wave", [0.1 * um, 1 * um, 5 * um])
def test_measured_waves_are_followed(wave):
    """At low speed the DTE is the map, but for the lag by damping; at speed, also with contact loss, the mean load."""
    ste = noisy(wave, 0.0)
    pitch = 2 * np.pi / TEETH / (0.5 * rpm)
    slow = ran(meshing(ste, paper_pair()), speed=0.5 * rpm, duration=pitch)
    assert slow["dte"].interp(time=ste["phase"].values * pitch).values[0] == pytest.approx(
        ste["te"].sel(torque=150).values, abs=(0.001 + 0.002 * wave / um) * um
    )
    fast = ran(meshing(ste, paper_pair()), duration=0.4)["mesh_force"].values[0]
    assert fast.mean() == pytest.approx(FORCE, rel=1e-2)
    assert (fast.min() <= 0) == (wave > 4 * um)


def test_noise_that_makes_te_fall_with_torque_is_refused_with_phase_and_remedy():
    with pytest.raises(ValueError, match=r"te must grow .* got -.* um from 0 to 1 N m at phase 0\..*smooth me"):
        meshing(noisy(0.0, 0.1 * um), paper_pair())


def plain(z: int, x: float) -> fem.Gear:
    return fem.Gear(z=z, m_n=2.6 * mm, b=23 * mm, d_bore=5 * mm if z < 20 else 60 * mm, x=x)


def even(a: float | None = None, **changes) -> fem.GearPair:
    return fem.GearPair(paper_gear(**changes), paper_gear(**changes), a=a)


@pytest.mark.slow
@pytest.mark.parametrize(
    "pair",
    [
        pytest.param(even(150 * mm, d_a=153.02 * mm), id="contact ratio 1.0007"),
        pytest.param(even(s_n=4.75 * mm), id="no backlash"),
        pytest.param(even(150 * mm, d_a=156.9 * mm), id="pointed"),
        pytest.param(fem.GearPair(plain(8, 0.2), plain(57, -0.2)), id="undercut"),
    ],
)
def test_nearly_singular_gears_run(pair):
    """At low speed the DTE is the map; at speed the gears transmit the load."""
    quick = fem.Slices()
    load = 0.1 * pair.pinion.r**2 / (74e-3) ** 2 * 1500
    torque = load * np.array([0, 0.01, 0.1, 0.3, 1, 3])
    ste = fem.static_transmission_error(pair, torque, 30, resolution=quick, progress=False)
    model, pitch = meshing(ste, pair, 1000.0), 2 * np.pi / pair.pinion.z / (1 * rpm)
    carried = load * pair.wheel.z / pair.pinion.z
    slow = ran(model, speed=1 * rpm, load=carried, duration=pitch)["dte"].interp(time=ste["phase"].values * pitch)
    assert slow.values[0] == pytest.approx(ste["te"].values[4], abs=2e-3 * ste["te"].values[4].max())
    fast = ran(model, speed=600 * rpm, load=carried)["mesh_force"].values[0]
    assert fast.mean() == pytest.approx(load / pair.pinion.r_b, rel=5e-3)
