"""Carriers that yield between the pins of their planets: closed forms, in statics and in runs."""

from dataclasses import replace

import numpy as np
import pytest
from planetary_boxes import GEAR, PIN, STIFFNESS, planetary, planetary_box, waving_law

import exugear
import fem
from fem.units import GPa, deg, mm, um

LAW, WIDTH, ALPHA = waving_law(0.0), GEAR.b, 20 * deg
OF_WIDTH = STIFFNESS / WIDTH
RADIUS, ARM = 15 * mm, 90 * mm
LENGTH, EI = 40 * mm, 206 * GPa * np.pi * RADIUS**4 / 4
PINS = [(f"planet {i + 1}", 0.0) for i in range(3)]
HINGED = exugear.Bearing(radial=5e8, axial=1e8, tilt=1.0)


def cantilever() -> np.ndarray:
    """(6, 6) compliance of the tip of a beam from z = -LENGTH to 0, clamped there (Euler and Bernoulli)."""
    sway, slope, turn = LENGTH**3 / (3 * EI), LENGTH**2 / (2 * EI), LENGTH / EI
    compliance = np.diag([sway, sway, LENGTH / (206 * GPa * np.pi * RADIUS**2), turn, turn, 2.6 * turn / 2])
    compliance[0, 4] = compliance[4, 0] = slope
    compliance[1, 3] = compliance[3, 1] = -slope
    return compliance


def on_cantilevers() -> exugear.Housing:
    return exugear.Housing(PINS, np.kron(np.eye(3), np.linalg.inv(cantilever())))


def cheeks(twist: float = 4e5) -> exugear.Housing:
    """Pins between two cheeks, of which the first takes the torque and the second turns against it [N m/rad].

    A pin is at the middle of its length: half of its tangential force goes to the second cheek, which moves it by half
    and tilts it by r / length.
    """
    compliance, turning = np.kron(np.eye(3), cantilever()), np.zeros(18)
    for i, angle in enumerate(2 * np.pi * np.arange(3) / 3):
        across = np.array([-np.sin(angle), np.cos(angle)])
        turning[6 * i : 6 * i + 2] = ARM / 2 * across
        turning[6 * i + 3 : 6 * i + 5] = ARM / LENGTH * np.array([-across[1], across[0]])
    return exugear.Housing(PINS, np.linalg.inv(compliance + np.outer(turning, turning) / twist))


def test_pins_on_cantilevers_share_the_load_as_springs_in_series():
    """(1 + 2 X)/3 and (1 - X)/3, as an error of the pin takes the compliances of meshes, bearing and cantilever."""
    load, X = 2000.0, 0.1
    in_series = 1 / (2 * STIFFNESS * np.cos(ALPHA) ** 2) + 1 / HINGED.radial + cantilever()[0, 0]
    errors = np.array([-X * load / (GEAR.z * 3 * mm) * in_series, 0.0, 0.0])
    box = planetary_box(law=LAW, pin=HINGED, pin_errors=errors, carrier_stiffness=on_cantilevers())
    data = exugear.load_distribution(box, load, mesh_stiffness=OF_WIDTH)
    assert data["K_gamma"].values[::2] / 3 == pytest.approx([(1 + 2 * X) / 3] + [(1 - X) / 3] * 2, abs=3e-4)


@pytest.mark.parametrize("load", [1200.0, -1200.0])
def test_planets_tilt_with_their_cantilevers(load):
    """A planet of tilt t bears 2 c b^3/12 cos^2 t against the slope of the pin; K_Hbeta = 1 + c t cos b/(2 q)."""
    tight = exugear.Bearing(radial=5e8, axial=1e8, tilt=2e6)
    box = planetary_box(law=LAW, pin=tight, carrier_stiffness=on_cantilevers())
    data = exugear.load_distribution(box, load, mesh_stiffness=OF_WIDTH, parts=100)
    force, c = abs(load) / (3 * ARM), cantilever()
    of_meshes = 2 * OF_WIDTH * WIDTH**3 / 12 * np.cos(ALPHA) ** 2
    # Of the seat s = slope F + turn M, M = k_t (t - s) on it, and k_t (t - s) = -of_meshes t.
    tilt = c[0, 4] * force / (1 + of_meshes / tight.tilt + c[4, 4] * of_meshes)
    q = force / (2 * WIDTH * np.cos(ALPHA))
    expected = 1 + OF_WIDTH * tilt * np.cos(ALPHA) * WIDTH / 2 / q
    assert data["K_H_beta"].values == pytest.approx(expected, rel=1e-3)
    assert expected > 1.05
    slopes = np.hypot(*data["seat_tilt"].values.T)
    assert slopes == pytest.approx(c[0, 4] * force - c[4, 4] * of_meshes * tilt, rel=1e-3)


