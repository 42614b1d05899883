"""Mesh harmonics of the transmission error: amplitudes and angles over torque and offsets."""

import numpy as np
import xarray as xr

from fem.ste.ste_map import PHASE, TE, check, check_whole_cycle
from fem.support.arguments import checked
from fem.support.validation import require


@checked
def te_harmonics(ste: xr.Dataset, harmonics: int = 5) -> xr.Dataset:
    """Mesh harmonics of the transmission error over (torque, *offsets, harmonic).

    ste         map of one or several pitches, in which they are averaged
    harmonics   number of harmonics, below half the number of phases in a pitch

    "amplitude" [m] and "angle" [rad]: te = mean + sum(amplitude cos(2 pi harmonic phase + angle)). The integrals over
    the mesh cycle are those of straight lines between the phases; at equidistant phases they are the discrete Fourier
    transform. Raises ValueError where the map has too few phases, or only a part of the mesh cycle.
    """
    te = check_whole_cycle(check(ste))[TE]
    phase, pitches = te[PHASE].values, int(ste.attrs.get("pitches", 1))
    most = (phase.size // pitches - 1) // 2
    few = f"ste must have 3 phases or more in a pitch for its first harmonic, got {phase.size} in {pitches} pitches"
    require(most >= 1, few)
    fewer = f"harmonics must lie in [1, {most}], below half the number of phases in a pitch, got {harmonics}"
    require(1 <= harmonics <= most, fewer)
    ahead = np.diff(phase, append=phase[0] + pitches)
    weights = (ahead + np.roll(ahead, 1)) / pitches
    order = np.arange(1, harmonics + 1)
    waves = weights[:, None] * np.exp(-2j * np.pi * np.outer(phase, order))
    values = te.transpose(..., PHASE).values @ waves
    over = (*(name for name in te.dims if name != PHASE), "harmonic")
    variables = {
        "amplitude": (over, np.abs(values), {"units": "m", "long_name": "amplitude of the transmission error"}),
        "angle": (over, np.angle(values), {"units": "rad", "long_name": "angle of the harmonic at phase 0"}),
    }
    axis = {"harmonic": ("harmonic", order, {"units": "1", "long_name": "mesh order"})}
    return xr.Dataset(variables, {name: te[name] for name in over[:-1]} | axis)
