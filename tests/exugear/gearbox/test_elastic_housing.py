"""Housings with coordinates of their own: rolling bearings on seats that yield, and modes in runs, modes and noise."""

from functools import cache

import numpy as np
import pytest
from meshed_housings import SEATS, walls_on_plate
from paper_gears import paper_gear, paper_pair
from scenes import smooth_law

import exugear
from fem.units import mm

BALL = exugear.Bearing(radial=2e8, axial=1e8, damping_time=1e-5)
TILTING = exugear.Bearing(radial=2e8, axial=1e8, tilt=1e5, damping_time=1e-5)
OPTIONS = {"progress": False, "checks": 0}


def rolling() -> exugear.RollingBearing:
    d = 11.5 * mm
    inner = {"Z": 7, "D_w": d, "D_pw": 43.5 * mm, "r_i": 0.52 * d, "r_e": 0.53 * d}
    return exugear.RollingBearing.deep_groove(**inner, clearance=0.0, damping_time=1e-5)


def box_on(housing, bearing=BALL, sections: bool = False) -> exugear.Gearbox:
    options = {"sections": [(45 * mm, 100 * mm)]} if sections else {}
    parts = {0.0: bearing, 40 * mm: paper_gear(), 100 * mm: bearing}
    shafts = [exugear.Shaft(name, parts, **options) for name in ("fast", "slow")]
    law = smooth_law(damping=2700.0)
    return exugear.Gearbox([exugear.Stage(*shafts, law, pair=paper_pair())], housing=housing)


@cache
def vibrating(damping_ratio: float = 0.02) -> exugear.Housing:
    return exugear.Housing.from_reduction(walls_on_plate(), SEATS, damping_ratio=damping_ratio)


def stiff(factor: float) -> exugear.Housing:
    """A housing whose stiffness is a factor times that of the bearings, and more."""
    return exugear.Housing(SEATS, np.eye(24) * factor * 2e8)


def run_of(box: exugear.Gearbox, plan=None, **options) -> exugear.Run:
    options = {"speed": (100.0, 130.0), "load": 100.0, "duration": 0.02, "step": 1e-5, "sample": 1e-5} | options
    return exugear.run_up(exugear.build(box, plan=plan), **OPTIONS, **options)


@pytest.mark.parametrize("sections", [False, True])
def test_rolling_bearings_on_a_very_stiff_housing_run_as_on_ground(sections):
    on_seats, on_ground = (run_of(box_on(x, rolling(), sections)).data for x in (stiff(1e7), None))
    for name in ("dte", "bearing_force"):
        scale = np.abs(on_ground[name].values).max()
        np.testing.assert_allclose(on_seats[name], on_ground[name], atol=2e-6 * scale)


def test_coordinates_of_a_stiff_housing_give_its_static_stiffness():
    """Linear bearings on standing and on moving seats without mass, at frequencies far below that of the cap."""
    box = box_on(stiff(3.0))
    in_coordinates = exugear.plan(box, housing_modes=0)
    static, moving = (run_of(box, plan, speed=20.0, duration=0.03).data for plan in (None, in_coordinates))
    for name in ("dte", "bearing_force"):
        mean = float(np.abs(static[name]).mean())
        np.testing.assert_allclose(moving[name], static[name], atol=5e-3 * mean)


def test_rolling_bearings_on_yielding_seats_carry_what_statics_say():
    box = box_on(vibrating(), rolling())
    data = exugear.load_distribution(box, 100.0, mesh_stiffness=2e7)
    run = run_of(box, speed=10.0, duration=0.1, displacement=True).data.isel(time=slice(5000, None)).mean("time")
    for name in ("bearing_force", "bearing_displacement", "seat_displacement"):
        scale = np.abs(data[name].values).max()
        np.testing.assert_allclose(run[name], data[name], atol=0.01 * scale)


@pytest.mark.parametrize("sections", [False, True])
@pytest.mark.parametrize("bearing", [TILTING, rolling()])
def test_books_are_closed_on_a_vibrating_housing(bearing, sections):
    run = run_of(box_on(vibrating(), bearing, sections), power=True)
    balance = run.energy_balance()
    assert abs(balance.residual) < 1e-6 * abs(balance.work_in)
    assert float(run.data["coupling_loss"].sel(coupling="housing").max()) > 0


