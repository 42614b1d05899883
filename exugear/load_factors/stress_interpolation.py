"""Stresses of a map over torque and phase, interpolated at mesh forces and phases."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from fem.ste.ste_map import check_whole_cycle
from fem.support.validation import increasing, require, require_finite

GEAR, TORQUE, PHASE = "gear", "torque", "phase"
BOTH = ["pinion", "wheel"]
#: Stresses of a map [Pa] and the power of the force with which each grows between the torques of the map: root stress
#: is linear, the pressure of a line contact grows with the root of the force (Hertz).
POWERS = {"root_stress": 1.0, "tangent_stress": 1.0, "hertz_pressure": 0.5, "peak_pressure": 0.5}


@dataclass(frozen=True, eq=False)
class StressMap:
    """Stresses over mesh force and phase.

    force    (n_force,) increasing mesh forces > 0 [N]
    phase    (n_phase,) increasing phases in [0, 1)
    values   (..., n_force, n_phase) stresses by name [Pa]

    Between the forces stress / force^power is linear; below the lowest it is constant, so that the stress vanishes
    without force.
    """

    force: np.ndarray
    phase: np.ndarray
    values: dict[str, np.ndarray]

    def at(self, force: np.ndarray, phase: np.ndarray) -> dict[str, np.ndarray]:
        """(..., n) stresses [Pa] under forces (n,) >= 0 up to the largest of the map [N], at phases (n,)."""
        row, over_row = _interval(self.force, force)
        closed = np.append(self.phase, self.phase[0] + 1)
        column, over_column = _interval(closed, self.phase[0] + (phase - self.phase[0]) % 1.0)
        corners = (row, column), (over_row, over_column)
        return {
            name: force ** POWERS[name] * _bilinear(values, *corners) for name, values in self._coefficients.items()
        }

    @cached_property
    def _coefficients(self) -> dict[str, np.ndarray]:
        """(..., n_force, n_phase + 1) stress / force^power, periodic in the phase."""
        closed = {name: np.concatenate([x, x[..., :1]], axis=-1) for name, x in self.values.items()}
        return {name: x / self.force[:, None] ** POWERS[name] for name, x in closed.items()}


def _interval(grid: np.ndarray, queries: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lower grid point of the interval of each query, and the share of the interval below it, clipped to [0, 1]."""
    if grid.size == 1:
        return np.zeros(queries.shape, int), np.zeros(queries.shape)
    lower = np.clip(np.searchsorted(grid, queries, side="right") - 1, 0, grid.size - 2)
    return lower, np.clip((queries - grid[lower]) / (grid[lower + 1] - grid[lower]), 0.0, 1.0)


def _bilinear(values: np.ndarray, lower: tuple[np.ndarray, ...], share: tuple[np.ndarray, ...]) -> np.ndarray:
    """(..., n) values between the grid points of values (..., n_row, n_column)."""
    (i, j), (s, t) = lower, share
    following = np.minimum(i + 1, values.shape[-2] - 1)
    at_row, at_following = (values[..., k, j] + t * (values[..., k, j + 1] - values[..., k, j]) for k in (i, following))
    return at_row + s * (at_following - at_row)


def stress_map(stresses: xr.Dataset, r_b: float) -> StressMap:
    """The map of `fem.root_stress` over the mesh force; r_b: base radius of the pinion [m].

    Raises ValueError for other data, for a map without a torque > 0 and for one of several pitches.
    """
    axes = {"root_stress": (GEAR, TORQUE, PHASE), "hertz_pressure": (TORQUE, PHASE), "peak_pressure": (TORQUE, PHASE)}
    is_map = all(name in stresses and set(stresses[name].dims) == set(dims) for name, dims in axes.items())
    require(is_map, "stresses must be a map over gear, torque and phase; pass what fem.root_stress returns")
    gears = stresses.get(GEAR, xr.DataArray(BOTH)).values.tolist()
    whole = f"stresses must have the gears {BOTH}, got {gears}; pass all that fem.root_stress returns"
    require(sorted(gears) == BOTH, whole)
    stresses = stresses.isel({GEAR: np.argsort(gears)})
    torque, phase = (increasing(name, stresses[name].values) for name in (TORQUE, PHASE))
    require(bool(torque[-1] > 0), f"stresses must have a torque > 0 N m, got {torque}")
    pitch = f"stresses must be of one pitch, at phases in [0, 1), got phases up to {phase[-1]:g}"
    require(bool(phase[0] >= 0 and phase[-1] < 1), pitch)
    check_whole_cycle(stresses)
    loaded = stresses.isel({TORQUE: torque > 0}).transpose(GEAR, TORQUE, PHASE)
    values = {name: loaded[name].values for name in POWERS if name in loaded}
    for name, x in values.items():
        require_finite(f"{name} of the stresses", x, "solve the missing states or drop their torque")
    return StressMap(torque[torque > 0] / r_b, phase, values)
