"""Sets with several free speeds: members driven at speeds or by torques, loaded or free in any combination."""

import numpy as np
import pytest
from planetary_boxes import GEAR, RING_PAIR, SUN_PAIR, members, planetary, waving_law

import exugear

QUIET = {"progress": False, "checks": 0}
FLAT = waving_law(amplitude=0.0)
#: z_s / |z_r| = 1/3: torques of sun, ring and carrier are 1 : 3 : -4.
SPEEDS = {"sun": 1.0, "ring": -0.2}


def differential(speeds=SPEEDS, law=FLAT, ring=None, **options) -> exugear.Gearbox:
    """A set no member of which is held; ring: further parts of the ring."""
    parts = {"ring": exugear.Shaft("ring", {0.0: [RING_PAIR.wheel, *(ring or ())]}, inertia=0.05, mass=5.0)}
    return exugear.Gearbox([planetary(law, **members() | parts)], speeds=speeds, **options)


def of_members(data, quantity: str, coordinate: str) -> dict[str, np.ndarray]:
    return {str(name): data[quantity].sel({coordinate: name}).values for name in data[coordinate].values}


@pytest.fixture(scope="module")
def model():
    return exugear.build(differential())


def test_a_run_up_imposes_both_speeds_in_their_ratio_and_the_torques_balance(model):
    """z_s w_s + |z_r| w_r = (z_s + |z_r|) w_c; sun 100, ring 300, carrier -400 N m about z to 1e-10."""
    box = model.gearbox
    assert (box.driving.name, box.driven.name) == ("sun", "carrier")
    assert box.ratios["carrier"] == pytest.approx((1 - 3 * 0.2) / 4, rel=1e-15)
    data = exugear.run_up(model, speed=100.0, load=400.0, duration=0.02, **QUIET).data
    drives = of_members(data, "drive_torque", "drive_end")
    assert np.abs(drives["sun"] - 100.0).max() < 1e-10 * 400
    assert np.abs(-drives["ring"] - 300.0).max() < 1e-10 * 400
    assert data["mesh_frequency"].values[0, 0] == pytest.approx(30 * (100 - 10) / (2 * np.pi))


@pytest.mark.parametrize("driving", [("sun", "ring"), ("carrier", "sun"), ("ring", "carrier")])
def test_any_two_members_may_be_driven_at_speeds_that_are_no_nominal_ones(driving):
    """The third is loaded; energy is balanced while one speed rises and the other one falls."""
    (loaded,) = {"sun", "ring", "carrier"} - {*driving}
    box = differential(dict.fromkeys(driving, 1.0), waving_law())
    speeds = dict(zip(driving, ((20.0, 60.0), (50.0, 30.0)), strict=True))
    run = exugear.run(exugear.build(box), drives=speeds, loads={loaded: 200.0}, duration=0.02, power=True, **QUIET)
    assert run.energy_balance().relative < 1e-8
    w = of_members(run.data, "shaft_speed", "shaft")
    assert np.abs(w["sun"] + 3 * w["ring"] - 4 * w["carrier"]).max() < 0.5
    assert float(run.data["mesh_force"].min()) > 0


def test_loads_on_two_members_of_a_driven_carrier_turn_them_apart_as_rigid_bodies_do():
    """Carrier imposed, sun and ring loaded 10 : 30 in balance, and 30 N m too much on the ring."""
    model = exugear.build(differential({"carrier": 1.0, "sun": 1.0}, driven="ring"))
    options = {"drives": {"carrier": exugear.Speed(50.0)}, "duration": 0.01, **QUIET}
    balanced = exugear.run(model, loads={"sun": 10.0, "ring": 30.0}, **options).data
    assert np.ptp(balanced["shaft_speed"].sel(shaft=["sun", "ring"]).values) < 1e-6 * 50
    data = exugear.run(model, loads={"sun": 10.0, "ring": 60.0}, **options).data
    # Beside the carrier's turning the sun turns by 1, the ring by -1/3, planets by -1 in its frame.
    inertia = GEAR.inertia + 0.05 / 9 + 3 * GEAR.inertia
    acceleration = (-10.0 + 60.0 / 3) / inertia
    speeds = data["shaft_speed"]
    assert float(speeds.sel(shaft="sun")[-1]) == pytest.approx(50.0 + 0.01 * acceleration, rel=1e-4)
    assert float(speeds.sel(shaft="ring")[-1]) == pytest.approx(50.0 - 0.01 * acceleration / 3, rel=1e-4)


