"""Eigenfrequencies under load: closed forms, published modes on bearings, and Exudyn's own call."""

from math import pi

import exudyn as exu
import numpy as np
import pytest
from paper_gears import paper_gear, paper_pair
from scenes import INERTIA, K, linear_law, smooth_box

import exugear
from fem.units import rpm

R_B = paper_pair().pinion.r_b
#: Both gears free to spin and to move along the line of action on a spring (validation, section 2) [N/m, Hz].
MODES = {1e9: (2078.72, 2851.86, 4765.41), 2e8: (1002.75, 1275.39, 4417.94)}


def linear(*parts: object, ratio: float = 1.0, fast: tuple = ()) -> exugear.Model:
    """The paper's pair on a mesh of constant stiffness; ratio: inertia of the slow over that of the fast shaft."""
    inertia = {"fast": INERTIA, "slow": ratio * INERTIA}
    on = {"fast": [paper_gear(), *parts, *fast], "slow": [paper_gear(), *parts]}
    shafts = [exugear.Shaft(name, {0.0: on[name]}, inertia=inertia[name], mass=3.1145) for name in on]
    return exugear.build(exugear.Gearbox([exugear.Stage(*shafts, linear_law(), pair=paper_pair())]))


@pytest.mark.parametrize("load", [150.0, 3.0, 2000.0])
def test_slow_shaft_vibrates_on_the_mesh_while_the_drive_is_fixed(load):
    frequencies = exugear.eigenfrequencies(linear(ratio=3.0), load=load)
    assert frequencies == pytest.approx([np.sqrt(K * R_B**2 / (3 * INERTIA)) / (2 * pi)], rel=1e-6)


@pytest.mark.filterwarnings("ignore:torsion 10 N m/rad")
def test_two_shafts_free_to_spin_vibrate_against_each_other():
    """The drive acts through a very soft coupling."""
    model = linear(ratio=3.0, fast=(exugear.Coupling(10.0, inertia=1.0),))
    high = np.sqrt(K * (R_B**2 / INERTIA + R_B**2 / (3 * INERTIA))) / (2 * pi)
    low = np.sqrt(10.0 / (4 * INERTIA)) / (2 * pi)
    assert exugear.eigenfrequencies(model, load=5.0) == pytest.approx([low, high], rel=1e-5)


@pytest.mark.filterwarnings("ignore:torsion 1 N m/rad")
@pytest.mark.parametrize("k", MODES)
def test_modes_on_bearings_are_the_known_ones(k):
    """Across the line of action both shafts move alone."""
    model = linear(exugear.Bearing(k, 1e9, 1e6), fast=(exugear.Coupling(1.0, inertia=1.0),))
    low, middle, high = MODES[k]
    frequencies = exugear.eigenfrequencies(model, load=1.0)
    assert frequencies[1:] == pytest.approx([low, middle, middle, middle, high], rel=1e-4)


def test_teeth_that_just_touch_count_as_pressed():
    """Straight after build Exudyn's call finds the resonance of a law of constant stiffness."""
    model = linear()
    loaded = exugear.eigenfrequencies(model, load=150.0)[0]
    touching = model.mbs.ComputeODE2Eigenvalues(convert2Frequencies=True)[0][0]
    assert touching == pytest.approx(loaded, rel=1e-3)


def test_joints_and_reduced_shafts_agree():
    box = smooth_box()
    joints = exugear.build(box, plan=exugear.plan(box).with_joints())
    reduced = exugear.eigenfrequencies(exugear.build(box), load=150.0)
    assert exugear.eigenfrequencies(joints, load=150.0) == pytest.approx(reduced, rel=1e-6)


def test_eigenfrequencies_leave_the_state_of_the_system_unchanged():
    model = exugear.build(smooth_box(exugear.Bearing(5e8, 3e8, 2e5, 1e-6)))
    exugear.run_up(model, speed=1000 * rpm, load=50.0, duration=1e-3, progress=False)
    system, initial = model.mbs.systemData, exu.ConfigurationType.Initial
    state = lambda: np.r_[system.GetODE2Coordinates(initial), system.GetODE2Coordinates_t(initial)]  # noqa: E731
    turned = lambda: model.mbs.GetObjectParameter(model.drive, "offsetUserFunction_t")  # noqa: E731
    before, drive = state(), turned()
    exugear.eigenfrequencies(model, load=150.0)
    assert (state() == before).all() and turned() == drive
    assert model.mbs.GetLoad(model.load)["load"] == 50.0


@pytest.mark.parametrize(
    ("model", "load", "message"),
    [
        (lambda: linear(), 0.0, "load must be finite and not 0"),
        (lambda: linear(), np.nan, "load must be finite and not 0"),
        (lambda: linear(), 1e6, "extend the map"),
        (lambda: smooth_box(), 150.0, "model must be an exugear.Model"),
    ],
)
def test_what_has_no_eigenfrequencies_is_refused(model, load, message):
    with pytest.raises(ValueError, match=message):
        exugear.eigenfrequencies(model(), load=load)
