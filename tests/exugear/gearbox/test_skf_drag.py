"""SKF's model of the drag of ball bearings: the catalogue's formula in its units, limits, runs."""

import numpy as np
import pytest
from bearing_boxes import box_of
from rolling_bearings import deep_groove

import exugear
from exugear import SkfDrag
from fem.units import mm, rpm, um

BALL = {"d": 25 * mm, "D": 62 * mm, "viscosity": 20e-6}


def catalogue(n: float, radial: float, axial: float, C_0: float = 11.6e3) -> float:
    """Torque of a 6305 [N mm] by n [1/min] as the catalogue has it, term by term."""
    d_m, nu, r_1, r_2, s_1, s_2, k_z, k_rs = 43.5, 20.0, 3.7e-7, 1.7, 2.84e-3, 92.8, 3.1, 3e-8
    if axial:
        sine = np.sin(np.radians(24.6 * (axial / C_0) ** 0.24))
        rolling = r_1 * d_m**1.96 * (radial + r_2 / sine * axial) ** 0.54
        sliding = s_1 * d_m**-0.145 * (radial**5 + s_2 * d_m**1.5 / sine * axial**4) ** (1 / 3)
    else:
        rolling, sliding = r_1 * d_m**1.96 * radial**0.54, s_1 * d_m**-0.26 * radial ** (5 / 3)
    heating = 1 / (1 + 1.84e-9 * (n * d_m) ** 1.28 * nu**0.64)
    starving = np.exp(-k_rs * nu * n * (25 + 62) * np.sqrt(k_z / (2 * (62 - 25))))
    film = np.exp(-2.6e-8 * (n * nu) ** 1.4 * d_m)
    return heating * starving * rolling * (nu * n) ** 0.6 + (film * 0.12 + (1 - film) * 0.05) * sliding


@pytest.mark.parametrize(("radial", "axial"), [(1000.0, 0.0), (1000.0, 500.0), (0.0, 800.0)])
def test_the_torque_is_that_of_the_catalogue(radial, axial):
    drag = SkfDrag("63", **BALL, load=(radial, axial), C_0=11.6e3)
    for n in (10.0, 300.0, 3000.0, 12000.0):
        omega = n * rpm
        assert float(drag.torque(omega)) / mm == pytest.approx(np.tanh(omega) * catalogue(n, radial, axial), rel=1e-9)
    assert float(drag.torque(-300.0)) == -float(drag.torque(300.0))


def test_the_load_of_the_run_counts_as_a_given_one():
    follows, given = SkfDrag("63", **BALL), SkfDrag("63", **BALL, load=(1000.0, 0.0))
    omega = np.array([5.0, 100.0, 500.0])
    assert follows.needs_load
    assert follows.torque(omega, 1000.0) == pytest.approx(given.torque(omega), rel=1e-12)
    assert float(follows.torque(0.0, 1000.0)) == 0.0


def test_angular_contact_bearings_slide_more_and_have_centrifugal_forces():
    drag = SkfDrag("angular contact", **BALL, load=(1000.0, 500.0))
    n, d_m, nu = 6000.0, 43.5, 20.0
    push, slip = 1.90e-12 * d_m**4 * n**2, 1.91e-12 * d_m**4 * n**2
    rolling = 5.03e-7 * d_m**1.97 * (1000 + push + 1.97 * 500) ** 0.54 * (nu * n) ** 0.6
    rolling *= np.exp(-3e-8 * nu * n * 87 * np.sqrt(4.4 / 74)) / (1 + 1.84e-9 * (n * d_m) ** 1.28 * nu**0.64)
    film = np.exp(-2.6e-8 * (n * nu) ** 1.4 * d_m)
    sliding = 1.30e-2 * d_m**0.26 * ((1000 + slip) ** (4 / 3) + 0.68 * 500 ** (4 / 3)) * (0.05 + 0.07 * film)
    assert float(drag.torque(n * rpm)) / mm == pytest.approx(rolling + sliding, rel=1e-9)


def test_a_run_is_braked_by_the_force_of_its_bearing():
    drag = SkfDrag("63", **BALL)
    damped = {"damping_time": 2e-6}
    parts = {0.0: deep_groove(10 * um, drag=drag, **damped), 60 * mm: deep_groove(10 * um, **damped)}
    model = exugear.build(box_of(fast=parts, slow=parts))
    options = {"progress": False, "checks": 0, "power": True}
    run = exugear.run_up(model, speed=(60.0, 70.0), load=150.0, duration=0.02, **options)
    radial = np.hypot(*run.data["bearing_force"].values[0, :2])
    expected = drag.torque(run.data["shaft_speed"].values[0], radial)
    assert run.data["drag_torque"].values[0] == pytest.approx(expected, rel=0.01)
    assert run.energy_balance().relative < 2e-6


@pytest.mark.parametrize(
    ("arguments", "remedy"),
    [
        ({"series": "NU2"}, "use BearingDrag for rollers"),
        ({"series": "angular contact"}, "load must be given"),
        ({"d": 25.0}, "pass metres"),
        ({"viscosity": 20.0}, "20 mm.2/s are 20e-6"),
        ({"load": (100.0, 50.0)}, "C_0 must be given"),
        ({"load": (-1.0, 0.0)}, "load must be"),
    ],
)
def test_values_in_other_units_are_refused(arguments, remedy):
    with pytest.raises(ValueError, match=remedy):
        SkfDrag(**{"series": "63"} | BALL | arguments)
