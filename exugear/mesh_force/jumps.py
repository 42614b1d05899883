"""Jumps of a mesh force over phase, and steps that meet them alike in every mesh period.

A jump that falls into another part of a step in every period excites what is not there: subharmonics of the mesh
frequency, 6 % of the rms and 21 % of the peak to peak of a lightly damped mesh at 12.5 steps in a period.
"""

from collections.abc import Sequence

import numpy as np

#: A jump: more than this share of the force's range over phase, at one deflection, within so much of a pitch.
SHARE, WIDTH = 0.45, 1 / 256
#: Phases at which that is looked for; ranges below this share of the force are none.
FINE, FLAT = 4096, 1e-3
#: Share of the table's deflections that stays unused at the phase of the largest force.
UNUSED = 0.1
#: Steps in a mesh period at a tolerance of 1e-3, measured; the error falls with the square of their number.
PERIOD_STEPS = 100
#: By how much of a pitch steps may miss a jump.
MISS = 5e-4
#: Steps in a period above which jumps that they miss move the rms by less than some 1 %.
MANY = 150


def jumps(force) -> np.ndarray:
    """(n,) phases at which a `MeshForce` jumps, at most of its deflection."""
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
    """The largest step up to the given one [s] of which mesh periods, and their jumps, are whole multiples.

    meshes   mesh period [s] and phases of the jumps of each mesh that jumps

    Where there is none down to half the step: the one that misses least.
    """
    period = meshes[0][0]
    fewest = int(np.ceil(period / step * (1 - 1e-9)))
    sizes = period / np.arange(fewest, 2 * fewest + 1)
    misses = np.array([missed(size, meshes) for size in sizes])
    good = np.flatnonzero(misses < MISS)
    return float(sizes[good[0] if good.size else misses.argmin()])


def missed(step: float, meshes: Sequence[tuple[float, np.ndarray]]) -> float:
    """By how much of a pitch steps [s] miss the end of a mesh period or, after the first one, a jump."""
    worst = 0.0
    for period, phases in meshes:
        step_counts = np.r_[1.0, phases - phases[0]] * period / step
        worst = max(worst, float(np.abs(step_counts - np.round(step_counts)).max()) * step / period)
    return worst
