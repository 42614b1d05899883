"""Shares of the planets of a set in its load, and the mesh load factor K_gamma of ISO 6336-1."""

from typing import Any

import numpy as np
import xarray as xr

from exugear.running.run_data import stage_data
from fem.support.arguments import checked
from fem.support.validation import require


@checked
def planet_shares(run: Any, *, member: str | None = None, carrier: str | None = None) -> xr.Dataset:
    """Shares of the planets in the mesh forces on the sun or the ring of a planetary set along a run.

    run      `exugear.Run` of a gearbox with a set, or its data
    member   name of the shaft of the sun or of the ring; by default that of the first stage on a carrier, its sun
    carrier  name of the shaft of the planets' carrier, where the member meshes with planets of several, as the sun of a
             Simpson set does

    Returns a Dataset over `planet` and `time`: share (planet, time), mesh force over the sum over all planets, NaN
    while that is 0; mean_share (planet), mean force over the sum of the means; and K_gamma, their number times the
    largest mean_share: the factor of ISO 6336-1 by which the most loaded planet carries more than the mean.

    Raises ValueError for runs without planets, and for members that mesh with none or with those of several carriers.
    """
    stage_data(run)
    data = run if isinstance(run, xr.Dataset) else run.data
    require("planet" in data.coords, "run must be of a gearbox with a planetary set, this one has no planets")
    members = [name for name in dict.fromkeys(data["member"].values.tolist()) if name]
    chosen = members[0] if member is None else member
    require(chosen in members, f"member must be one of {members}, with which planets mesh, got {member!r}")
    of_member = data["member"].values == chosen
    carriers = np.array([data.attrs.get(f"{label}_carrier", "") for label in data["stage"].values.tolist()])
    on_carriers = list(dict.fromkeys(carriers[of_member].tolist()))
    several = f"{chosen!r} meshes with planets of the carriers {on_carriers}, got carrier {carrier!r}; name one of them"
    require(carrier in on_carriers or (carrier is None and len(on_carriers) == 1), several)
    of_member &= carriers == (carrier or on_carriers[0])
    forces = data["mesh_force"].values[of_member]
    total, means = forces.sum(axis=0), forces.mean(axis=1)
    shares = np.divide(forces, total, out=np.full_like(forces, np.nan), where=total != 0)
    mean_shares = means / means.sum() if means.sum() else np.full_like(means, np.nan)
    share = {"units": "1", "long_name": "share of the planet in the mesh forces"}
    factor = {"units": "1", "long_name": "mesh load factor K_gamma"}
    return xr.Dataset(
        {
            "share": (("planet", "time"), shares, share),
            "mean_share": ("planet", mean_shares, share | {"long_name": "share of the planet in the mean mesh forces"}),
            "K_gamma": ((), mean_shares.size * mean_shares.max(), factor),
        },
        {"planet": data["planet"].values[of_member], "time": data["time"]},
        {"member": chosen, "carrier": carrier or on_carriers[0]},
    )
