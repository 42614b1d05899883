"""Messages state the true reason of a refusal: the bound that is exceeded, the value that is no number, the folder."""

from functools import cache

import numpy as np
import pytest
from paper_gears import paper_pair
from scenes import smooth_box, smooth_map

import exugear
import fem
from fem.units import mm

NAN = float("nan")


@cache
def model(parts: bool = False) -> exugear.Model:
    soft = {0.0: exugear.Bearing(2e4, 1e4), 60 * mm: exugear.Bearing(2e4)}
    return exugear.build(smooth_box(parts=soft if parts else None))


def run_up(**changes):
    given = {"speed": 100.0, "duration": 1e-3, "load": 150.0, "progress": False} | changes
    return exugear.run_up(model(), **given)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: exugear.Drag(1e9), r"constant must lie in \[0, 1e\+06\) N m, a drag brakes, got 1000000000"),
        (lambda: exugear.Drag(1.0, speed=1e9), r"speed .*below 100000, got 1000000000"),
        (lambda: run_up(checks=-1), r"checks must be at least 0 .*got -1"),
        (lambda: fem.static_transmission_error(paper_pair(), [0, NAN]), r"torque must be finite, got nan at \[1\]"),
        (lambda: fem.static_transmission_error(paper_pair(), NAN), r"torque must be finite, got nan"),
        (lambda: fem.static_transmission_error(paper_pair(), [0, 9], [0, NAN]), r"phases must be finite, got nan at"),
        (lambda: fem.Offsets(axial=(0, NAN)), r"axial must be finite, got nan at \[1\]"),
        (lambda: fem.Offsets(a=NAN), r"a must be finite, got nan"),
        (lambda: exugear.MotorCurve([0, NAN, 2], [1, 1, 1]), r"speed must be finite, got nan at \[1\]"),
        (lambda: exugear.dte_envelope(run_up(), windows=-1), r"windows must be at least 1, got -1"),
        (lambda: exugear.dte_envelope(run_up().data.isel(time=[0])), r"run must hold at least 2 samples, got 1"),
        (lambda: exugear.envelope(np.arange(9.0), np.ones(9)), r"9 samples, too few for 280 .* windows=4 or fewer"),
        (lambda: exugear.modes(model(), load=1e-9), "no teeth are pressed.*take a larger load"),
    ],
)
def test_the_reason_of_a_refusal(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_too_little_load_asks_for_more():
    with pytest.raises(ValueError, match=r"no teeth are pressed .* take a larger load"):
        exugear.modes(model(parts=True), load=1e-9)


def test_folders_and_missing_files_are_named(tmp_path):
    writers = [
        lambda: fem.save(smooth_map(), tmp_path),
        lambda: run_up().save(tmp_path),
        lambda: fem.save(smooth_map(), ""),
        lambda: exugear.write_sound(tmp_path, exugear.signal(run_up(), "dte")),
    ]
    for write in writers:
        with pytest.raises(IsADirectoryError, match="is a folder; give the name of a file in it"):
            write()
    for read, remedy in ((fem.load, "make the map again"), (exugear.Run.load, "run it again")):
        with pytest.raises(ValueError, match="is a folder; give the name of a file in it"):
            read(tmp_path)
        with pytest.raises(FileNotFoundError, match=rf"none.nc does not exist; {remedy}"):
            read(tmp_path / "none.nc")
