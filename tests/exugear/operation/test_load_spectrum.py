"""Duty cycles and motor curves from tables: units are converted, what is wrong is refused with its line."""

import numpy as np
import pytest
import xarray as xr
from planetary_boxes import planetary
from scenes import smooth_box, two_stages

import exugear
from exugear import LoadCase, LoadSpectrum, MotorCurve
from fem.units import rpm

CYCLE = "# a day\nspeed [rpm], load [N m], share [%]\n1000, 200, 25\n3000; 50, 75\n"


def table(folder, text: str):
    (folder / "table.csv").write_text(text)
    return folder / "table.csv"


def test_a_duty_cycle_by_shares(tmp_path):
    spectrum = LoadSpectrum.from_table(table(tmp_path, CYCLE))
    assert [case.speed / rpm for case in spectrum] == pytest.approx([1000, 3000])
    assert [case.load for case in spectrum] == [200, 50]
    assert spectrum.shares == pytest.approx([0.25, 0.75]) and spectrum.time is None
    assert spectrum.table["share"].attrs["units"] == "1" and len(spectrum) == 2
    assert "time" not in spectrum.table and "25 % of the time" in str(spectrum)


def test_a_duty_cycle_by_hours_and_torques_on_the_driving_shaft(tmp_path):
    """Torque becomes load by the ratio."""
    path = table(tmp_path, "torque [kNm] speed [rad/s] time [h]\n0.2 100 30\n0.1 300 10\n")
    box = smooth_box()
    spectrum = LoadSpectrum.from_table(path, box)
    ratio = abs(box.ratios[box.driven.name])
    assert [case.load for case in spectrum] == pytest.approx([200 / ratio, 100 / ratio])
    assert spectrum.shares == pytest.approx([0.75, 0.25]) and spectrum.time == pytest.approx(40 * 3600)
    assert spectrum.table["time"].values == pytest.approx([30 * 3600, 10 * 3600])


def test_the_load_of_a_set_of_two_free_speeds_is_that_of_the_torque_on_the_driving_shaft(tmp_path):
    """400 N m on the carrier ask for 100 N m of the sun, at any speeds: no more than with a ring that stands."""
    path = table(tmp_path, "speed [rad/s], torque [N m], time [h]\n20, 100, 30\n")
    for free in ({"sun": 1.0, "ring": -0.2}, {"ring": 1.0, "sun": 0.5}):
        box = exugear.Gearbox([planetary()], speeds=free)
        (case,) = LoadSpectrum.from_table(path, box)
        assert case.load == pytest.approx(400.0 if box.driving.name == "sun" else 400.0 / 3)
        run = exugear.run_up(exugear.build(box), speed=20.0, load=case.load, duration=2e-3, progress=False, checks=0)
        assert float(run.data["drive_torque"].sel(drive_end=box.driving.name).mean()) == pytest.approx(100.0, rel=1e-3)
    with pytest.raises(ValueError, match="driving shaft 'carrier' follows the imposed speeds"):
        LoadSpectrum.from_table(path, exugear.Gearbox([planetary()], speeds=free, driving="carrier", driven="sun"))