def test_a_free_ring_runs_up_until_its_drag_is_the_reaction():
    """Sun imposed at 100 rad/s, carrier loaded by 40 N m: the ring's drag of 2 N m s/rad bears 30 N m at -15 rad/s."""
    box = differential({"sun": 1.0, "ring": 0.0}, ring=[exugear.Drag(viscous=2.0)])
    options = {"drives": {"sun": 100.0}, "loads": {"carrier": 40.0}, "power": True, **QUIET}
    run = exugear.run(exugear.build(box), duration=0.6, start_speed={"ring": -10.0}, tolerance=1e-2, **options)
    ring = run.data["shaft_speed"].sel(shaft="ring")
    assert float(ring[0]) == pytest.approx(-10.0)
    assert float(ring[-1]) == pytest.approx(-15.0, rel=1e-3)
    assert float(run.data["drive_torque"].sel(drive_end="sun")[-1]) == pytest.approx(10.0, rel=1e-3)
    assert run.energy_balance().relative < 1e-6


def test_torques_on_all_members_accelerate_both_free_motions(model):
    """Without an imposed speed: J a = Q over sun and ring, carrier and planets in their ratios."""
    torques = {"sun": exugear.Torque(50.0), "ring": exugear.Torque(-200.0)}
    data = exugear.run(
        model, drives=torques, loads={"carrier": 300.0}, start_speed=30.0, duration=5e-3, **QUIET
    ).data  # fmt: skip
    of_sun, of_ring = np.array([1, 0, 1 / 4, -1 / 2]), np.array([0, 1, 3 / 4, 3 / 2])
    inertias = [GEAR.inertia, 0.05, 0.02 + 3 * GEAR.mass * SUN_PAIR.a**2, 3 * GEAR.inertia]
    motions = np.array([of_sun, of_ring])
    # Senses of motion: sun +, ring -, carrier +.
    push = motions @ [50.0, 200.0, -300.0, 0.0]
    acceleration = np.linalg.solve(motions * inertias @ motions.T, push)
    speeds = of_members(data, "shaft_speed", "shaft")
    assert speeds["sun"][-1] == pytest.approx(30.0 + 5e-3 * acceleration[0], rel=1e-3)
    assert -speeds["ring"][-1] == pytest.approx(-6.0 + 5e-3 * acceleration[1], rel=1e-3)


def test_a_run_goes_on_with_both_speeds(model):
    first = exugear.run(model, drives={"sun": 100.0}, loads={"carrier": 40.0}, duration=2e-3, **QUIET)
    second = exugear.run(model, drives={"sun": 100.0}, loads={"carrier": 40.0}, duration=2e-3, initial=first, **QUIET)
    whole = exugear.run(model, drives={"sun": 100.0}, loads={"carrier": 40.0}, duration=4e-3, **QUIET)
    ends = [run.data["shaft_speed"].sel(shaft="ring").values[-1] for run in (second, whole)]
    assert ends[0] == pytest.approx(ends[1], rel=1e-6)


def test_modes_hold_or_free_both_driving_shafts(model):
    """Free: two motions without a frequency; held: none."""
    free, held = (exugear.modes(model, load=400.0, drive=drive)["frequency"].values for drive in ("free", "held"))
    assert (np.count_nonzero(free < 1e-3), np.count_nonzero(held < 1e-3)) == (2, 0)
    assert free.size == held.size + 2


@pytest.mark.parametrize(
    ("conditions", "words"),
    [
        ({"drives": {"sun": 1.0, "ring": 1.0, "carrier": 1.0}}, "of which the meshes leave 2 free at most"),
        ({"drives": {"sun": 1.0}, "start_speed": 3.0}, r"pass start_speed=\{'ring': speed\}, or leave it out"),
        ({"drives": {"sun": 1.0}, "start_speed": {"sun": 3.0}}, "start_speed must hold 1 shafts"),
        ({"drives": {"sun": 1.0}, "start_speed": {"hub": 3.0}}, r"start_speed: no shafts \['hub'\]"),
        ({"drives": {"sun": 1.0, "ring": 1.0}, "start_speed": {"carrier": 3.0}}, "beside the imposed speed of 'sun'"),
    ],
)
def test_conditions_that_contradict_are_refused(model, conditions, words):
    with pytest.raises(ValueError, match=words):
        exugear.run(model, **conditions, duration=0.01, **QUIET)


@pytest.mark.parametrize(
    ("speeds", "words"),
    [
        ({"sun": 1.0}, "speeds must hold 2 members, as many as are free.*add one, or hold"),
        ({"sun": 1.0, "ring": 1.0, "carrier": 1.0}, "leave one out"),
        ({"sun": 0.0, "ring": 0.0}, "not all 0"),
        ({"sun": 1.0, "hub": 1.0}, r"no shafts \['hub'\]"),
        ([1.0, 2.0], "speeds must map names of shafts"),
    ],
)
def test_speeds_that_do_not_determine_the_others_are_refused(speeds, words):
    with pytest.raises(ValueError, match=words):
        differential(speeds)