def test_the_plan_tells_how_many_modes_matter():
    plan = exugear.plan(box_on(vibrating()))
    assert 0 < plan.elastic_housing.modes < 24
    assert "static stiffness alone" in plan.housing
    soft = exugear.Bearing(radial=2e4, axial=2e4)
    assert exugear.plan(box_on(vibrating(), soft)).elastic_housing is None
    assert "UNDAMPED" in exugear.plan(box_on(vibrating(0.0))).housing


@pytest.mark.parametrize("bearing", [TILTING, rolling()])
def test_modes_of_the_choice_are_those_of_the_whole_housing(bearing):
    box = box_on(vibrating(), bearing)
    chosen = exugear.plan(box)
    most = exugear.plan(box, housing_modes=18)
    few, all_of_them = (exugear.modes(exugear.build(box, plan=x), load=100.0) for x in (chosen, most))
    np.testing.assert_allclose(few["frequency"][:12], all_of_them["frequency"][:12], rtol=3e-3)
    np.testing.assert_allclose(few["energy_share"].sum("element"), 1.0, atol=1e-6)
    assert float(few["energy_share"].sel(element="housing").max()) > 0.3


def test_the_surface_moves_in_the_run_as_under_the_forces_of_the_bearings():
    """Below the modes that the reduction leaves out; moments of the bearings take part."""
    reduced, box = walls_on_plate(), box_on(vibrating(), TILTING)
    plan = exugear.plan(box, housing_modes=18)
    data = run_of(box, plan, speed=55.0, duration=0.3, step=2e-5, sample=4e-5).data.isel(time=slice(2500, None))
    of_motion, of_forces = (
        exugear.radiated_power(x, reduced, SEATS, resolution=40.0, highest=2200.0)
        for x in (data, data.drop_vars("housing_rate"))
    )
    assert of_motion.attrs["total_level"] == pytest.approx(of_forces.attrs["total_level"], abs=0.05)
    without = exugear.radiated_power(
        data.drop_vars(["housing_rate", "bearing_moment"]), reduced, SEATS, resolution=40.0, highest=2200.0
    )
    assert "moments left out" in without.attrs["method"]
    loud = of_forces["power"] > 0.05 * of_forces["power"].max()
    right, wrong = (float(abs(x["level"] - of_motion["level"])[loud].max()) for x in (of_forces, without))
    assert right < 0.4
    assert wrong > 2 * right


def test_what_cannot_be_is_refused_in_words():
    light = box_on(stiff(3.0))
    with pytest.raises(ValueError, match="a housing without mass= has none"):
        exugear.plan(light, housing_modes=3)
    with pytest.raises(ValueError, match="housing_modes need a housing"):
        exugear.plan(box_on(None), housing_modes=1)
    with pytest.raises(ValueError, match="its housing is"):
        exugear.build(box_on(stiff(3.0)), plan=exugear.plan(box_on(stiff(3.0), rolling())))
    with pytest.raises(ValueError, match="damping_ratio is that of the modes"):
        exugear.Housing(SEATS, np.eye(24), damping_ratio=0.02)
    with pytest.raises(ValueError, match="must be of the shape"):
        exugear.Housing(SEATS, np.eye(24), mass=np.eye(12))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("housing", "bearing"), [(lambda: stiff(3.0), BALL), (vibrating, BALL), (vibrating, rolling())]
)
def test_steady_states_on_a_housing_are_those_of_settled_runs(housing, bearing):
    """Seats without coordinates of their own, and with them; rolling bearings are linear in the orbits alone."""
    model = exugear.build(box_on(housing(), bearing))
    states = exugear.steady_states(model, speed=(168.0, 172.0), load=100.0, bearing_forces=True, progress=False)
    nearest = states.isel(point=int(np.abs(states["speed"].values - 170.0).argmin()))
    run = exugear.run_up(model, speed=float(nearest["speed"]), load=100.0, duration=0.25, **OPTIONS)
    settled = run.data.sel(time=slice(0.2, None))
    dte, forces = settled["dte"].values, settled["bearing_force"].std("time").values
    assert float(nearest["rms"]) == pytest.approx(dte.std(), rel=3e-3)
    assert float(nearest["mean"]) == pytest.approx(dte.mean(), rel=2e-3)
    assert [*nearest["bearing"].values] == [*run.data["bearing"].values]
    within = 0.01 if bearing is BALL else 0.02
    np.testing.assert_allclose(nearest["bearing_force_rms"].values, forces, atol=within * forces.max())


