"""Frictionless unilateral contact of two gears at one phase and load: compliance of the strips, active set, state."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from fem.compliance import Compliance
from fem.gap import STRIPS, WINDOW, Deviation, Flanks, flanks_at
from fem.gear import GearPair
from fem.hertz import flattening, half_width, log_mean

#: Pairs that nearly touch join at once [m].
NEAR = 1e-9


@dataclass(frozen=True)
class Contact:
    """Compliance matrix (n, n) [m/N], gap (n,) [m] and approach (n,) of all potential contact strips.

    expected    (n,) whether a strip lies where Hertz expects the contact
    """

    matrix: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    expected: np.ndarray

    def solve(self, force: float) -> tuple[float, np.ndarray]:
        """Transmission error [m] and strip forces (n,) [N] with approach . f = force (primal-dual active set).

        Raises RuntimeError where no active set settles.
        """
        active = self.expected
        rng = np.random.default_rng(0)
        for step in range(200):
            delta, f = self._with_active(active, force)
            slack = self.matrix @ f + self.gap - self.approach * delta
            wanted = np.where(active, f > 0, slack < 0)
            if (wanted == active).all():
                return delta, f
            settled = step < 30
            active = wanted if settled else np.where(rng.random(active.size) < 0.5, wanted, active)
            if not active.any():
                active[np.argmin(slack)] = True
        raise RuntimeError("contact did not settle in 200 active sets; try a neighbouring phase or a finer density")

    def _with_active(self, active: np.ndarray, force: float) -> tuple[float, np.ndarray]:
        factor = cho_factor(self.matrix[np.ix_(active, active)], lower=True, check_finite=False)
        approach, gap = self.approach[active], self.gap[active]
        per_approach, per_gap = cho_solve(factor, np.stack([approach, gap], axis=1), check_finite=False).T
        delta = (force + approach @ per_gap) / (approach @ per_approach)
        f = np.zeros(active.size)
        f[active] = per_approach * delta - per_gap
        return float(delta), f


def assemble(flanks: list[Flanks], pinion: Compliance, wheel: Compliance, reach: list[float]) -> Contact:
    """Contact of the given pairs of teeth over half the face width; unknowns ordered (pair, slice, strip)."""
    strips = [one.strips(r) for one, r in zip(flanks, reach, strict=True)]
    slices = pinion.slices.size - 1
    blocks = np.empty((len(flanks), slices, STRIPS, len(flanks), slices, STRIPS))
    weights = [[interpolation(body.arcs, s[0][side]) for s in strips] for side, body in ((0, pinion), (1, wheel))]
    for p, one in enumerate(flanks):
        for q, other in enumerate(flanks[: p + 1]):
            ahead = one.pair - other.pair
            block = spread(pinion, ahead, weights[0][p], weights[0][q])
            block = block + spread(wheel, -ahead, weights[1][p], weights[1][q])
            blocks[p, :, :, q] = block
            blocks[q, :, :, p] = block.transpose(2, 3, 0, 1)
        local = local_compliance(one, strips[p][0], strips[p][3])
        for z, width in enumerate(np.diff(pinion.slices)):
            blocks[p, z, :, p, z] += local / width
    n = len(flanks) * slices * STRIPS
    matrix = blocks.reshape(n, n)
    gap, closing = (np.concatenate([np.broadcast_to(s[i], (slices, STRIPS)).ravel() for s in strips]) for i in (1, 2))
    expected = np.concatenate(
        [np.tile(one.expected(s[0], r), slices) for one, s, r in zip(flanks, strips, reach, strict=True)]
    )
    return Contact((matrix + matrix.T) / 2, gap, closing, expected)


def interpolation(arcs: np.ndarray, at: np.ndarray) -> np.ndarray:
    """(n_hat, n) values of the hats with tops at arcs."""
    i = np.clip(np.searchsorted(arcs, at) - 1, 0, arcs.size - 2)
    share = (at - arcs[i]) / (arcs[i + 1] - arcs[i])
    weights = np.zeros((arcs.size, at.size))
    weights[i, np.arange(at.size)], weights[i + 1, np.arange(at.size)] = 1 - share, share
    return weights


def spread(body: Compliance, ahead: int, here: np.ndarray, there: np.ndarray) -> np.ndarray:
    """(slice, strip, slice, strip) compliance between strips here and strips there, on a tooth ahead of theirs."""
    block = body.blocks[ahead] if ahead >= 0 else body.blocks[-ahead].transpose(2, 3, 0, 1)
    return np.einsum("zhys,hn->znys", block @ there, here, optimize=True)


def local_compliance(flanks: Flanks, arcs: np.ndarray, width: float) -> np.ndarray:
    """(n, n) flattening of both flanks as half-planes, per slice of unit width [m^2/N]."""
    own = arcs[0] if flanks.own_is_pinion else arcs[1]
    both = flattening(flanks.own.material) + flattening(flanks.mate.material)
    return both * log_mean(own[:, None] - own, width, width)


@dataclass(frozen=True)
class State:
    """What one contact solve found.

    te          static transmission error in mid-plane [m]
    pairs       (n_pair,) numbers of the pairs of teeth that were considered
    load        (n_pair, n_slice, STRIPS) forces on the strips [N]
    widths      (n_pair,) widths of a strip [m]
    slices      (n_slice + 1,) edges of the slices [m]
    """

    te: float
    pairs: tuple[int, ...]
    load: np.ndarray
    widths: np.ndarray
    slices: np.ndarray

    def share(self) -> np.ndarray:
        """(n_pair,) share of the load that each pair carries; 0 without load."""
        per_pair = self.load.sum(axis=(1, 2))
        return per_pair / max(per_pair.sum(), np.finfo(float).tiny)

    def peak_pressure(self) -> float:
        """Largest contact pressure [Pa]."""
        areas = self.widths[:, None, None] * np.diff(self.slices)[:, None]
        return float((self.load / areas).max(initial=0.0))

    def centroid(self) -> float:
        """Axial place of the resultant force [m]; 0 without load and where both halves carry the same."""
        if self.slices[0] == 0:
            return 0.0
        per_slice, middle = self.load.sum(axis=(0, 2)), (self.slices[1:] + self.slices[:-1]) / 2
        return float(per_slice @ middle / max(per_slice.sum(), np.finfo(float).tiny))


def state_at(
    pair: GearPair, pinion: Compliance, wheel: Compliance, phase: float, force: float, misalignment: float = 0.0
) -> State:
    """Contact at one phase under the mesh force force >= 0 [N].

    misalignment    angle in the plane of action by which the gap opens towards positive z [rad]

    Raises RuntimeError where the contact does not settle.
    """
    candidates = flanks_at(pair, phase, Deviation(pair, misalignment, pinion.slices))
    nothing = np.zeros((0, pinion.slices.size - 1, STRIPS))
    state = State(candidates[0].separation, (), nothing, np.zeros(0), pinion.slices)
    while force > 0:
        reached = sum(flanks.separation <= state.te + NEAR for flanks in candidates)
        if reached <= len(state.pairs):
            break
        state = _pressed_together(candidates[:reached], pinion, wheel, force)
    return state


def transmission_error(
    pair: GearPair, pinion: Compliance, wheel: Compliance, phase: float, force: float, misalignment: float = 0.0
) -> float:
    """Static transmission error of `state_at` [m]."""
    return state_at(pair, pinion, wheel, phase, force, misalignment).te


def _pressed_together(flanks: list[Flanks], pinion: Compliance, wheel: Compliance, force: float) -> State:
    """Contact of the given pairs of teeth, on strips wide enough to hold it."""
    hertz = [half_width(force / pinion.width, one.radius, one.own.material, one.mate.material) for one in flanks]
    for window in (WINDOW, 2 * WINDOW, 4 * WINDOW):
        reach = [window * half for half in hertz]
        te, f = assemble(flanks, pinion, wheel, reach).solve(force * pinion.share)
        load = f.reshape(len(flanks), -1, STRIPS)
        if not any(one.spills(r, forces) for one, r, forces in zip(flanks, reach, load, strict=True)):
            widths = np.array([one.strips(r)[3] for one, r in zip(flanks, reach, strict=True)])
            return State(te, tuple(one.pair for one in flanks), load, widths, pinion.slices)
    raise RuntimeError("contact is wider than four Hertzian widths; the load is beyond what the teeth can carry")