def test_cheeks_that_twist_move_and_tilt_the_pins():
    twist, load = 4e5, 1500.0
    box = planetary_box(law=LAW, pin=HINGED, carrier_stiffness=cheeks(twist))
    data = exugear.load_distribution(box, load, mesh_stiffness=OF_WIDTH)
    turned, force, c = load / 2 / twist, load / (3 * ARM), cantilever()
    moved = np.hypot(*data["seat_displacement"].values[:, :2].T)
    assert moved == pytest.approx(c[0, 0] * force + ARM * turned / 2, rel=1e-4)
    assert np.hypot(*data["seat_tilt"].values.T) == pytest.approx(c[0, 4] * force + ARM / LENGTH * turned, rel=1e-4)


def test_seats_of_the_carrier_itself_are_in_series_with_its_bearings():
    """The axis of the carrier moves by f/k of its bearing and f/k of its seat."""
    stiffness, seat, weight = np.diag(np.r_[np.full(18, 1e9), np.full(6, 2e7)]), ("carrier", 0.0), 5.0 * 9.81
    bearing = exugear.Bearing(radial=1e7, axial=1e7, tilt=1e6)
    carrier = exugear.Shaft("carrier", {0.0: bearing}, inertia=0.02, mass=5.0, gravity=(0, -9.81, 0))
    housing = exugear.Housing([*PINS, seat], stiffness)
    box = planetary_box(law=LAW, pin=PIN, carrier=carrier, carrier_stiffness=housing)
    data = exugear.load_distribution(box, 1500.0, mesh_stiffness=OF_WIDTH)
    force = float(data["bearing_force"].sel(bearing="carrier at 0 mm", direction="y"))
    assert 0.01 * weight < force < weight
    at_seat = data["seat_displacement"].sel(seat="carrier at 0 mm", direction="y")
    assert float(at_seat) == pytest.approx(force / 2e7, rel=1e-6)
    moved = data["deflection"].sel(shaft="carrier", direction="y").values
    assert moved == pytest.approx(-force * (1 / 1e7 + 1 / 2e7), rel=1e-6)
    with pytest.raises(ValueError, match=r"leave these seats out for runs"):
        exugear.plan(box)


def test_runs_have_the_carrier_in_series_with_its_pins():
    """Modes are those of pins whose matrix is that of both in series."""
    series = np.linalg.inv(np.linalg.inv(PIN.stiffness[:5, :5]) + cantilever()[:5, :5])
    matrix = np.zeros((6, 6))
    matrix[:5, :5] = (series + series.T) / 2
    boxes = [
        planetary_box(pin=PIN, carrier_stiffness=on_cantilevers()),
        planetary_box(pin=exugear.Bearing(matrix=matrix, damping_time=2e-5)),
    ]
    assert "in series with each pin" in str(exugear.plan(boxes[0]))
    frequencies = [exugear.modes(exugear.build(box), load=1000.0)["frequency"].values for box in boxes]
    np.testing.assert_allclose(*frequencies, rtol=1e-9, atol=1e-3)


def test_pins_in_the_plane_stay_in_the_plane():
    box = planetary_box(pin=HINGED, carrier_stiffness=exugear.Housing(PINS, np.diag(np.full(9, 3e8))))
    scene = exugear.plan(box)
    assert scene.shafts["planet 1"].name == "PLANAR"
    alike = planetary_box(pin=exugear.Bearing(radial=1 / (1 / 5e8 + 1 / 3e8), axial=1 / (1 / 1e8 + 1 / 3e8), tilt=1.0))
    frequencies = [exugear.modes(exugear.build(each), load=1000.0)["frequency"].values for each in (box, alike)]
    np.testing.assert_allclose(*frequencies, rtol=1e-9, atol=1e-3)


