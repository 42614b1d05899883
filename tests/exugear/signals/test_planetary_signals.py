"""Orders in the frames of carrier and ring, side bands of a set with their causes, orbits of its members."""

import numpy as np
import pytest
from coupled_sets import stepped
from planetary_boxes import PIN, planar_box, planetary, planetary_box, published_set, waving_law

import exugear
from fem.units import deg, um

IN_PHASE, IN_SEQUENCE = (0.0, 120 * deg, 240 * deg), (0.0, 126 * deg, 252 * deg)
TURNS = {"turns_of": "carrier", "relative_to": "ring"}


def set_of(angles, **changes) -> exugear.Planetary:
    """The set of Shweiki et al. with a floating sun, and planets on pins."""
    parts = published_set()
    soft = exugear.Bearing(radial=1e6, axial=1e8, tilt=1e6, damping_time=1e-3)
    sun = exugear.Shaft("sun", {0.0: [parts["sun_pair"].pinion, soft]}, inertia=0.5, mass=50.0)
    law = waving_law(damping=2e4)
    return exugear.Planetary(**parts | {"sun": sun}, sun_mesh=law, ring_mesh=law, angles=angles, pin=PIN, **changes)


@pytest.fixture(scope="module")
def in_sequence():
    """Seven turns of the carrier at constant speed."""
    model = exugear.build(exugear.Gearbox([set_of(IN_SEQUENCE)], held="ring"))
    options = {"duration": 6.5, "sample": 2e-4, "displacement": True, "progress": False, "checks": 0}
    return exugear.run_up(model, speed=40.0, load=20e3, **options)


@pytest.mark.parametrize(("driving", "held"), [("sun", "ring"), ("sun", "carrier"), ("carrier", "sun")])
def test_mesh_orders_are_multiples_of_the_teeth_of_the_ring_whichever_member_is_held(driving, held):
    """A turn of the carrier against the ring, also where the ring turns: 90 mesh cycles; against the sun 30."""
    model = exugear.build(planetary_box(held=held, driving=driving))
    run = exugear.run_up(model, speed=(50.0, 60.0), load=100.0, duration=5e-3, progress=False, checks=0)
    assert exugear.mesh_orders(run, **TURNS).tolist() == [90, 180, 270]
    assert exugear.mesh_orders(run, turns_of="sun", relative_to="carrier").tolist() == [30, 60, 90]
    heard, ratios = exugear.signal(run, "dte", stage="planet 2-ring", **TURNS), model.gearbox.ratios
    assert heard["angle"][-1] == pytest.approx(abs(ratios["carrier"] - ratios["ring"]) * 55.0 * 5e-3)
    assert heard["speed"].attrs["long_name"] == "speed of the carrier relative to ring"
    with pytest.raises(ValueError, match=f"the {held} does not turn; name another"):
        exugear.signal(run, "dte", turns_of=held)
    with pytest.raises(ValueError, match=r"relative_to must be one of the shafts \['sun', .* got 'rim'"):
        exugear.signal(run, "dte", turns_of="carrier", relative_to="rim")


@pytest.mark.parametrize("angles", [IN_PHASE, IN_SEQUENCE, (0.0, 90 * deg, 180 * deg, 270 * deg)])
def test_side_bands_of_equal_planets_are_those_of_the_phasing_rule(angles):
    """Of |z_r| cycles a turn, heard by (1 + cos x + cos 2x) / 2: N/2 share at |z_r|, N/4 share beside it."""
    of_set, turn = planetary(angles=angles) if len(angles) == 4 else set_of(angles), 2 * np.pi * 7
    z, theta = abs(of_set.gears[2].z), np.linspace(0.0, turn, 20_001)
    at = [theta + angle for angle in angles]
    passing = sum(np.cos(z * x) * (1 + np.cos(x) + np.cos(2 * x)) / 2 for x in at)
    heard = exugear.recorded_signal(theta, np.ones(theta.size), passing)
    lines = exugear.side_bands(heard, of_set, harmonics=1, carrier_orders=3)
    offsets = lines["offset"].values
    window = np.select([offsets == 0, np.abs(offsets) <= 2], [len(angles) / 2, len(angles) / 4], 0.0)
    assert lines["mean_amplitude"].values == pytest.approx(window * lines["share"].values, abs=1e-4)
    if angles is not IN_SEQUENCE:
        passes = (z + offsets) % len(angles) == 0
        assert lines["share"].values == pytest.approx(passes.astype(float), abs=1e-9)
        assert [cause.startswith("planet pass") for cause in lines["cause"].values] == (
            passes & (offsets != 0)
        ).tolist()


