"""How the modelled face is cut into slices: graded towards the end faces, with ends at kinks of the modifications."""

from math import ceil, sqrt, tan
from typing import NamedTuple

import numpy as np

from fem.microgeometry.flank import edges, edges_across
from fem.pair.mesh_position import MeshPosition
from fem.support.numba_cache import kept_unchecked, unchecked

#: Slices are narrower towards the end faces by this power, as the line load changes there.
GRADING = 1.6
#: Kinks keep this distance from one another and from the ends, graded edges from kinks, as shares of an even slice:
#: beside a narrow slice the load on it would be inaccurate.
BETWEEN_KINKS, BESIDE_KINKS = 0.02, 0.2


class FaceGrading(NamedTuple):
    """The modelled part of the face: positions at shares of it lie closer together towards the end faces.

    low, high   axial ends of the common face [m]
    start       relative distance from its middle at which the modelled part begins: `WholeFace.start`, `HalfFace.start`
    """

    low: float
    high: float
    start: float


def kink_shares(position: MeshPosition, grading: FaceGrading, ends: tuple[float, float]) -> np.ndarray:
    """(n_pair, n) increasing shares of the face where the gap may have a kink; ends of the modelled face [m]."""
    return np.sort(share_at(grading, np.clip(kinks(position), *ends)), axis=1)


def flank_positions(position: MeshPosition, positions_of) -> np.ndarray:
    """(n,) axial positions on both flanks [m], from a function of flank and extent such as `edges_across`."""
    pinion, wheel = ((gear.drive_flank, gear.face) for gear in (position.pair.pinion, position.pair.wheel))
    return np.array([*positions_of(*pinion), *(position.axial + axial for axial in positions_of(*wheel))], float)


def kinks(position: MeshPosition) -> np.ndarray:
    """(n_pair, n) axial positions where the slope of the gap jumps along the line of contact [m].

    There a modification begins, or the path of contact ends.
    """
    pair = position.pair
    pinion, wheel = ((gear.drive_flank, gear.face) for gear in (pair.pinion, pair.wheel))
    across = flank_positions(position, edges_across)
    path = position.path
    rolls = np.array([*edges(*pinion), *(path.on_wheel(roll) for roll in edges(*wheel)), path.start, path.end])
    start = position.nominal(np.array(position.numbers())[:, None], 0.0)
    along = (rolls - start) / tan(pair.beta_b) if pair.beta_b else np.zeros((start.size, 0))
    return np.concatenate([np.tile(across, (start.size, 1)), along], axis=1)


def axial_at(grading, share):
    """Axial positions [m] at shares of the modelled part in [0, 1]."""
    side = grading.start + (1 - grading.start) * share
    graded = np.sign(side) * (1 - (1 - np.abs(side)) ** GRADING)
    return (grading.low + grading.high) / 2 + (grading.high - grading.low) / 2 * graded


def share_at(grading, axial):
    """Inverse of `axial_at`."""
    graded = (axial - (grading.low + grading.high) / 2) / ((grading.high - grading.low) / 2)
    side = np.sign(graded) * (1 - (1 - np.minimum(np.abs(graded), 1)) ** (1 / GRADING))
    return (side - grading.start) / (1 - grading.start)


compiled_axial, compiled_share = unchecked(axial_at), unchecked(share_at)


@unchecked
def write_with_kinks(start, end, steps, kinks, positions):
    """Write equidistant positions from start to end and the kinks (n,), increasing, among them; returns their number.

    The first and the last stay; kinks too close to them and steps beside kinks are left out. Kinks too close to one
    another have one position in their middle, so that a mirrored face has the mirrored positions.
    """
    step, inside, number = (end - start) / steps, np.empty(kinks.size), 0
    first = previous = start
    for kink in kinks:
        if start + BETWEEN_KINKS * step < kink < end - BETWEEN_KINKS * step:
            if number == 0 or kink - previous > BETWEEN_KINKS * step:
                first, number = kink, number + 1
            inside[number - 1], previous = 0.5 * (first + kink), kink
    n, used = 0, 0
    for k in range(steps + 1):
        position = start + step * k if k < steps else end
        while used < number and inside[used] < position:
            positions[n], n, used = inside[used], n + 1, used + 1
        beside = (used < number and inside[used] - position <= BESIDE_KINKS * step) or (
            used > 0 and position - inside[used - 1] <= BESIDE_KINKS * step
        )
        if k == 0 or k == steps or not beside:
            positions[n], n = position, n + 1
    return n


@unchecked
def _shares_of(grading, width):
    """Shares of the face of loaded widths (n_pair, 2) [m], and the size of the widest."""
    shares, widest = np.empty(width.shape), 0.0
    for k in range(len(width)):
        shares[k, 0], shares[k, 1] = compiled_share(grading, width[k, 0]), compiled_share(grading, width[k, 1])
        if shares[k, 1] - shares[k, 0] > widest:
            widest = shares[k, 1] - shares[k, 0]
    return shares, widest


@kept_unchecked
def slices_over(grading, slices, first, width, kinks):
    """Numbers of tooth pairs, axial ends low and high (n,) [m] of slices over loaded widths (n_pair, 2) [m].

    slices  number of slices of the modelled face
    first   number of the first tooth pair
    width   NaN for tooth pairs without load
    kinks   (n_pair, n) of `kink_shares`, at which slices end

    The widest gets `slices` times the fourth root of its share of the face; the numbers of the tooth pairs are in
    proportion to the square roots of their shares.
    """
    (shares, widest), longest, n = _shares_of(grading, width), slices + kinks.shape[1] + 2, 0
    number, positions = np.empty(len(width) * longest, np.int64), np.empty(longest)
    ends = np.empty((2, number.size))
    for k in range(len(width)):
        size = shares[k, 1] - shares[k, 0]
        if size >= 0:
            steps = max(1, ceil(slices / widest**0.25 * sqrt(size)))
            edges = write_with_kinks(shares[k, 0], shares[k, 1], steps, kinks[k], positions)
            for i in range(edges - 1):
                number[n], n = first + k, n + 1
                ends[0, n - 1] = compiled_axial(grading, positions[i])
                ends[1, n - 1] = compiled_axial(grading, positions[i + 1])
    return number[:n].copy(), ends[0, :n].copy(), ends[1, :n].copy()