def test_what_runs_cannot_have_in_series_is_refused_with_a_remedy():
    box = planetary_box(pin=HINGED, carrier_stiffness=cheeks())
    # Half of the torque reaches the second cheek, which moves the pins by half: a quarter of its compliance.
    with pytest.raises(ValueError, match=r"up to .* %, more than 1 %; give the twist common to .* of 1.6e\+06 N m/rad"):
        exugear.plan(box)
    stiff = planetary_box(pin=HINGED, carrier_stiffness=cheeks(1e10))
    assert "among it their common twist of 4e+10 N m/rad" in str(exugear.plan(stiff))
    assert "common twist" not in str(exugear.plan(planetary_box(pin=HINGED, carrier_stiffness=on_cantilevers())))
    roller = exugear.RollingBearing.needle(Z=14, D_w=4 * mm, D_pw=34 * mm, L_we=15 * mm, guidance=1e7)
    rolling = planetary_box(pin=roller, carrier_stiffness=on_cantilevers())
    with pytest.raises(ValueError, match=r"Bearing\(radial="):
        exugear.plan(rolling)
    assert exugear.load_distribution(rolling, 1500.0, mesh_stiffness=OF_WIDTH)["K_H_beta"].values[0] > 1


def test_bad_carriers_are_refused():
    with pytest.raises(ValueError, match=r"pass pin=Bearing"):
        planetary(carrier_stiffness=on_cantilevers())
    seats = [(name, 5 * mm) for name, _ in PINS]
    with pytest.raises(ValueError, match=r"carrier_stiffness has a seat planet 1 at 5 mm"):
        planetary_box(pin=PIN, carrier_stiffness=exugear.Housing(seats, np.eye(18) * 1e9))
    with pytest.raises(ValueError, match=r"carrier_stiffness"):
        planetary(pin=PIN, carrier_stiffness=np.eye(18))


@pytest.mark.slow
def test_a_mesh_of_the_carrier_is_reduced_as_that_of_a_housing():
    """Three square bars, clamped at one end: cantilevers with shear (Timoshenko) within a per cent or two."""
    from skfem import MeshHex
    from skfem.io.meshio import to_meshio

    side, length = 20 * mm, 100 * mm
    bars = []
    for angle in 2 * np.pi * np.arange(3) / 3:
        at = ARM * np.array([np.cos(angle), np.sin(angle)])
        across = [np.linspace(x - side / 2, x + side / 2, 3) for x in at]
        bars.append(MeshHex.init_tensor(*across, np.linspace(-length, 0.0, 11)))
    centres = [ARM * np.array([np.cos(a), np.sin(a)]) for a in 2 * np.pi * np.arange(3) / 3]

    def end(x, y):
        return lambda p: (abs(p[0] - x) < side) & (abs(p[1] - y) < side) & (p[2] > -1e-6)

    bar = bars[0] + bars[1] + bars[2]
    reduced = fem.reduce_housing(
        to_meshio(bar), seats=[end(*at) for at in centres], fixed=lambda p: p[2] < 1e-6 - length, modes=2
    )
    stiffness = exugear.Housing.from_reduction(reduced, PINS)
    compliance = np.linalg.inv(stiffness.seat_stiffness)
    steel = fem.Material()
    sway = length**3 / (3 * steel.E * side**4 / 12) + length / (5 / 6 * steel.E / (2 * (1 + steel.nu)) * side**2)
    assert compliance[0, 0] == pytest.approx(sway, rel=0.02)
    assert np.abs(compliance[:6, 6:]).max() < 1e-9 * compliance[3, 3]
    data = exugear.load_distribution(
        planetary_box(law=LAW, pin=HINGED, carrier_stiffness=stiffness), 1200.0, mesh_stiffness=OF_WIDTH
    )
    moved = np.hypot(*data["seat_displacement"].values[:, :2].T)
    assert moved == pytest.approx(compliance[0, 0] * 1200.0 / (3 * ARM), rel=1e-3)
    assert replace(stiffness).modes == 2
    assert 20 * um < moved[0] < 1 * mm