@pytest.mark.parametrize("mesh", ["ring", "sun"])
def test_side_bands_of_stepped_planets_are_those_of_their_phases_at_sun_and_ring(mesh):
    """The sun's meshes pass |z_r| z_1 / z_2 times a turn, not a whole number; phases are those of the set's table."""
    of_set = stepped(angles=(0.0, 120 * deg + 2 * np.pi * 5 / 1140, 240 * deg))
    phases, cycles = of_set.mesh_phases()[f"{mesh}_phase"].values, 81 * 36 / 21 if mesh == "sun" else 81
    theta = np.linspace(0.0, 2 * np.pi * 33, 60_001)
    passing = [
        np.cos(cycles * theta + 2 * np.pi * phase) * (1 + np.cos(theta + angle))
        for phase, angle in zip(phases, of_set.angles, strict=True)
    ]
    heard = exugear.recorded_signal(theta, np.ones(theta.size), sum(passing))
    lines = exugear.side_bands(heard, of_set, harmonics=1, carrier_orders=1, mesh=mesh)
    assert lines["order"].values == pytest.approx(cycles + np.array([-1, 0, 1]))
    assert lines["mean_amplitude"].values == pytest.approx(
        3 * np.array([0.5, 1, 0.5]) * lines["share"].values, abs=1e-3
    )
    assert float(lines["share"].min()) > 0.01
    assert float(lines["share"].max()) < 0.999


def test_errors_of_sun_and_planet_stand_at_their_own_turns():
    of_set, theta = set_of(IN_PHASE), np.linspace(0.0, 2 * np.pi * 33, 60_001)
    turns = {"sun": 99 / 21, "planet": 99 / 39}
    mesh = sum((1 + 0.1 * np.cos(turn * theta)) * np.cos(99 * theta) for turn in turns.values())
    heard = exugear.recorded_signal(theta, np.ones(theta.size), mesh)
    lines = exugear.side_bands(heard, of_set, harmonics=1, carrier_orders=1, members=["sun", "planet"])
    for name, turn in turns.items():
        for side in (-1, 1):
            line = lines.sel(order=99 + side * turn, method="nearest")
            assert float(line["order"]) == pytest.approx(99 + side * turn)
            assert float(line["mean_amplitude"]) == pytest.approx(0.05, rel=1e-3)
            assert line["cause"].item() == f"error of the {name}, once per turn against the carrier"
    assert float(lines["level"].sel(order=99)) == 0.0


def test_what_the_torque_loses_the_orbit_of_the_sun_gains(in_sequence):
    """In the carrier's frame the lateral force stands at the mesh order, in that of the housing a turn beside it."""
    of_set = set_of(IN_SEQUENCE)
    assert of_set.mesh_phases()["torque_sum"].values == pytest.approx([0.0585, 0.1273, 0.9674, 0.2060], abs=1e-4)
    seen = {}
    for frame in (None, "carrier"):
        orbit = exugear.member_orbit(in_sequence, "sun", frame=frame)
        along_x = orbit["displacement"].sel(direction="x", time=slice(0.7, None))
        seen[frame] = exugear.side_bands(along_x, of_set, harmonics=1, carrier_orders=2)["mean_amplitude"].values
    housing, carrier = seen[None], seen["carrier"]
    assert carrier.argmax() == 2 and np.delete(carrier, 2).max() < 1e-3 * carrier[2]
    assert np.delete(housing, [1, 3]).max() < 1e-3 * housing[3]
    assert housing[3] + housing[1] == pytest.approx(carrier[2], rel=0.03)
    assert housing[1] < 0.3 * housing[3]


