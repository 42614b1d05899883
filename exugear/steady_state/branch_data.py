"""The labelled Dataset of all branches: what each orbit is like."""

from collections.abc import Iterator, Mapping
from math import sqrt
from typing import Any

import numpy as np
import xarray as xr

from exugear.steady_state.branch import Branch
from exugear.steady_state.cycle_kernels import fourier_sums, sampled_measures
from exugear.steady_state.periodic_orbit import PeriodicOrbits
from exugear.steady_state.steady_system import Orbit, SteadySystem

#: Unit and meaning of the variables over the points, and of those of every stage.
OF_POINTS: dict[str, tuple[str, str]] = {
    "branch": ("1", "number of the branch"),
    "speed": ("rad/s", "speed of the driving shaft"),
    "period": ("1", "period in common periods of the meshes that excite"),
    "stable": ("1", "whether small disturbances decay"),
    "largest_multiplier": ("1", "largest modulus of the Floquet multipliers over the period"),
    "bifurcation": ("", "fold, period doubling, or empty"),
}
OF_STAGES = {
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
}


OF_SHAFTS = {
    "torque_harmonics": (
        "N m",
        "amplitude of the torque of the meshes about the axis of a shaft at multiples of the mesh frequency",
    ),
}


def labelled(
    system: SteadySystem,
    branches: list[Branch],
    mesh_cycles: np.ndarray,
    harmonics: int,
    levers: Mapping[str, np.ndarray],
) -> xr.Dataset:
    """Dataset over point, stage, shaft and harmonic up to a number of mesh orders.

    mesh_cycles   (n_stage,) of the first meshes that excite per radian of the driving shaft
    levers        of each shaft: (n_mesh,) torque per force of the meshes that excite [m]
    """
    orders = np.arange(1, 2 * harmonics + 1) / 2
    variables: dict[str, Any] = {name: [] for name in (*OF_POINTS, *OF_STAGES, *OF_SHAFTS)}
    of_shafts = np.array([*levers.values()])
    for number, branch in enumerate(branches):
        for about in _points(system, number, branch, mesh_cycles, orders.size, of_shafts):
            for name, value in about.items():
                variables[name].append(value)
    about_order = {"units": "1", "long_name": "multiple of the mesh frequency"}
    coordinates = {"point": np.arange(len(variables["branch"])), "harmonic": ("harmonic", orders, about_order)}
    coordinates["shaft"] = [*levers]
    dims: dict[str, tuple[str, ...]] = dict.fromkeys(OF_POINTS, ("point",))
    dims |= {name: ("point", "stage", "harmonic")[: 2 + name.startswith("harmonic")] for name in OF_STAGES}
    dims |= dict.fromkeys(OF_SHAFTS, ("point", "shaft", "harmonic"))
    described = OF_POINTS | OF_STAGES | OF_SHAFTS
    labels = {name: {"units": unit, "long_name": about} for name, (unit, about) in described.items()}
    return xr.Dataset({name: (dims[name], np.array(x), labels[name]) for name, x in variables.items()}, coordinates)


def _points(
    system: SteadySystem, number: int, branch: Branch, mesh_cycles: np.ndarray, halves: int, levers: np.ndarray
) -> Iterator[dict[str, Any]]:
    """Values of the variables at each point of a branch."""
    orbits = PeriodicOrbits(system, branch.period)
    for point in branch.points:
        states, frequency = orbits.states_of(point.unknowns), orbits.frequency_of(point.unknowns)
        exciting = system.orbits(states, frequency, branch.period)
        of_meshes = exciting[: mesh_cycles.size]
        cycles = [branch.period * mesh.cycles for mesh in system.meshes]
        measures = [_measures(orbit, x, halves) for orbit, x in zip(of_meshes, cycles, strict=False)]
        forces = [_components(exciting[0], orbit.force, cycles[0], halves) for orbit in exciting]
        speed = frequency / mesh_cycles[0]
        yield {
            "branch": number,
            "speed": speed,
            "period": branch.period,
            "stable": point.stable,
            "largest_multiplier": float(np.abs(point.multipliers).max()),
            "bifurcation": point.bifurcation,
            "mesh_frequency": speed * mesh_cycles,
            **{name: [values[name] for values in measures] for name in measures[0]},
            "torque_harmonics": np.abs(levers @ forces),
        }


def _measures(orbit: Orbit, cycles: int, halves: int) -> dict[str, Any]:
    """What the samples of a mesh over the period of an orbit give.

    cycles   number of mesh cycles in the period
    halves   number of harmonics, multiples of half the mesh frequency
    """
    measures = sampled_measures(orbit.weight, orbit.dte, orbit.force, orbit.static_force)
    components = _components(orbit, orbit.dte - measures.mean, cycles, halves)
    return {
        "mean": measures.mean,
        "rms": sqrt(measures.variance),
        "peak_to_peak": measures.peak_to_peak,
        "harmonics": np.abs(components),
        "harmonic_phase": np.angle(components),
        "smallest_force": measures.smallest_force,
        "largest_force": measures.largest_force,
        "share_without_contact": measures.share_without_force,
    }


def _components(orbit: Orbit, values: np.ndarray, cycles: int, halves: int) -> np.ndarray:
    """(halves,) complex amplitudes of samples over the phase of an orbit; arguments as those of `_measures`."""
    components = 2 * fourier_sums(orbit.weight, orbit.phase, values, halves) @ [1, 1j]
    components[np.arange(1, halves + 1) * cycles % 2 == 1] = 0.0
    return components
