"""Fourier sums over samples at any angle."""

import numpy as np

#: Half the width of the Gaussian that spreads samples over a grid [grid points]: amplitudes are exact to 1e-6.
SPREAD = 6


def fourier_sum(share: np.ndarray, values: np.ndarray, n: int) -> np.ndarray:
    """(n,) sums of values exp(-2 pi i k share), k = 0 to n - 1, over samples at any share of a period in [0, 1].

    The samples are spread by a Gaussian over a regular grid whose FFT is taken; exact to 1e-6 of the sum of the values'
    magnitudes. Source: Greengard and Lee, SIAM Review 46 (2004).
    """
    size = 4 * n
    tau, cell = SPREAD * np.pi / (12 * n**2), 2 * np.pi / size
    nearest = np.floor(share * size)
    off = 2 * np.pi * share - nearest * cell
    nearest = nearest.astype(int) % size
    growth = np.exp(off * cell / (2 * tau))
    spread = values * np.exp(-(off**2) / (4 * tau)) * growth ** (1 - SPREAD)
    grid = np.zeros(size)
    for k in range(1 - SPREAD, 1 + SPREAD):
        grid += np.exp(-((k * cell) ** 2) / (4 * tau)) * np.roll(np.bincount(nearest, spread, size), k)
        spread *= growth
    return np.sqrt(np.pi / tau) / size * np.exp(tau * np.arange(n) ** 2) * np.fft.rfft(grid)[:n]