def test_campbell_has_the_modes_of_an_independent_assembly_at_each_speed():
    """Rigid shafts with gyroscopic moments, bearings, a mesh of known stiffness and all 36 coordinates of the housing.

    Below 2 kHz, where 12 modes and the static shapes of the run are exact within the error that the plan tells.
    """
    stiffness, speeds, disc = 3e8, [0.0, 500.0, 2000.0], exugear.Disc(8.0, 0.05, 0.03)
    parts = {0.0: BALL, 40 * mm: paper_gear(), 100 * mm: BALL, 140 * mm: disc}
    shafts = [exugear.Shaft(name, parts) for name in ("fast", "slow")]
    line = [0.0, stiffness * mm]
    law, pair, housing = (
        exugear.MeshForce([0.0, 0.5], [0.0, 1 * mm], [line, line], damping=100.0),
        paper_pair(),
        vibrating(),
    )
    box = exugear.Gearbox([exugear.Stage(*shafts, law, pair=pair)], housing=housing)
    data = exugear.campbell(exugear.build(box, plan=exugear.plan(box, housing_modes=12)), speed=speeds, load=100.0)
    n = 12 + len(housing.stiffness)
    mass, k, gyroscopic, mesh = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
    mass[12:, 12:], k[12:, 12:] = housing.mass, housing.stiffness
    along = np.array([np.sin(pair.alpha_wt), np.cos(pair.alpha_wt)])
    for i, (shaft, sign) in enumerate(zip(shafts, (1, -1), strict=True)):
        tilts, first = (6 * i + 3, 6 * i + 4), 6 * i
        mass[range(first, first + 6), range(first, first + 6)] = (
            *[shaft.mass] * 3,
            *[shaft.transverse] * 2,
            shaft.inertia,
        )
        gyroscopic[tilts], gyroscopic[tilts[::-1]] = sign * shaft.inertia, -sign * shaft.inertia

        def moved(axial, first=first, centre=shaft.centre):
            rows = np.zeros((6, n))
            rows[:, first : first + 6] = np.eye(6)
            rows[0, first + 4], rows[1, first + 3] = axial - centre, centre - axial
            return rows

        for seat, axial in enumerate((0.0, 100 * mm)):
            rows, at = moved(axial), 12 + 6 * (2 * i + seat)
            rows[:, at : at + 6] -= np.eye(6)
            k += rows.T @ BALL.stiffness @ rows
        mesh += sign * along @ moved(40 * mm)[:2]
        mesh[first + 5] = pair.pinion.r_b
    k += stiffness * np.outer(mesh, mesh)
    free = np.setdiff1d(np.arange(n), [5])  # the drive holds the spin of the fast shaft
    mass, k, gyroscopic = (matrix[np.ix_(free, free)] for matrix in (mass, k, gyroscopic))
    over, zero = np.linalg.inv(mass), np.zeros_like(mass)
    for speed in speeds:
        system = np.block([[zero, np.eye(len(mass))], [-over @ k, -speed * over @ gyroscopic]])
        omega = np.linalg.eigvals(system).imag / (2 * np.pi)
        expected = np.sort(omega[(omega > 1.0) & (omega < 2000.0)])
        assert expected.size > 12
        frequency = np.sort(data["frequency"].sel(speed=speed).values)
        np.testing.assert_allclose(frequency[: expected.size], expected, rtol=2e-4)
    assert np.ptp(data["frequency"].values[2]) > 10.0
