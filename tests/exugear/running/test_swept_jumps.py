"""Jumps of swept runs beside the folds of steady states, and what a run says where its step moves one."""

from math import pi

import numpy as np
import pytest
from scenes import paper_gear, smooth_box

import exugear
from fem.units import mm, um

#: rad/s of the pinion per Hz of the mesh; damping [N s/m] at which teeth rattle down to a fold; load [N m].
HZ, DAMPING, LOAD = 2 * pi / paper_gear().z, 3200.0, 100.0
STIFF = exugear.Bearing(radial=5e9, axial=1e8, damping_time=2e-5)


def fold_of(model: exugear.Model, load: float, end: float, start: float = 2500.0) -> float:
    """Lowest fold [Hz] of the branch on which teeth rattle, between mesh frequencies [Hz]."""
    states = exugear.steady_states(model, speed=(end * HZ, start * HZ), load=load)
    return float(states["mesh_frequency"][states["bifurcation"].values == "fold"].min())


def swept_down(
    model: exugear.Model, load: float = LOAD, end: float = 840.0, rate: float = 400.0, start: float = 2500.0, **options
):
    """A run from a mesh frequency [Hz] down, at a rate [Hz/s]."""
    conditions = {"speed": (start * HZ, end * HZ), "duration": (start - end) / rate, "load": load, "progress": False}
    return exugear.run_up(model, **conditions | options)


def jump_of(run: exugear.Run) -> float:
    """Lowest mesh frequency [Hz] at which the vibration is above a third of its largest rms."""
    outline = exugear.dte_envelope(run, windows=300)
    return float(np.min(outline.abscissa[outline.rms > outline.rms.max() / 3]))


@pytest.fixture(scope="module")
def rattling() -> exugear.Model:
    return exugear.build(smooth_box(damping=DAMPING))


def test_a_run_down_rattles_to_the_fold_at_the_default_step(rattling):
    """Without a correction where contact begins and ends it falls at 1100 Hz, a fifth too early."""
    run = swept_down(rattling)
    assert jump_of(run) == pytest.approx(fold_of(rattling, LOAD, 840.0), rel=0.015)
    assert "uncertain_jumps" not in run.data.attrs


def test_a_run_says_by_how_much_its_step_moves_a_jump(rattling):
    moved = "jump of the vibration of fast-slow at .* Hz of the mesh is uncertain: at half"
    with pytest.warns(UserWarning, match=moved) as caught:
        run = swept_down(rattling, step=exugear.Rule(1 / 4, 2.9e-5))
    assert caught[0].filename == __file__
    assert jump_of(run) > 940.0
    assert float(run.data["step_error"].max()) > 0.1
    assert "at least" in run.data.attrs["uncertain_jumps"]


def test_books_stay_closed_while_teeth_rattle(rattling):
    """Pulses are part of the torques and of the loss; the recorded force is that of the law, 0 without contact."""
    run = swept_down(rattling, end=1500.0, checks=0, power=True)
    assert run.energy_balance().relative < 1e-6
    assert 0.2 < float((run.data["mesh_force"] == 0).mean()) < 0.6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("load", "damping", "bearing"),
    [(50.0, 3200.0, None), (100.0, 3000.0, None), (200.0, 3600.0, None), (100.0, 3200.0, STIFF)],
)
def test_jumps_lie_within_a_per_cent_of_the_folds(load, damping, bearing):
    parts = {0 * mm: bearing, 60 * mm: bearing} if bearing else {}
    model = exugear.build(smooth_box(parts=parts, damping=damping))
    fold = fold_of(model, load, 700.0, 2100.0)
    assert jump_of(swept_down(model, load, 0.97 * fold, 100.0, 2100.0)) == pytest.approx(fold, rel=0.01)


def test_the_ramp_of_the_damping_moves_the_fold():
    """The longer it is, the less damping rattling teeth meet, and the lower the fold."""
    folds = [fold_of(exugear.build(smooth_box(damping=DAMPING, damping_ramp=x * um)), LOAD, 700.0) for x in (0.5, 2)]
    assert folds[1] < 0.99 * folds[0]


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"step": 1e-9}, UserWarning, r"2e\+09 steps of 1e-09 s: about 8e\+03 s.*Take a larger step"),
        ({"duration": 9e4, "sample": 1e-9, "step": 1e-8}, ValueError, "exceed the memory .*take a larger sample="),
    ],
)
def test_a_run_without_end_says_so_before_it_begins(rattling, changes, error, message):
    with pytest.raises(error, match=message):
        exugear.run_up(rattling, **{"speed": 100.0, "duration": 2.0, "load": LOAD, "progress": False} | changes)


def test_a_ramp_is_printed_and_refused_where_it_is_none(rattling):
    assert "damping 3200 N s/m" in str(rattling.plan)
    assert "assumed to ramp in over 1 um of penetration" in str(rattling.plan)
    with pytest.raises(ValueError, match=r"damping_ramp must lie in \(0, 0.0001\] m, got 1.0; pass metres"):
        smooth_box(damping=DAMPING, damping_ramp=1.0)
