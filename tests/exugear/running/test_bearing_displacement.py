"""Displacements of shafts at their bearings: by forces and stiffness, clearance, tilt; orbits of a rotating force."""

import exudyn.itemInterface as eii
import numpy as np
import pytest
import xarray as xr
from bearing_boxes import ENDS, box_of
from scenes import smooth_box

import exugear
from fem.units import mm, um

RUN = {"speed": (50.0, 60.0), "load": 100.0, "duration": 0.02, "progress": False, "checks": 0}
#: Stiffness along x and y [N/m], ratio of damping to stiffness [s].
K_X, K_Y, DAMPING = 2e8, 5e8, 2e-5
#: Rotating force [N] and its angular frequency [rad/s].
FORCE, OMEGA = 2000.0, 2 * np.pi * 50


def run_of(box: exugear.Gearbox, **changes) -> xr.Dataset:
    return exugear.run_up(exugear.build(box), **RUN | changes, displacement=True).data


def test_displacements_are_kept_on_request_and_change_nothing_else():
    model = exugear.build(box_of())
    plain = exugear.run_up(model, **RUN).data
    data = exugear.run_up(model, **RUN, displacement=True).data
    kept = {"bearing_displacement", "bearing_moment", "tilt"}
    assert set(data.variables) - set(plain.variables) == kept
    xr.testing.assert_allclose(data.drop_vars(kept), plain)
    displacement, force = data["bearing_displacement"], data["bearing_force"]
    assert displacement.dims == force.dims
    assert displacement.attrs == {"units": "m", "long_name": "displacement of the shaft in the bearing"}
    spinning = run_of(smooth_box())
    assert "bearing_displacement" not in spinning


def test_force_of_a_linear_bearing_is_stiffness_times_displacement_and_damped_rate():
    bearing = exugear.Bearing(radial=K_X, axial=1e8, damping_time=DAMPING)
    data = run_of(box_of(fast={0.0: bearing, 60 * mm: bearing}), sample=2e-6)
    moved, force = (
        data[name].sel(bearing="fast at 0 mm", direction=["x", "y"]).transpose("direction", "time").values
        for name in ("bearing_displacement", "bearing_force")
    )
    rate = np.gradient(moved, data["time"].values, axis=1)
    inside = slice(2, -2)
    expected = -K_X * (moved + DAMPING * rate)
    assert force[:, inside] == pytest.approx(expected[:, inside], abs=1e-3 * np.abs(force).max())
    held = float(data["mesh_force"][0, 0]) / 2
    assert np.hypot(*moved[:, 0]) == pytest.approx(held / K_X, rel=1e-3)


def test_displacement_in_a_clearance_is_the_clearance_and_the_deflection_behind_it():
    clearance = 10 * um
    play = {axial: exugear.Bearing(5e8, b.axial, clearance=clearance) for axial, b in ENDS.items()}
    data = run_of(box_of(fast=play), speed=0.5, duration=1e-3).isel(time=0)
    moved, force = (
        data[name].sel(bearing="fast at 60 mm", direction=["x", "y"]).values
        for name in ("bearing_displacement", "bearing_force")
    )
    assert np.hypot(*moved) == pytest.approx(clearance + np.hypot(*force) / 5e8, rel=1e-5)
    assert moved / np.hypot(*moved) == pytest.approx(-force / np.hypot(*force), abs=1e-6)


def test_displacements_of_bearings_at_unequal_distances_are_those_of_a_rigid_shaft():
    """A soft and a stiff bearing: the shaft tilts, the forces balance about the gear."""
    soft, stiff = exugear.Bearing(1e8, 1e8), exugear.Bearing(5e8)
    data = run_of(box_of(fast={0.0: soft, 90 * mm: stiff}), speed=0.5, duration=1e-3).isel(time=0)
    at = data["bearing_displacement"].sel(bearing=["fast at 0 mm", "fast at 90 mm"], direction=["x", "y"]).values
    force = float(data["mesh_force"][0]) * np.array([2 / 3, 1 / 3])
    assert np.hypot(*at.T) == pytest.approx(force / [1e8, 5e8], rel=2e-3)


def test_the_orbit_of_a_rotating_force_is_an_ellipse_with_the_half_axes_of_its_bearings():
    """Far below all resonances: half the force over the stiffness of one of two bearings, along x and along y."""
    stiffness = np.diag([K_X, K_Y, 1e8, 0.0, 0.0, 0.0]).tolist()
    bearing = exugear.Bearing(matrix=stiffness, damping_time=2e-4)
    model = exugear.build(box_of(fast={0.0: bearing, 60 * mm: bearing}))
    body = model.mbs.AddMarker(eii.MarkerBodyPosition(bodyNumber=model.bodies["fast"]))
    rotating = {"loadVectorUserFunction": rotating_force}
    model.mbs.AddLoad(eii.Force(markerNumber=body, loadVector=[FORCE, 0, 0], **rotating))
    model.mbs.Assemble()
    data = exugear.run_up(model, **RUN | {"speed": 0.0, "duration": 0.08, "load": 300.0}, displacement=True).data
    turn = data.isel(time=data["time"].values > data["time"].values[-1] - 2 * np.pi / OMEGA)
    orbit = turn["bearing_displacement"].sel(bearing="fast at 0 mm", direction=["x", "y"])
    x, y = orbit.transpose("direction", "time").values
    half_axes = FORCE / 2 / np.array([K_X, K_Y])
    assert [np.ptp(x) / 2, np.ptp(y) / 2] == pytest.approx(half_axes, rel=5e-3)
    centred = (np.array([x, y]).T - [(x.max() + x.min()) / 2, (y.max() + y.min()) / 2]) / half_axes
    assert np.hypot(*centred.T) == pytest.approx(1, abs=0.01)


def rotating_force(mbs, t, load):
    return [FORCE * np.cos(OMEGA * t), FORCE * np.sin(OMEGA * t), 0.0]
