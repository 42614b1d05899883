"""Compliance between points on the flanks by products of all hat functions, beside `fem.contact.coupling`."""

import numpy as np

import fem
from fem.elasticity.flank_compliance import Compliance, flank_compliance


def elastic_body(
    gear: fem.Gear, density: fem.Density, *, loaded: float | None = None, whole: bool = False
) -> Compliance:
    """Compliance of a gear whose face carries load over its width, or over a part of it around mid-plane [m]."""
    return flank_compliance(gear, density, gear.b if loaded is None else loaded, whole=whole)


def lines(tops: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """(n_hat, n) values at positions x (n,) of 1, x and max(x - top, 0): they span the hats, extended linearly."""
    return np.stack([np.ones_like(positions), positions, *np.maximum(positions - tops[1:-1, None], 0)])


def along(body: Compliance, arcs: np.ndarray) -> np.ndarray:
    """(n_hat, n) values of the hat functions along the profile at arcs (n,) [m]; linear beyond the ends."""
    return np.linalg.inv(lines(body.arcs, body.arcs)) @ lines(body.arcs, arcs)


def across(body: Compliance, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """(n_axial, n) mean values of the hat functions across the width over slices from low to high (n,) [m]."""
    kinks = body.axial[1:-1, None]
    below, above = (np.stack([z, z**2 / 2, *np.maximum(z - kinks, 0) ** 2 / 2]) for z in (low, high))
    return np.linalg.inv(lines(body.axial, body.axial)) @ ((above - below) / (high - low))


def normal(body: Compliance, ahead: int) -> np.ndarray:
    """(n_axial n_hat, n_axial n_hat) displacement into the tooth so far ahead of the loaded one [m/N]."""
    block = body.blocks[abs(ahead)].reshape(body.axial.size * body.arcs.size, -1)
    return block if ahead >= 0 else block.T


def tangential(body: Compliance, ahead: int) -> np.ndarray:
    """The same along the profile; teeth further behind take the values of the last computed tooth behind."""
    block = body.slide[max(0, ahead + len(body.slide) - len(body.blocks))]
    return block.reshape(body.axial.size * body.arcs.size, -1)


def coupling(bodies, axial: float, number, low, high, arcs, tilts) -> np.ndarray:
    """(n, n) displacement between points on slices of tooth pairs per force [m/N], without half-planes.

    axial       axial position of the wheel's mid-plane [m]
    arcs, tilts (2, n) arc lengths [m], and angles of the direction of contact from the normals [rad]
    """
    total = np.zeros((number.size, number.size))
    for side, body in enumerate(bodies):
        shift = side * axial
        weights = across(body, low - shift, high - shift)[:, None] * along(body, arcs[side])
        weights = weights.reshape(-1, number.size)
        for p in range(number.size):
            for q in range(number.size):
                ahead = int(number[p] - number[q]) * (-1) ** side
                if abs(ahead) <= body.pitches:
                    u = weights[:, p] @ (normal(body, ahead) - 2 * tilts[side, p] * tangential(body, ahead))
                    total[p, q] += u @ weights[:, q]
    return (total + total.T) / 2
