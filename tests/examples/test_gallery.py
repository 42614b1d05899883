"""The short examples: each shows the physics that its docstring states."""

import class_6_gears
import coast_down
import e_axle_shaft
import ev_reducer
import growing_crack
import hand_built_contact
import helical_and_spur
import measured_table
import numpy as np
import planet_phasing
import pytest
import rexs_gearbox
import ring_that_bends
import run_report
import shuttling
import side_bands
import steady_states
import tip_relief
import wind_turbine

import exugear
from fem.units import um


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the jump of the vibration")  # the quick sweep passes the fold in 0.1 s
def test_optimal_tip_relief_quietens_its_loads_and_the_run_up(tmp_path):
    numbers = tip_relief.main(tmp_path, quick=True)
    plain, single, several = numbers.values()
    assert single["350 N m"] < plain["350 N m"] / 8
    assert single["350 N m"] < several["350 N m"] < plain["350 N m"] / 2.5
    largest = [max(design[f"{load:g} N m"] for load in tip_relief.RANGE) for design in numbers.values()]
    assert largest[2] < min(largest[:2])
    assert single["DTE"] < plain["DTE"] / 4
    assert several["DTE"] < plain["DTE"]
    assert (tmp_path / "tip_relief_drawing.png").exists()


@pytest.mark.slow
def test_gears_of_class_6_scatter_about_the_nominal_pair(tmp_path):
    gears, correlation, shares = class_6_gears.main(tmp_path, quick=True)
    swing = gears["peak_to_peak"].sel(torque=350.0)
    nominal = float(class_6_gears.measures()["peak_to_peak"].sel(torque=350.0))
    assert nominal < float(swing.median())
    assert gears.sizes["case"] == 20
    assert (np.abs(correlation["peak_to_peak"]) <= 1).all()
    assert set(shares["parameter"].values) == set(class_6_gears.TOLERANCES)


@pytest.mark.slow
def test_an_overlap_ratio_of_one_takes_the_variation_out_of_the_ste(tmp_path):
    (spur, dte), (half, _), (whole, quiet) = helical_and_spur.main(tmp_path, quick=True).values()
    assert whole < 0.1 * spur
    assert whole < half < 0.5 * spur
    assert quiet < 0.1 * dte


@pytest.mark.slow
def test_a_measured_table_resonates_where_its_stiffness_and_the_inertia_say(tmp_path):
    expected, run = measured_table.main(tmp_path, quick=True)
    outline = exugear.dte_envelope(run)
    assert outline.abscissa[np.argmax(outline.amplitude)] == pytest.approx(expected, rel=0.02)
    table = measured_table.pd.read_csv(tmp_path / "synthetic_measurement.csv")
    law = measured_table.law_of(table)
    points = table.sample(20, random_state=1).to_numpy()
    assert law(points[:, 0], points[:, 2] * um) == pytest.approx(points[:, 1], rel=1e-3, abs=1.0)


@pytest.mark.slow
def test_torques_mesh_and_bearings_balance_in_a_model_built_by_hand(tmp_path):
    values = hand_built_contact.main(tmp_path, quick=True)
    errors = {name: value / expected - 1 for name, (value, expected) in values.items()}
    assert errors.pop("DTE [µm]") == pytest.approx(0, abs=5e-3)
    assert list(errors.values()) == pytest.approx([0, 0], abs=1e-3)


@pytest.mark.slow
def test_a_coast_down_follows_the_closed_form_and_its_energy_balances(tmp_path):
    box, run = coast_down.main(tmp_path, quick=True)
    motor = run.data["shaft_speed"].sel(shaft="motor").values
    assert motor == pytest.approx(coast_down.rigid_speed(box, run.data["time"].values), rel=1e-3)
    balance = run.energy_balance()
    assert abs(balance.residual) < 1e-4 * abs(balance.stored)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:orders 23, 46 are NaN")  # of the quick run-up, below 1107 rpm
def test_bearing_forces_of_the_reducer_peak_where_a_mesh_order_crosses_a_mode(tmp_path):
    table, peaks = ev_reducer.main(tmp_path, quick=True)
    assert peaks.size >= 2
    for peak in peaks:
        assert np.abs(table["rpm"] / peak - 1).min() < 0.05


@pytest.mark.slow
def test_report_states_the_balance_of_a_run_with_all_its_stages_and_bearings(tmp_path):
    run, files = run_report.main(tmp_path, quick=True)
    balance, page = run.energy_balance(), files[0].read_text(encoding="utf-8")
    assert balance.relative < 1e-4
    assert page.count("data:image") >= 5
    for name in (*run.data["stage"].values, *run.data["bearing"].values):
        assert str(name) in page


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:orders")  # of the quick run-up, at low speed
def test_a_gearbox_from_a_file_is_drawn_run_and_reported(tmp_path):
    model, run, files = rexs_gearbox.main(tmp_path, quick=True)
    assert 1 / model.gearbox.ratios["output"] == pytest.approx(-61 / 23 * 58 / 21 * 53 / 19)
    assert model.gearbox.shafts[0].forces[0][1].y == -250
    forces = np.abs(run.data["bearing_force"]).max("time")
    assert forces.sizes["bearing"] == 8 and float(forces.max()) > 1000
    page = files[0].read_text(encoding="utf-8")
    assert all(str(name) in page for name in run.data["bearing"].values)
    assert (tmp_path / "rexs_gearbox.png").exists()


