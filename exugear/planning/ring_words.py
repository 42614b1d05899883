"""What a set holds of the bending of its ring between the planets, and what it leaves out, in words for the plan."""

from math import pi

import numpy as np
import xarray as xr

from exugear.gearbox.mesh_damping import mean_stiffness
from exugear.gearbox.planetary import Planetary
from fem.ste.ste_map import CROSS_COMPLIANCE

CLAMPED = "skipped: bending of the ring between the planets, which the maps of single meshes do not hold"
ADVICE = "give Planetary(ring_modes=fem.ring_modes(ring_pair)), by whose coordinates planets deflect one another"
#: Share of the deflection of a mesh from which coordinates are worth their time.
WORTH = 0.005


def words_of_ring(of_set: Planetary) -> str:
    """How the ring of a set bends between its planets."""
    modes, stage = of_set.ring_modes, of_set.stages[1]
    compliance = 1 / mean_stiffness(stage.force, stage.pair)
    if modes is None:
        table = _cross_compliance(of_set)
        if table is None:
            return CLAMPED
        share = _largest_between(table, of_set) / compliance
        left_out = f"skipped: through the rim of its ring another planet deflects a mesh by up to {share:.2%} of what"
        return f"{left_out} its own force does (static)" + (f"; {ADVICE}" if share > WORTH else "")
    low, high = (float(modes["frequency"][i]) for i in (0, -1))
    compliance += float(modes["flexibility"].mean())
    shares = [_largest_between(modes[name].values, of_set) / compliance for name in ("cross", "cross_left_out")]
    held = float((modes["flexibility"] / modes["bending"]).min())
    lowest = modes["lobes"].values[0]
    number, ratio = modes.sizes["ring_mode"], of_set.ring_damping_ratio
    return "; ".join([
        f"its ring vibrates in {number} modes of {low:.4g} to {high:.4g} Hz (the first of {lowest} lobes), damping "
        f"ratio {ratio:g}, which hold {held:.2%} of the bending of its rim and more, the map the rest",
        f"another planet deflects a mesh by up to {shares[0]:.2%} of what its own force does, of which the modes leave "
        f"out {shares[1]:.2%}",
    ])  # fmt: skip


def _cross_compliance(of_set: Planetary) -> np.ndarray | None:
    """(n,) of the map of the ring, None where its rim is clamped, or its law is a table."""
    maps = of_set.ring_mesh if isinstance(of_set.ring_mesh, list | tuple) else [of_set.ring_mesh]
    table = maps[0].attrs.get(CROSS_COMPLIANCE) if isinstance(maps[0], xr.Dataset) else None
    return None if table is None else np.asarray(table, float)


def _largest_between(table: np.ndarray, of_set: Planetary) -> float:
    """Largest magnitude of a table over even angles around the ring, at the angles between the planets of a set."""
    angles = np.array(of_set.angles)
    apart = np.subtract.outer(angles, angles)[~np.eye(angles.size, dtype=bool)]
    around = 2 * pi * np.arange(len(table) + 1) / len(table)
    return float(np.abs(np.interp(apart % (2 * pi), around, np.append(table, table[0]))).max(initial=0.0))