def test_a_motor_curve_drives_a_shaft(tmp_path):
    """Lines in any order; the torque of the run is that of the curve at its speed."""
    curve = MotorCurve.from_table(table(tmp_path, "speed [rpm], torque [N m]\n3000, 40\n0, 100\n1500, 80\n"))
    assert curve.speed / rpm == pytest.approx([0, 1500, 3000]) and curve.torque.tolist() == [100, 80, 40]
    model = exugear.build(smooth_box())
    run = exugear.run(
        model,
        drives={model.gearbox.driving.name: curve},
        loads={model.gearbox.driven.name: 20.0},
        duration=0.01,
        start_speed=1500 * rpm,
        progress=False,
        checks=0,
    )
    assert float(run.data["drive_torque"][0, 0]) == pytest.approx(80, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("speed load share\n1 2 3\n", "comes before a header with units"),
        ("speed [rpm], load [N m], share\n1,2,3\n", "gives 'share' no unit"),
        ("speed [km/h], load [N m], share [%]\n1,2,3\n", r"line 1 of .* gives speed in \[km/h\], which must be one of"),
        ("speed [rpm], load [N m], share [%]\n1,nan,100\n", r"line 2 of .* holds nan for load"),
        ("speed [rpm], load [N m], share [%]\n1,high,100\n", r"line 2 of .* holds 'high' for load"),
        ("speed [rpm], load [N m], share [%]\n1,2,50\nspeed [rpm], load [N m], share [%]\n", "line 3 .* second header"),
        ("load [N m], share [%]\n1,2\n", r"line 1 of .* lacks the columns \['speed'\]"),
        ("speed [rpm], share [%]\n1,100\n", "must hold one of the columns load"),
        ("speed [rpm], load [N m], torque [N m], share [%]\n1,2,3,100\n", "must hold one of the columns load"),
        ("speed [rpm], load [N m]\n1,2\n", "must hold one of the columns share"),
        ("speed [rpm], torque [N m], share [%]\n1,2,100\n", "pass gearbox="),
        ("speed [rpm], load [N m], share [%]\n1,2,40\n", "sum to 40 %"),
        ("speed [rpm], load [N m], time [h]\n1,2,-4\n", "times are >= 0"),
        ("speed [rpm], load [N m], time [h]\n1,2\n", r"line 2 of .* holds 2 values for 3 columns"),
    ],
)
def test_wrong_duty_cycles_are_refused_with_the_line(text, words, tmp_path):
    with pytest.raises(ValueError, match=words):
        LoadSpectrum.from_table(table(tmp_path, text))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("speed [rpm], torque [N]\n1,2\n", r"line 1 of .* gives torque in \[N\]"),
        ("speed [rpm], torque [N m]\n1,2\n1,3\n", "lines 2 and 3 of .* give the same point"),
        ("speed [rpm]\n1\n", r"lacks the columns \['torque'\]"),
        ("speed [rpm], torque [N m]\n1,2\nspeed [rad/s], torque [N m]\n", "line 3 of .* second header"),
        ("speed [rpm], torque [N m]\n1,inf\n2,3\n", r"line 2 of .* must be finite"),
    ],
)
def test_wrong_motor_curves_are_refused_with_the_line(text, words, tmp_path):
    with pytest.raises(ValueError, match=words):
        MotorCurve.from_table(table(tmp_path, text))


def test_impossible_load_cases_are_refused():
    with pytest.raises(ValueError, match="must be finite"):
        LoadCase("idle", np.nan, 1.0)
    with pytest.raises(ValueError, match="share of 'idle'"):
        LoadCase("idle", 1.0, 1.0, -0.5)
    with pytest.raises(ValueError, match="list of LoadCase"):
        LoadSpectrum([])
    with pytest.raises(ValueError, match="must not all be 0"):
        LoadSpectrum([LoadCase("idle", 1.0, 1.0, 0.0)])


def drive_and_coast(**options) -> LoadSpectrum:
    return LoadSpectrum([LoadCase("drive", 100.0, 200.0, 3.0), LoadCase("coast", 50.0, -80.0)], **options)


def test_a_spectrum_on_the_pinion_of_a_stage_follows_the_ratios_and_keeps_flanks_apart():
    box, spectrum = two_stages(), drive_and_coast(time=4 * 3600.0)
    for stage in (1, box.labels[1]):
        left = spectrum.on_pinion(box, stage)
        wheel, pinion = box.stages[1].pair.wheel, box.stages[1].pair.pinion
        assert left["torque"] == pytest.approx([200 * pinion.z / abs(wheel.z), 0])
        middle = abs(box.ratios["middle"])
        assert np.abs(left["speed"]) == pytest.approx([100 * middle, 50 * middle])
        assert left["hours"] == pytest.approx([3, 1])
    right = spectrum.on_pinion(box, 1, hours=400.0, flank="right")
    assert right["torque"] == pytest.approx([0, 80 * pinion.z / abs(wheel.z)]) and right["hours"].sum() == 400


