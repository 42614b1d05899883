"""Orders of a stage: mesh harmonics and side bands."""

import numpy as np

from exugear.running.run_data import stage_data
from exugear.signals.signal import mesh_order
from fem.support.arguments import checked
from fem.support.validation import require

#: Largest number of mesh harmonics, and of side bands of each.
MOST = 1000


@checked
def mesh_orders(run, stage: int | str = 0, *, harmonics: int = 3, side_bands: int = 0) -> np.ndarray:
    """Orders of the driving shaft at which a stage excites vibrations: mesh harmonics and their side bands.

    run           an `exugear.Run` or its data
    harmonics     number of mesh harmonics
    side_bands    number of side bands on either side of each, at multiples of the orders of the stage's two shafts

    Returns the distinct orders, rising. Raises ValueError for a shaft at rest and for numbers out of range.
    """
    require(1 <= harmonics <= MOST, f"harmonics must lie in [1, {MOST}], got {harmonics}")
    require(0 <= side_bands <= MOST, f"side_bands must lie in [0, {MOST}], got {side_bands}")
    data = stage_data(run, stage)
    mesh = mesh_order(data)
    require(mesh > 0, "run must turn its shafts, its speed is 0 throughout; pass a run at speed")
    mean = mesh * np.arange(1, harmonics + 1)
    label = data["stage"].item()
    teeth = [abs(data.attrs[f"{label}_{gear}_z"]) for gear in ("pinion", "wheel")] if side_bands else []
    bands = [np.arange(-side_bands, side_bands + 1) * mesh / z for z in teeth] or [np.zeros(1)]
    orders = np.concatenate([np.add.outer(mean, band).ravel() for band in bands])
    return np.unique(orders[orders > 0].round(9))
