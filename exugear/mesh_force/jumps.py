"""Jumps of a mesh force over phase, and time steps that resolve them alike in every mesh period.

A jump at a different fraction of a time step in every mesh period excites subharmonics of the mesh frequency that the
gears do not have: 6 % of the rms and 21 % of the peak to peak of a lightly damped mesh at 12.5 steps in a period.
"""

from collections.abc import Sequence

import numpy as np

#: A jump is a change by this share of the force's range over phase, at a fixed deflection, within this part of a pitch.
SHARE, WIDTH = 0.45, 1 / 256
#: Number of phases that are compared; share of the force below which its range over phase has no jumps.
FINE, FLAT = 4096, 1e-3
#: Share of the table's deflections above the deflection at which jumps are sought.
UNUSED = 0.1
#: Steps in a mesh period at a tolerance of 1e-3, measured; the error falls with the square of their number.
PERIOD_STEPS = 100
#: Part of a pitch by which a step may miss a jump.
MISS = 5e-4
#: Steps in a mesh period above which missed jumps change the rms by less than about 1 %.
MANY = 150


def jumps(force) -> np.ndarray:
    """(n,) phases at which a `MeshForce` jumps, near its largest deflection."""
    if force.offsets:
        return jumps(force.at(**{name: float(values[values.size // 2]) for name, values in force.offsets.items()}))
    phase, window = np.arange(FINE) / FINE, round(WIDTH * FINE)
    deflection = np.broadcast_to(force.deflection, force.force_table.shape)
    span = float((deflection[:, -1] - deflection[:, 0]).min())
    values = force(phase, float(deflection[:, -1].min()) - UNUSED * span)
    least = max(SHARE * np.ptp(values), FLAT * np.abs(values).max())
    steep = np.abs(np.roll(values, -window) - values) > least
    if not steep.any() or steep.all():
        return np.zeros(0)
    begins, ends = (np.flatnonzero(steep & ~np.roll(steep, k)) for k in (1, -1))
    ends = np.where(ends[0] < begins[0], np.roll(ends, -1), ends)
    middles = begins + (ends - begins) % FINE / 2 + window / 2
    return np.sort(middles / FINE % 1.0)


def dividing(step: float, meshes: Sequence[tuple[float, np.ndarray]]) -> float:
    """The largest step up to the given one [s] that divides the mesh periods and the times of their jumps.

    meshes   mesh period [s] and phases of the jumps, of each mesh that jumps

    Where no step down to half the given one does: the step that misses the jumps least.
    """
    period = meshes[0][0]
    fewest = int(np.ceil(period / step * (1 - 1e-9)))
    sizes = period / np.arange(fewest, 2 * fewest + 1)
    misses = np.array([missed(size, meshes) for size in sizes])
    good = np.flatnonzero(misses < MISS)
    return float(sizes[good[0] if good.size else misses.argmin()])


def missed(step: float, meshes: Sequence[tuple[float, np.ndarray]]) -> float:
    """Part of a pitch by which steps [s] miss the end of a mesh period or, counted from the first jump, a jump."""
    worst = 0.0
    for period, phases in meshes:
        step_counts = np.r_[1.0, phases - phases[0]] * period / step
        worst = max(worst, float(np.abs(step_counts - np.round(step_counts)).max()) * step / period)
    return worst
