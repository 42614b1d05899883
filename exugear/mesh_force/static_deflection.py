"""Static deflections of a force law: the transmission error over all its pitches, by Newton's method."""

from functools import cache

import numpy as np

from exugear.mesh_force.patches import phase_cell
from exugear.mesh_force.potential import extent_of, potential
from fem.support.numba_cache import kept

#: Steps of Newton's method within the bracket, and the share of the load that may be left.
STEPS, LEFT = 60, 1e-10


def static_deflections(force, phase: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """(n_load, n_phase) deflections [m] of the driving flank of a law without offsets, under loads >= 0 [N].

    Raises the kernels' ValueError beyond the table.
    """
    return _deflections()(force.table.head, np.ascontiguousarray(phase), np.ascontiguousarray(loads))


@cache
def _deflections():
    @kept
    def deflections(table, phase, loads):
        values = np.empty((loads.size, phase.size))
        for j in range(phase.size):
            cell = phase_cell(table, phase[j])
            extent = extent_of(table, 0, cell)
            for i in range(loads.size):
                low, high = extent.unloaded, extent.unloaded + extent.largest
                y = low + min(loads[i] / extent.largest_force, 1.0) * extent.largest
                for _ in range(STEPS):
                    if loads[i] == 0.0:
                        y = low
                        break
                    u = potential(table, 0, cell, y, 0.0)
                    if u.force > loads[i]:
                        high = min(high, y)
                    else:
                        low = max(low, y)
                    if abs(u.force - loads[i]) <= LEFT * loads[i]:
                        break
                    y = y - (u.force - loads[i]) / u.stiffness if u.stiffness > 0.0 else 0.5 * (low + high)
                    if not low < y < high:
                        y = 0.5 * (low + high)
                values[i, j] = y
        return values

    return deflections
