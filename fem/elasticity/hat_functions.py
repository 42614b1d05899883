"""Hat functions on a line with given tops, of which loads and displacements along and across a flank are sums."""

import numpy as np


def hat(positions: np.ndarray, tops: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Sum of hat functions with the given tops, weighted by values; 0 outside."""
    return np.interp(positions, tops, values, left=0.0, right=0.0)


def hats(tops: np.ndarray, positions: np.ndarray) -> np.ndarray:
    """(n_hat, ...) values of the hat functions with the given tops; the outer two are constant beyond their tops."""
    return np.stack([np.interp(positions, tops, row) for row in np.eye(tops.size)])


def products(tops: np.ndarray) -> np.ndarray:
    """(n, n) integrals of products of two of the hats (mass matrix); their sums are the integrals of the hats."""
    size = np.diff(tops)
    return np.diag(np.append(size, 0.0) + np.append(0.0, size)) / 3 + (np.diag(size, 1) + np.diag(size, -1)) / 6


def overlap(tops: np.ndarray) -> np.ndarray:
    """(n, n) mean over a hat of the line load of a unit force that is spread as another hat [1/m]."""
    mass = products(tops)
    return mass / np.outer(mass.sum(axis=0), mass.sum(axis=0))


def spread(tops: np.ndarray, reach: float, *, odd: bool = False) -> np.ndarray:
    """(n, n) as `overlap`, for displacements that decay along the line as exp(-distance / reach) from their load [1/m].

    odd         whether the mirrored loads beyond the first top are opposite instead of equal; none lie beyond the last

    Under a uniform load the result is that of `overlap`, which is the limit of reach 0.
    """
    mass, size, free = products(tops), np.diff(tops), slice(1 if odd else 0, None)
    slopes = np.diff(np.eye(tops.size), axis=0)
    decaying = mass + reach**2 * slopes.T @ (slopes / size[:, None])
    u = mass[:, free] @ np.linalg.solve(decaying[free, free], mass[free])
    return u / np.outer(mass.sum(axis=0), mass.sum(axis=0))


def values_of_means(tops: np.ndarray) -> np.ndarray:
    """(n, n) values at the tops of the sum of hats which has given means over the hats (projection in L2)."""
    mass = products(tops)
    return np.linalg.solve(mass, np.diag(mass.sum(axis=1)))
