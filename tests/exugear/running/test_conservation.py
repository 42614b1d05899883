"""Energy of pairs that turn without damping: one potential keeps it to the error of the integrator."""

import numpy as np
import pytest
import scipy
from measured_rows import deviation
from scenes import paper_pair, smooth_map

import exugear
from fem import ste_map
from fem.units import mm, um

PAIR = paper_pair()
#: Time of 1,000 mesh cycles at the speed at the start [s].
SPEED = 60.0
THOUSAND_MESHES = 1000 * 2 * np.pi / (SPEED * PAIR.pinion.z)
#: Samples at either end, where the load has just changed, and where derivatives are taken from one side.
ENDS = 20


def model_of(law: exugear.MeshForce, bearing: exugear.Bearing | None = None) -> exugear.Model:
    supports = {0 * mm: bearing, 70 * mm: bearing} if bearing else {}
    shafts = [exugear.Shaft(name, {40 * mm: PAIR.pinion} | supports) for name in ("fast", "slow")]
    return exugear.build(exugear.Gearbox([exugear.Stage(*shafts, law, pair=PAIR)]))


def map_over_all_offsets():
    """The smooth map, a little softer or stiffer along every axis; bearings move the gears within one cell."""
    plain = smooth_map((0, 1, 5, 20, 50, 150, 350, 1000))
    a, misalignment, axial = (
        np.array([-120, -20, 80, 180]),
        np.array([-4e-4, -2e-4, 1.5e-4, 3e-4]),
        np.array([-2, -0.5, 1.5]),
    )
    factor = (1 + 1e-4 * a[:, None, None]) * (1 - 0.02 * (misalignment[:, None] / 2e-4) ** 2) * (1 + 5e-3 * axial**2)
    te = plain["te"].values[:, None, None, None, :] * factor[..., None]
    offsets = {"a": PAIR.a + a * um, "misalignment": misalignment, "axial": axial * mm}
    return ste_map(PAIR, plain["torque"].values, plain["phase"].values, te, offsets)


def drift(model: exugear.Model, step: float, duration: float) -> float:
    """Spread of the energy less the work of the torques [J], of a free train that vibrates after a change of load."""
    options = {"step": step, "tolerance": 1e-4, "progress": False, "checks": 0, "power": True}

    def under(torque: float, **start) -> exugear.Run:
        return exugear.run(model, drives={"fast": exugear.Torque(torque)}, loads={"slow": torque}, **start, **options)

    loaded = under(150.0, duration=1e-3, start_speed=SPEED)
    data = under(140.0, duration=duration, initial=loaded).data
    net = (data["power_in"].sum("drive_end") - data["power_out"].sum("load_end")).values
    work = scipy.interpolate.CubicSpline(data["time"], net).antiderivative()(data["time"])
    energy = (data["kinetic_energy"] + data["strain_energy"]).values - work
    return float(np.ptp(energy[ENDS:-ENDS]))


def test_energy_of_spinning_gears_converges_in_fourth_order_over_a_thousand_meshes(measured):
    model = model_of(exugear.MeshForce.from_ste(smooth_map()))
    coarse, middle, fine = (drift(model, step, THOUSAND_MESHES) for step in (4.8e-5, 2.4e-5, 1.2e-5))
    former = drift(model_of(exugear.MeshForce.from_ste(smooth_map(), conserves=False)), 1.2e-5, THOUSAND_MESHES)
    drifts = " / ".join(f"{1e6 * drift:.3g}" for drift in (coarse, middle, fine))
    measured.cells("energy of two gears that spin without damping, 1,000 meshes, at 48 / 24 / 12 µs", f"{drifts} µJ")
    assert coarse / middle > 8 and middle / fine > 12
    assert fine < 1e-3 * former


@pytest.mark.slow
def test_energy_of_gears_in_space_with_all_offset_axes_converges_in_fourth_order(measured):
    """Up to the smoothness of the tables, 5e-4 of what the mesh stores."""
    bearing = exugear.Bearing(radial=2e8, axial=1e8)
    model, former = (
        model_of(exugear.MeshForce.from_ste(map_over_all_offsets(), conserves=c), bearing) for c in (True, False)
    )
    coarse, fine = drift(model, 2.4e-5, 0.3), drift(model, 1.2e-5, 0.3)
    row = "the same on undamped bearings in space, all offset axes, at 24 / 12 µs"
    measured.cells(row, f"{1e6 * coarse:.2g} / {1e6 * fine:.2g} µJ")
    assert coarse / fine > 8
    assert fine < 2e-3 * drift(former, 1.2e-5, 0.3)


def test_power_balances_at_every_angle_of_a_slow_run_and_the_mean_torques_have_the_ratio_of_the_teeth(measured):
    """M_in omega_in = M_out omega_out + dE/dt, without damping; the torques over one mesh cycle."""
    speed, load = 0.1, 150.0
    cycle = 2 * np.pi / (speed * PAIR.pinion.z)
    model = model_of(exugear.MeshForce.from_ste(smooth_map()))
    options = {"step": 3e-5, "progress": False, "checks": 0, "power": True}
    data = exugear.run_up(model, speed=speed, load=load, duration=1.01 * cycle, **options).data
    time, energy = data["time"].values, (data["kinetic_energy"] + data["strain_energy"]).values
    change = scipy.interpolate.CubicSpline(time, energy).derivative()(time)
    residual = (data["power_in"] - data["power_out"]).values - change
    error = np.abs(residual[50:-50]).max() / float(data["power_in"].mean())
    measured("power in less power out less change of energy, at every angle of a slow run", error, 1e-8)
    torque = scipy.interpolate.CubicSpline(time, data["drive_torque"].values)
    mean = torque.integrate(time[-1] - cycle, time[-1]) / cycle
    ratio = deviation(load / mean, PAIR.wheel.z / PAIR.pinion.z)
    measured("mean torques of that run over a mesh cycle, beside the ratio of the teeth", ratio, 1e-9)
    assert np.ptp(data["drive_torque"].values) > 5e-3 * load
