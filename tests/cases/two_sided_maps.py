"""Maps whose right flanks are softer than the left ones."""

import numpy as np
import xarray as xr
from paper_gears import paper_pair

import fem
from fem.units import mm

TILTS = np.array([-3e-4, 0.0, 1e-4])


def flank_te(torque, phase, tilt=0.0, *, softer: float) -> np.ndarray:
    """te [m] of a flank, te by load, phase and misalignment."""
    force = np.asarray(torque, float) / paper_pair().pinion.r_b
    wave = 1 + 0.2 * np.cos(2 * np.pi * (phase - 0.1)) + 0.05 * np.sin(4 * np.pi * phase)
    return softer * 3e-9 * force * wave * (1 + 200 * tilt) + 1e3 * np.abs(tilt - 1e-4) * 0.01 * mm


def both_sides(tilts=None) -> xr.Dataset:
    """A map whose right flanks are softer; the right ones at their phases, with z the same way on both sides."""
    pair, phase = paper_pair(), np.arange(24) / 24
    torque = np.array([-700.0, -350.0, -100.0, 0.0, 100.0, 350.0, 700.0])
    right = (pair.back_phase - phase) % 1.0
    grid = (torque[:, None], phase) if tilts is None else (torque[:, None, None], phase, tilts[:, None])
    other = (grid[0], right, *grid[2:])
    te = np.where(grid[0] >= 0, flank_te(*grid, softer=1.0), -flank_te(-other[0], *other[1:], softer=1.4))
    axes = {} if tilts is None else {"misalignment": tilts}
    ste = fem.ste_map(pair, torque, phase, te, axes)
    unloaded = -flank_te(0.0, right, *(x for x in other[2:]), softer=1.4)
    return ste.assign(te_unloaded_right=(ste["te"].dims[1:], np.broadcast_to(unloaded, te.shape[1:])))