def test_a_planet_turns_against_its_carrier():
    """Mesh of sun and planet: the sun against the carrier; three planets share its torque."""
    box = exugear.Gearbox([planetary()], held=["ring"])
    assert box.driving.name == "sun" and box.driven.name == "carrier"
    case = LoadSpectrum([LoadCase("rated", 100.0, 400.0)], 3600.0)
    ratio = 30 / (30 + 90)
    on_sun = case.on_pinion(box, 0)
    assert abs(on_sun["speed"][0]) == pytest.approx(100 * (1 - ratio))
    assert on_sun["torque"][0] == pytest.approx(400 * ratio / 3)


def powers(speeds, loads, ratio: float = 0.5, share: float = 0.02) -> xr.Dataset:
    """Losses of a share of the power that enters; a load < 0 drives."""
    grid = np.multiply.outer(np.array(speeds), ratio * np.array(loads))
    entering = np.where(grid > 0, grid / (1 - share), grid * (1 - share))
    over = ("speed", "load")
    return xr.Dataset({"power_in": (over, entering), "power_out": (over, grid)}, {"speed": speeds, "load": loads})


def test_efficiency_over_a_cycle_weights_each_case_by_its_energy():
    data = powers([20.0, 80.0, 120.0], [-100.0, -50.0, 50.0, 300.0])
    whole = drive_and_coast().efficiency(data)
    assert float(whole["efficiency"]) == pytest.approx(0.98, rel=1e-12)
    assert whole["power_out"].values == pytest.approx([0.5 * 100 * 200, -0.5 * 50 * 80])
    # One case with half the loss: shares of the energy that enters, 1 : 0.2, not of the time.
    cases = LoadSpectrum(
        [LoadCase("a", 80.0, 50.0, 0.1), LoadCase("b", 20.0, 50.0, 0.8), LoadCase("rest", 0.0, 0.0, 0.1)]
    )
    better = data["power_out"].sel(speed=20.0, load=50.0) / 0.99
    data["power_in"].loc[{"speed": 20.0, "load": 50.0}] = better
    out = np.array([0.1 * 80, 0.8 * 20])
    assert float(cases.efficiency(data)["efficiency"]) == pytest.approx(
        out.sum() / (out / [0.98, 0.99]).sum(), rel=1e-12
    )


def test_what_a_spectrum_lacks_is_refused():
    spectrum, box = drive_and_coast(), smooth_box()
    for words, options in {
        "hours of the duty cycle must be given": {},
        "stage must be 0 to 0": {"hours": 1.0, "stage": 1},
        "flank must be 'left' or 'right'": {"hours": 1.0, "flank": "up"},
        "hours must be > 0": {"hours": -1.0},
    }.items():
        with pytest.raises(ValueError, match=words):
            spectrum.on_pinion(box, **options)
    speeds, loads = [20.0, 120.0], [-100.0, -50.0, 50.0, 300.0]
    holed = powers(speeds, loads)
    holed["power_in"][1, 3] = np.nan
    for words, data in {
        "its speed lies beyond 60 to 120": powers([60.0, 120.0], loads),
        "its load lies beyond -100 to 150": powers(speeds, [-100.0, -50.0, 150.0]),
        "no load between -50 and 300|no load between -100 and 50": powers(speeds, [-100.0, 50.0, 300.0]),
        "data were not solved beside drive": holed,
        "pass what exugear.efficiency returns": holed.drop_vars("power_out"),
    }.items():
        with pytest.raises(ValueError, match=words):
            spectrum.efficiency(data)
    with pytest.raises(ValueError, match="all stand still"):
        LoadSpectrum([LoadCase("rest", 0.0, 0.0)]).efficiency(holed)
