"""Elastic rings in the data of a run: amplitudes of their modes, and the modes themselves."""

from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.elastic_ring import AT, FLANKS, MODE, ElasticRing
from exugear.multibody.model import Model
from fem.support.validation import require

#: Variables of `fem.ring_modes` in the data of runs, and their names there.
AROUND = "radial", "tangential", *FLANKS
RING_AT, RING = "ring_at", "ring_of_mode"


def ring_variables(model: Model, number: int) -> dict[str, Any]:
    """Variables over the modes of all elastic rings, of so many samples; none without such a ring."""
    rings = model.rings.values()
    if not rings:
        return {}
    points = max(ring.elastic.modes.sizes[AT] for ring in rings)
    motions = [ring.motion(number) for ring in rings]
    names = [ring.elastic.name for ring in rings for _ in range(ring.elastic.number)]
    amplitudes, rates = (np.concatenate(parts, axis=1).T for parts in zip(*motions, strict=True))
    each = {"frequency": "natural frequency of the ring alone", "lobes": "waves around the ring"}
    each |= {"turning": "inertia moment about the axis of the ring"}
    variables: dict[str, Any] = {
        "ring_amplitude": ((MODE, "time"), amplitudes, {"units": "m kg^0.5", "long_name": "amplitude of a ring mode"}),
        "ring_rate": ((MODE, "time"), rates, {"units": "m/s kg^0.5", "long_name": "rate of a ring mode"}),
    }
    for name, words in each.items():
        units = next(iter(rings)).elastic.modes[name].attrs["units"]
        values = np.concatenate([ring.elastic.modes[name].values for ring in rings])
        variables[f"ring_{name}"] = MODE, values, {"units": units, "long_name": words}
    for name in AROUND:
        values = np.concatenate([_on_points(ring.elastic.modes[name].values, points) for ring in rings])
        about = {"units": "kg^-0.5", "long_name": f"{name.replace('_', ' ')} displacement per amplitude of a ring mode"}
        variables[f"ring_{name}"] = (MODE, RING_AT), values, about
    ratios = np.repeat([ring.elastic.damping_ratio for ring in rings], [ring.elastic.number for ring in rings])
    variables["ring_damping_ratio"] = MODE, ratios, {"units": "1", "long_name": "damping ratio of a ring mode"}
    labels = [f"{name} {i}" for ring in rings for i, name in enumerate([ring.elastic.name] * ring.elastic.number, 1)]
    angles = 2 * np.pi * np.arange(points) / points
    coords = {MODE: (MODE, labels), RING: (MODE, names), RING_AT: (RING_AT, angles, {"units": "rad"})}
    return variables | coords


def _on_points(values: np.ndarray, points: int) -> np.ndarray:
    """(m, points) values around a ring on more points, by their trigonometric polynomial."""
    n = values.shape[1]
    return values if n == points else np.fft.irfft(np.fft.rfft(values), points) * points / n


def ring_of_run(data: xr.Dataset, name: str) -> tuple[ElasticRing, xr.Dataset] | None:
    """An elastic ring of a run by the name of its shaft, and the data of its modes; None of a ring without modes."""
    if RING not in data or name not in data[RING].values:
        return None
    of_ring = data.isel({MODE: np.flatnonzero(data[RING].values == name)})
    ratios = np.unique(of_ring["ring_damping_ratio"].values)
    require(ratios.size == 1, f"run must have one damping ratio for the modes of {name!r}, got {ratios}")
    modes = xr.Dataset({x: of_ring[f"ring_{x}"] for x in ("frequency", "lobes", "turning", *AROUND)}).rename(
        {RING_AT: AT}
    )
    return ElasticRing(name, modes, float(ratios[0])), of_ring
