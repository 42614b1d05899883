"""Contact ratio under load: pitches over which a tooth pair carries load, continuous between the phases of a map.

A tooth pair carries load where its flanks overlap under the transmission error and the displacements by the loads on
the other tooth pairs. `ToothContact` gives this overlap at each phase. In a step between two phases in which a contact
begins or ends, displacements and transmission error are interpolated, while the gap of the rigid flanks, which opens
fast beyond the path of contact, is evaluated: the contact begins or ends where the overlap is 0.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fem.contact.closest_point import closest_in_kernels
from fem.contact.contact_state import TINY
from fem.contact.mesh_geometry import PairGeometry, PairRecords
from fem.support.numba_cache import kept_unchecked

#: Sections across the face among which the first touch is sought, and rounds of the search around it: the distance
#: between sections shrinks by 3 in each round.
SECTIONS, ROUNDS, AROUND = 5, 3, np.array([-2, -1, 1, 2]) / 3
#: Halvings of a step in which a contact begins or ends; between the last two positions the overlap is linear.
HALVINGS = 5
#: Clearances below this share of te are evaluated about te: tip corners come closer than linearly, by 3 % of te.
NEARLY = 0.1


class Positions(NamedTuple):
    """Tooth pairs at n mesh positions: phase, number of the tooth pair, misalignment in the plane of action [rad]."""

    phase: np.ndarray
    number: np.ndarray
    misalignment: np.ndarray


@dataclass(frozen=True)
class RigidFlanks:
    """Flanks of a pair at one centre distance and axial offset of the wheel.

    mesh        the two gears for compiled code, at any phase
    face        (m,) axial positions among which the flanks may touch first, increasing [m]; one: the gap is even
    about_te    whether gaps are linearized about the transmission error, as those of strips; about 0 otherwise
    """

    mesh: PairGeometry
    face: np.ndarray
    about_te: bool

    def first_touch(self, positions: Positions) -> tuple[np.ndarray, np.ndarray]:
        """Transmission errors (n,) at which tooth pairs touch without load, and where across the face (n,) [m]."""
        n, m = positions.phase.size, self.face.size
        face = np.repeat(self.face[None], n, axis=0)
        return self._touch(positions, face, np.zeros(n), ROUNDS if m > 1 else 0)

    def touch(self, positions: Positions, sections: Iterable[np.ndarray], te: np.ndarray) -> np.ndarray:
        """The same (n,) at sections of axial positions (n,) [m], under transmission errors te (n,) [m]."""
        across = np.stack(list(sections)[: self.face.size], axis=1)
        return self._touch(positions, across, te if self.about_te else np.zeros(te.size), 0)[0]

    def _touch(self, positions: Positions, across: np.ndarray, te: np.ndarray, rounds: int):
        records = np.full(te.size, self.mesh.geometry.position)
        records["phase"] = positions.phase
        return self.mesh.call(first_touch, records, positions.number, positions.misalignment, across, te, rounds)


@kept_unchecked
def first_touch(mesh, records, number, misalignment, across, te, rounds):
    """First touch (n,) of `RigidFlanks` and its axial positions (n,) [m] at POSITION records (n,).

    across      (n, m) axial positions of sections [m]
    te          (n,) transmission errors about which gaps are linearized [m]
    rounds      number of rounds of a search around the section that touches first
    """
    touch, where = np.full(number.size, np.inf), across[:, 0].copy()
    for k in range(number.size):
        at = PairRecords(records[k], mesh.gears, mesh.pinion, mesh.wheel, mesh.table)
        sections, low, high = across[k], across[k, 0], across[k, -1]
        distance = (high - low) / max(sections.size - 1, 1)
        for rounds_left in range(rounds, -1, -1):
            n = sections.size
            closest = closest_in_kernels(at, np.full(n, number[k]), sections, sections, np.full(n, te[k]))
            for i in range(n):
                gap = closest[2, i] + mesh.position.inclined * misalignment[k] * sections[i]
                if gap / closest[3, i] < touch[k]:
                    touch[k], where[k] = gap / closest[3, i], sections[i]
            if rounds_left:
                sections = np.empty(AROUND.size)
                for i in range(AROUND.size):
                    sections[i] = min(max(where[k] + distance * AROUND[i], low), high)
                distance /= 3
    return touch, where


class Steps(NamedTuple):
    """n steps between neighbouring phases, in each of which a tooth pair comes into contact or leaves it.

    begins          (n,) whether it comes into contact
    phase           (n, 4) phases before the step, at its beginning and end, and after it
    te              (n, 4) transmission errors there [m]
    overlap         (n, 2) overlap of the flanks at beginning and end [m]; NaN where it is beyond reach
    number          (n,) tooth pairs
    misalignment    (n,) in the plane of action [rad]
    """

    begins: np.ndarray
    phase: np.ndarray
    te: np.ndarray
    overlap: np.ndarray
    number: np.ndarray
    misalignment: np.ndarray

    def at(self, phase: np.ndarray) -> Positions:
        """The tooth pairs at phases (n,)."""
        return Positions(phase, self.number, self.misalignment)


def loaded_pitches(
    flanks: RigidFlanks,
    misalignment: np.ndarray,
    phase: np.ndarray,
    pitches: int,
    first: int,
    te: np.ndarray,
    overlap: np.ndarray,
) -> np.ndarray:
    """(m,) pitches over which a tooth pair carries load, the mean over the tooth pairs, of m loads and offsets.

    misalignment    (m,) in the plane of action [rad]
    phase           (n,) increasing phases, which run over a number of pitches
    first           number of the first tooth pair
    te              (m, n) transmission errors [m]
    overlap         (m, n_pair, n) overlap of the flanks of each tooth pair as `ToothContact` gives it [m]
    """
    (m, pairs, n), rest = overlap.shape, -overlap.shape[1] % pitches
    rows = np.concatenate([overlap, np.full((m, rest, n), np.nan)], axis=1).reshape(m, -1, pitches, n)
    passing = np.moveaxis(rows, 2, 1).reshape(m, pitches, -1)  # after all pitches of the map, a pair is the one ahead
    path = (pitches * np.arange((pairs + rest) // pitches)[:, None] + phase).ravel()
    loaded = passing > 0
    if flanks.about_te:
        clear = np.nonzero(~loaded & (passing > -NEARLY * np.tile(te, path.size // n)[:, None]))
        state, pitch, at = clear
        positions = Positions(phase[at % n], first + pitch + pitches * (at // n), misalignment[state])
        touch, where = flanks.first_touch(positions)
        loaded[clear] = passing[clear] + touch > flanks.touch(positions, [where], te[state, at % n])
    state, pitch, at = np.nonzero(loaded[..., 1:] != loaded[..., :-1])
    row, at_phase = np.divmod(at[:, None] % n + np.arange(-1, 3), n)
    steps = Steps(
        begins=loaded[state, pitch, at + 1],
        phase=phase[at_phase] + pitches * row,
        te=te[state[:, None], at_phase],
        overlap=passing[state[:, None], pitch[:, None], at[:, None] + [0, 1]],
        number=first + pitch + pitches * (at // n),
        misalignment=misalignment[state],
    )
    length = (loaded[..., 1:] & loaded[..., :-1]).sum(axis=1) @ np.diff(path)
    np.add.at(length, state, np.diff(path)[at] * _loaded_shares(flanks, steps))
    return length / pitches


def _loaded_shares(flanks: RigidFlanks, steps: Steps) -> np.ndarray:
    """(n,) shares of steps over which the tooth pair carries load, sought between their loaded and unloaded ends."""
    ends, n = steps.phase[:, 1:3].T, steps.begins.size
    touch, where = flanks.first_touch(Positions(ends.ravel(), np.tile(steps.number, 2), np.tile(steps.misalignment, 2)))
    displaced, sections = steps.te[:, 1:3].T - steps.overlap.T - touch.reshape(2, n), where.reshape(2, n)
    displaced = np.where(np.isnan(displaced), displaced[::-1], displaced)
    te_between = _between(steps.phase, steps.te)

    def overlap(loaded_share: np.ndarray) -> np.ndarray:
        share = np.where(steps.begins, 1 - loaded_share, loaded_share)
        phase, lag, section = (begin + share * (end - begin) for begin, end in (ends, displaced, sections))
        te = te_between(share)
        return te - lag - flanks.touch(steps.at(phase), [section, *sections], te)

    low, high = np.zeros(n), np.ones(n)
    loaded, unloaded = np.maximum(overlap(low), TINY), np.minimum(overlap(high), 0.0)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        at_middle = overlap(middle)
        touches = at_middle > 0
        low, loaded = np.where(touches, middle, low), np.where(touches, at_middle, loaded)
        high, unloaded = np.where(touches, high, middle), np.where(touches, unloaded, at_middle)
    return low + (high - low) * loaded / (loaded - unloaded)


def _between(x: np.ndarray, y: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """Function of shares (n,) of the steps from x[:, 1] to x[:, 2] that interpolates y (n, 4) there, with a kink.

    The lines through the first two points and through the last two, where they cross within the step; otherwise the
    line from its beginning to its end.
    """
    slope, step = np.diff(y) / np.diff(x), x[:, 2] - x[:, 1]
    before, line, after = slope[:, 0] * step, y[:, 2] - y[:, 1], slope[:, 2] * step
    peak, dip = (before > line) & (after < line), (before < line) & (after > line)

    def at(share: np.ndarray) -> np.ndarray:
        rising, falling = y[:, 1] + before * share, y[:, 2] - after * (1 - share)
        kinked = np.where(peak, np.minimum(rising, falling), np.maximum(rising, falling))
        return np.where(peak | dip, kinked, y[:, 1] + line * share)

    return at
