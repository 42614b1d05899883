"""Radiated power of a housing under the bearing forces of a run, against its response at one frequency."""

from functools import cache

import numpy as np
import pytest
import xarray as xr
from skfem import MeshHex
from skfem.io.meshio import to_meshio
from valid_arguments import run_on_bearings

import exugear
import fem
from fem.units import mm

SEATS = [("fast", 0.0)]


@cache
def bar() -> fem.ReducedHousing:
    """A clamped bar with a seat at its end."""
    axes = (np.linspace(0, size, n) for size, n in ((0.3, 7), (0.06, 2), (0.06, 2)))
    mesh = to_meshio(MeshHex.init_tensor(*axes))
    return fem.reduce_housing(mesh, [lambda p: p[0] > 0.299], lambda p: p[0] < 1e-6, modes=5)


def harmonic(frequency: float, forces, duration: float = 1.0) -> xr.Dataset:
    """Data of a run whose bearing force is harmonic, beside a constant one."""
    data = run_on_bearings().data
    time = np.arange(0, duration, 1e-4)
    values = np.zeros((data.sizes["bearing"], 3, time.size))
    values[0] = np.outer(forces, np.cos(2 * np.pi * frequency * time)) + 1000.0
    held = data[["speed", "mesh_frequency", "dte", "mesh_force"]].isel(time=np.zeros(time.size, int))
    held = held.assign_coords(time=time, bearing=data["bearing"], direction=data["direction"])
    return held.assign(bearing_force=(("bearing", "direction", "time"), values))


@pytest.mark.parametrize("frequency", [200.0, 333.0])
def test_a_harmonic_force_radiates_by_the_response_at_its_frequency(frequency):
    data = harmonic(frequency, [0.0, 2.0, 1.0])
    power = exugear.radiated_power(data, bar(), SEATS, resolution=10.0, highest=1500.0)
    forces = np.array([[0.0, -2.0, -1.0, 0, 0, 0]])
    assert float(power["power"].sum()) == pytest.approx(float(bar().radiated_power([frequency], forces)[0]), rel=0.03)
    assert float(power["frequency"][int(power["power"].values.argmax())]) == pytest.approx(frequency, abs=10.0)
    assert power.attrs["total_level"] == pytest.approx(10 * np.log10(float(power["power"].sum()) / 1e-12))


def test_wrong_input_is_refused_in_words():
    data = harmonic(200.0, [0.0, 2.0, 1.0])
    with pytest.raises(ValueError, match="the run has no bearings"):
        exugear.radiated_power(data, bar(), [("fast", 10 * mm)])
    with pytest.raises(ValueError, match="take a larger resolution"):
        exugear.radiated_power(data, bar(), SEATS, resolution=0.5)
    with pytest.raises(ValueError, match="must name the 1 seats"):
        exugear.radiated_power(data, bar(), SEATS * 2)
