"""The labelled Dataset of all branches: what each orbit is like."""

from typing import Any

import numpy as np
import xarray as xr

from exugear.steady_state.branch_search import Branch
from exugear.steady_state.orbits.cycle_kernels import fourier_sums
from exugear.steady_state.orbits.periodic_orbit import PeriodicOrbits
from exugear.steady_state.orbits.steady_system import Orbit, SteadySystem

#: Unit and meaning of the variables over the points.
ABOUT = {
    "branch": ("1", "number of the branch"),
    "speed": ("rad/s", "speed of the driving shaft"),
    "mesh_frequency": ("Hz", "mesh frequency of the stage"),
    "mean": ("m", "mean of the DTE"),
    "rms": ("m", "rms of the DTE about its mean"),
    "peak_to_peak": ("m", "peak to peak of the DTE"),
    "harmonics": ("m", "amplitude of the DTE at multiples of the mesh frequency"),
    "harmonic_phase": (
        "rad",
        "phase of the cosine at multiples of the mesh frequency, from phase 0 of the mesh",
    ),
    "smallest_force": ("N", "smallest mesh force"),
    "largest_force": ("N", "largest mesh force"),
    "share_without_contact": ("1", "share of the period in which no teeth touch"),
    "period": ("1", "period in mesh cycles"),
    "stable": ("1", "whether small disturbances decay"),
    "largest_multiplier": ("1", "largest modulus of the Floquet multipliers over the period"),
    "bifurcation": ("", "fold, period doubling, or empty"),
}


def labelled(system: SteadySystem, branches: list[Branch], cycles_per_radian: float, harmonics: int) -> xr.Dataset:
    """Dataset over point, and over harmonic up to a number of mesh orders.

    cycles_per_radian   mesh cycles per radian of the driving shaft
    """
    orders = np.arange(1, 2 * harmonics + 1) / 2
    rows = [row for number, branch in enumerate(branches) for row in _rows(system, number, branch, orders.size)]
    for row in rows:
        row["speed"] = row["mesh_frequency"] / cycles_per_radian
    dims = {name: ("point", "harmonic") if name.startswith("harmonic") else ("point",) for name in ABOUT}
    variables = {
        name: (dims[name], np.array([row[name] for row in rows]), {"units": unit, "long_name": meaning})
        for name, (unit, meaning) in ABOUT.items()
    }
    about_order = {"units": "1", "long_name": "multiple of the mesh frequency"}
    return xr.Dataset(variables, {"point": np.arange(len(rows)), "harmonic": ("harmonic", orders, about_order)})


def _rows(system: SteadySystem, number: int, branch: Branch, halves: int) -> list[dict[str, Any]]:
    """Values of the variables for each point of a branch."""
    orbits, rows = PeriodicOrbits(system, branch.period), []
    for point in branch.points:
        states, frequency = orbits.states_of(point.unknowns), orbits.frequency_of(point.unknowns)
        largest = float(np.abs(point.multipliers).max())
        about = {"branch": number, "period": branch.period, "stable": point.stable, "bifurcation": point.bifurcation}
        measures = _measures(system.orbit(states, frequency, branch.period), branch.period, halves)
        rows.append({**about, "mesh_frequency": frequency, "largest_multiplier": largest, **measures})
    return rows


def _measures(orbit: Orbit, period: int, halves: int) -> dict[str, Any]:
    """What the samples of an orbit give.

    period   in mesh cycles
    halves   number of harmonics, multiples of half the mesh frequency
    """
    mean = float(orbit.weight @ orbit.deflection)
    alternating = orbit.deflection - mean
    components = 2 * fourier_sums(orbit.weight, orbit.phase, alternating, halves) @ [1, 1j]
    components[np.arange(1, halves + 1) * period % 2 == 1] = 0.0
    return {
        "mean": mean,
        "rms": float(np.sqrt(orbit.weight @ alternating**2)),
        "peak_to_peak": float(np.ptp(orbit.deflection)),
        "harmonics": np.abs(components),
        "harmonic_phase": np.angle(components),
        "smallest_force": float(orbit.force.min()),
        "largest_force": float(orbit.force.max()),
        "share_without_contact": float(orbit.weight @ (orbit.static_force == 0.0)),
    }