@pytest.mark.slow
def test_a_thicker_shaft_evens_the_load_over_faces_and_rollers(tmp_path):
    table = e_axle_shaft.main(tmp_path, quick=True)
    thin, thick = (table.iloc[i] for i in (0, -1))
    assert thick["rollers [h]"] > 1.02 * thin["rollers [h]"]
    factors = [name for name in table if name.startswith("K_Hbeta")]
    assert len(factors) == 2 and (thick[factors] > 1).all() and (thick[factors] < 0.7 * thin[factors]).all()
    assert abs(thick["noise [dB]"] - thin["noise [dB]"]) > 0.1


@pytest.mark.slow
def test_shuttling_moves_the_load_between_the_bearings_at_a_constant_mesh_force(tmp_path):
    for tilt, run in shuttling.main(tmp_path, quick=True).items():
        settled = run.data.isel(time=slice(run.data["time"].size // 2, None))
        force, centroid = settled["mesh_force"].values[0], settled["centroid"].values[0]
        assert np.ptp(force) < 1e-4 * force.mean()
        assert np.ptp(centroid) > 2e-3
        bearings, by_centroid = shuttling.bearing_forces(settled)
        assert bearings == pytest.approx(by_centroid, abs=0.03 * np.ptp(by_centroid))
        assert (centroid.mean() < -4e-3) == (tilt > 0)


@pytest.mark.slow
def test_run_up_and_coast_down_leave_their_branches_at_the_folds(tmp_path):
    states, sweeps = steady_states.main(tmp_path, quick=True)
    lower, upper = steady_states.folds(states)["mesh frequency [Hz]"]
    assert steady_states.jump(sweeps["run-up"]) == pytest.approx(upper, rel=0.02)
    assert steady_states.jump(sweeps["coast-down"]) == pytest.approx(lower, rel=0.04)
    assert states["stable"].values[states["mesh_frequency"].values < 0.9 * lower].all()


@pytest.mark.slow
def test_what_planets_in_sequence_take_from_the_torque_the_orbit_of_the_sun_gains(tmp_path):
    """The published sums by a linear rule: within 5 % of a run on maps of helical gears."""
    numbers = planet_phasing.main(tmp_path, quick=True)
    assert numbers["rule"] == pytest.approx([0.0585, 0.1273, 0.9674, 0.2060], abs=1e-4)
    assert numbers["torque"] == pytest.approx(numbers["rule"], rel=0.05)
    assert numbers["in phase"].max() < 1e-6 * numbers["in sequence"].min()
    assert numbers["in sequence"].min() > 5 * um


@pytest.mark.slow
def test_a_displaced_pin_fills_the_orders_between_those_that_equal_planets_excite(tmp_path):
    equal, unequal = wind_turbine.main(tmp_path, quick=True).values()
    passes = equal["order"].values % 3 == 0
    assert equal["level"].values[~passes].max() < -60
    assert equal["level"].sel(order=93) == 0 and equal["level"].sel(order=[90, 96]).values == pytest.approx(-6, abs=0.1)
    assert unequal["mean_amplitude"].values[~passes].min() > 1000 * equal["mean_amplitude"].values[~passes].max()
    assert unequal["cause"].sel(order=92).item().startswith("once per turn of carrier or ring")


@pytest.mark.slow
def test_a_ring_on_bolts_hears_three_planets_at_every_third_order(tmp_path):
    lines = ring_that_bends.main(tmp_path, quick=True)
    passes, others = ([x for order, x in lines.items() if (order % 3 == 0) is wanted] for wanted in (True, False))
    assert max(others) < 0.05 * max(passes)
    assert min(lines[96], lines[102]) > lines[99]


@pytest.mark.slow
def test_side_bands_and_ghost_of_a_real_pinion_are_those_of_its_transmission_error(tmp_path):
    orders = side_bands.main(tmp_path, quick=True)
    alike, real = (np.array(orders[name]) for name in ("teeth alike", "real pinion"))
    numbers = list(side_bands.ORDERS)
    assert real[1, numbers] == pytest.approx(real[0, numbers], rel=0.03, abs=0.01 * um)
    assert real[1, 1] == pytest.approx(side_bands.RUN_OUT, rel=0.1)
    assert real[1, side_bands.GHOST] == pytest.approx(side_bands.WAVE, rel=0.15)
    assert (alike[1, [1, 22, 24, side_bands.GHOST]] < 0.01 * um).all()


@pytest.mark.slow
def test_a_crack_of_a_tenth_of_the_stiffness_is_told_through_noise_of_20_db(tmp_path):
    """The change of the average since the sound gear: noise has a kurtosis of 3, the cracked tooth stands out."""
    seen = growing_crack.main(tmp_path, quick=True)
    change = {lost: x[growing_crack.CHANGE].dropna("average").values for lost, x in seen.items()}
    assert (change[0.0] < 4.5).all()
    assert (change[0.1] > 9).all()
    assert (change[0.3] > change[0.1]).all()
    assert (seen[0.3]["NA4"].values.min() > 1.3 * seen[0.0]["NA4"].values).all()
