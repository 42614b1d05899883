"""Orders at which faults of gears show: once per turn of a gear, hunting tooth, planets that pass."""

from math import gcd, lcm

import numpy as np
import xarray as xr

from exugear.running.run_data import stage_data
from exugear.running.set_data import planetary_sets
from exugear.signals.signal import mesh_order, reference_speed
from fem.support.arguments import checked
from fem.support.validation import require


@checked
def fault_orders(
    run, stage: int | str = 0, *, turns_of: str | None = None, relative_to: str | None = None
) -> xr.DataArray:
    """Orders at which faults of a stage, or of the planetary set to which it belongs, show.

    run           an `exugear.Run` or its data
    stage         number or label of the stage
    turns_of, relative_to
                  shafts whose turns the orders count, as in `exugear.signal`; by default those of the driving shaft

    Returns a DataArray over cause, with its meaning in words: "mesh"; "pinion" and "wheel", once per turn against their
    carrier or the housing, distances of side bands and rates of impacts of a damaged tooth; "hunting tooth", at which
    the same two teeth meet again, mesh order / lcm(z_1, z_2); "assembly phase", mesh order / gcd(z_1, z_2), where this
    divisor is not 1. Of N planets also "planet pass", N turns of the carrier against the ring; "sun tooth" and "ring
    tooth", at which a damaged tooth meets planets; "planet tooth", at which a flank of a planet meets sun or ring:
    twice that where both flanks are damaged. Source: P. D. McFadden and J. D. Smith, Proc. Inst. Mech. Eng. C 199
    (1985) 65. Raises ValueError for shafts that do not turn.
    """
    data = stage_data(run, stage)
    mesh = mesh_order(data, reference_speed(data, turns_of, relative_to)[0])
    require(mesh > 0, "run must turn its shafts, its speed is 0 throughout; pass a run at speed")
    label = data["stage"].item()
    z_1, z_2 = (abs(int(data.attrs[f"{label}_{gear}_z"])) for gear in ("pinion", "wheel"))
    lines = {
        "mesh": (mesh, f"mesh of {label}"),
        "pinion": (mesh / z_1, f"a turn of the gear with z = {z_1} against its carrier or the housing"),
        "wheel": (mesh / z_2, f"a turn of the gear with z = {z_2} against its carrier or the housing"),
        "hunting tooth": (mesh / lcm(z_1, z_2), "the same two teeth meet again"),
    }
    if gcd(z_1, z_2) > 1:
        lines["assembly phase"] = (mesh / gcd(z_1, z_2), f"one of the {gcd(z_1, z_2)} groups of teeth that meet")
    whole = run if isinstance(run, xr.Dataset) else run.data
    for of_set in planetary_sets(whole):
        if label in (*of_set.sun_stages, *of_set.ring_stages):
            lines |= _of_planets(of_set, label, mesh)
    orders, words = zip(*lines.values(), strict=True)
    about = {"units": "1", "long_name": "order of the shaft"}
    return xr.DataArray(np.array(orders), {"cause": [*lines], "meaning": ("cause", [*words])}, ("cause",), attrs=about)


def _of_planets(of_set, label: str, mesh: float) -> dict[str, tuple[float, str]]:
    """Lines of the planets of a set; the mesh order of a stage of stepped planets is that of its own teeth."""
    z_sun, z_at_sun, z_at_ring, z_ring = map(abs, of_set.z)
    at_sun = mesh if label in of_set.sun_stages else mesh * z_at_sun / z_at_ring
    at_ring, planets = at_sun * z_at_ring / z_at_sun, of_set.angles.size
    return {
        "planet pass": (planets * at_ring / z_ring, f"{planets} planets pass a point of the ring {of_set.ring}"),
        "sun tooth": (planets * at_sun / z_sun, f"a tooth of the sun {of_set.sun} meets a planet"),
        "ring tooth": (planets * at_ring / z_ring, f"a tooth of the ring {of_set.ring} meets a planet"),
        "planet tooth": (at_sun / z_at_sun, "a flank of a planet's tooth meets sun or ring"),
    }
