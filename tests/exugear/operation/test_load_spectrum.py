"""Duty cycles and motor curves from tables: units are converted, what is wrong is refused with its line."""

import numpy as np
import pytest
from scenes import smooth_box

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