def test_an_orbit_is_told_per_turn_and_a_planet_from_its_pin(in_sequence):
    orbit = exugear.member_orbit(in_sequence, "sun")
    assert orbit["turn"].values.tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert np.ptp(orbit["radius"].values[1:]) < 0.01 * float(orbit["radius"][-1])
    assert orbit.attrs == {"member": "sun", "frame": "housing"}
    pin = exugear.member_orbit(in_sequence, "planet 2")
    tangential = in_sequence.data["bearing_force"].sel(bearing="planet 2 at 0 mm", direction="y").mean()
    assert float(pin["displacement"].sel(direction="y").mean()) == pytest.approx(-float(tangential) / 1e8, rel=1e-3)
    force = exugear.member_orbit(in_sequence, "planet 2", quantity="force")
    assert float(force["force"].sel(direction="y").mean()) == pytest.approx(float(tangential))
    with pytest.raises(ValueError, match=r"member must be one of the shafts on bearings \['sun', 'planet 1'"):
        exugear.member_orbit(in_sequence, "carrier")
    with pytest.raises(ValueError, match="planets are seen from their carrier"):
        exugear.member_orbit(in_sequence, "planet 2", frame="carrier")


def test_the_ring_hears_the_planet_that_passes(in_sequence):
    """Static forces: with a reach below half the distance of the planets each is heard alone."""
    heard = exugear.force_seen_from_ring(in_sequence, 126 * deg, reach=50 * deg)
    at, forces = heard["angle"].values, in_sequence.data["mesh_force"]
    assert float(heard[0]) == pytest.approx(float(forces.sel(stage="planet 2-ring")[0]))
    passing = np.abs(at - 126 * deg).argmin()
    assert float(heard[passing]) == pytest.approx(float(forces.sel(stage="planet 1-ring")[passing]), rel=1e-3)
    assert float(heard[np.abs(at - 60 * deg).argmin()]) == 0.0
    whole = exugear.force_seen_from_ring(in_sequence)
    assert float(whole["mesh_order"]) == 99.0


@pytest.mark.parametrize("held", ["ring", "carrier"])
def test_a_run_that_goes_on_is_seen_from_where_it_began(held):
    """Carrier and ring have turned by then: as the second half of one run of twice the duration."""
    soft = exugear.Bearing(radial=1e6, axial=1e8, tilt=1e6, damping_time=2e-5)
    model = exugear.build(planar_box(soft, held=held, pin_errors=[-20 * um, 0, 0]))
    turning = "carrier" if held == "ring" else "ring"

    def run_of(duration: float, initial: exugear.Run | None = None) -> exugear.Run:
        drives, options = {"sun": exugear.Speed(100.0)}, {"step": 2e-5, "sample": 2e-5, "progress": False, "checks": 0}
        ends = {"drives": drives, "loads": {turning: 400.0}, "duration": duration, "initial": initial}
        return exugear.run(model, **ends, displacement=True, **options)

    whole, half = run_of(0.08), run_of(0.04)
    second = run_of(0.04, half)

    def seen(run: exugear.Run) -> list[np.ndarray]:
        heard = exugear.force_seen_from_ring(run, angle=1.0, reach=1.0).values
        return [heard, *exugear.member_orbit(run, "sun", frame=turning)["displacement"].values]

    number = second.data.sizes["time"]
    for of_whole, of_second in zip(seen(whole), seen(second), strict=True):
        assert of_second == pytest.approx(of_whole[-number:], abs=1e-3 * np.abs(of_whole).max())


def test_wrong_signals_and_numbers_are_refused(in_sequence):
    of_set, dte = set_of(IN_SEQUENCE), exugear.signal(in_sequence, "dte")
    with pytest.raises(ValueError, match=r"signal must count turns of the carrier against the ring, 99 mesh cycles"):
        exugear.side_bands(dte, of_set)
    heard = exugear.signal(in_sequence, "dte", **TURNS)
    with pytest.raises(ValueError, match=r"carrier_orders must lie in \[1, 49\]"):
        exugear.side_bands(heard, of_set, carrier_orders=60)
    with pytest.raises(ValueError, match='members must be a list of "sun" and "planet"'):
        exugear.side_bands(heard, of_set, members=["ring"])
    with pytest.raises(ValueError, match=r"reach must lie in \(0, pi\] rad, got 60"):
        exugear.force_seen_from_ring(in_sequence, reach=60)
    spinning = exugear.build(planetary_box(pin_errors=[-20 * um, 0, 0]))
    run = exugear.run_up(spinning, speed=50.0, load=4000.0, duration=1e-3, progress=False, checks=0)
    with pytest.raises(ValueError, match="the shafts of this run only spin"):
        exugear.member_orbit(run, "sun")
