"""Orbits of members of a gearbox on their bearings, as a floating sun, over time and per turn of the carrier."""

from itertools import pairwise

import numpy as np
import xarray as xr

from exugear.running.run_data import stage_data
from exugear.running.set_data import planetary_sets
from exugear.signals.signal import angle_of_shaft, signal
from fem.support.arguments import checked
from fem.support.validation import require

#: Variables of runs that move in the plane: displacements of shafts, and forces on them.
RECORDED = {"displacement": "bearing_displacement", "force": "bearing_force"}
#: Displacement [m] up to which an orbit is rounding: less than an atom.
ROUNDING = 1e-10
#: Remedy where a run keeps no displacements.
RERUN = "run_up(..., displacement=True) records displacements"
TURN = {"units": "1", "long_name": "turn of the shaft"}


@checked
def member_orbit(
    run,
    member: str,
    *,
    frame: str | None = None,
    quantity: str = "displacement",
    turns_of: str | None = None,
    relative_to: str | None = None,
) -> xr.Dataset:
    """Orbit of a shaft on its bearings, as of a floating sun, or of a planet against its pin, along a run.

    run          an `exugear.Run` with displacement=True, or its data
    member       name of the shaft; of several bearings the mean counts. Or the name of a bearing: "sun at 0 mm"
    frame        name of a shaft with which the directions x and y turn, from the reference configuration on, such as
                 the carrier; by default those of the housing. Planets are seen from their carrier: x along the radius
                 of the pin, outwards, and y across it
    quantity     "displacement", or "force" of the bearing on the shaft
    turns_of, relative_to
                 shafts whose turns count, as in `exugear.signal`; by default of the set's carrier against its ring,
                 without a set those of the driving shaft

    Returns a Dataset: the quantity over direction (x, y) and time, a signal as of `exugear.signal`, and for every whole
    turn, over turn: mean (direction), radius, the largest distance from that mean, and speed, the mean one [rad/s].

    Raises ValueError for runs that do not hold the quantity, and for shafts without bearings.
    """
    stage_data(run)
    data = run if isinstance(run, xr.Dataset) else run.data
    require(quantity in RECORDED, f"quantity must be one of {[*RECORDED]}, got {quantity!r}")
    name = RECORDED[quantity]
    elastic = "run must have bearings or elastic pins, the shafts of this run only spin"
    require("bearing" in data.coords, elastic)
    require(name in data, f"run holds no displacements; {RERUN}, or take quantity='force'")
    bearings = data["bearing"].values.tolist()
    of_member = [x for x in bearings if member in (x, x.rpartition(" at ")[0])]
    shafts = list(dict.fromkeys(x.rpartition(" at ")[0] for x in bearings))
    require(bool(of_member), f"member must be one of the shafts on bearings {shafts} or of {bearings}, got {member!r}")
    shaft = of_member[0].rpartition(" at ")[0]
    sets = [x for x in planetary_sets(data) if shaft in (x.sun, x.ring, x.carrier, *x.planets)]
    if turns_of is None and relative_to is None and sets:
        turns_of, relative_to = sets[0].carrier, sets[0].ring
    moved = signal(run, name, turns_of=turns_of, relative_to=relative_to, bearing=of_member, direction=["x", "y"])
    orbit = moved.mean("bearing").assign_attrs(moved.attrs | {"long_name": f"{quantity} of {shaft}"})
    planets = [planet for x in sets for planet in x.planets]
    if frame is not None:
        of_planet = (
            f"frame must be left out for {shaft!r}: planets are seen from their carrier, along the radius of the pin"
        )
        require(shaft not in planets, f"{of_planet}, got {frame!r}")
        angle = angle_of_shaft(data, "frame", frame)
        cosine, sine = np.cos(angle), np.sin(angle)
        x, y = orbit.transpose("direction", "time").values
        orbit = orbit.transpose("direction", "time").copy(data=[cosine * x + sine * y, cosine * y - sine * x])
    attributes = {"member": member, "frame": frame or ("pin" if shaft in planets else "housing")}
    return xr.Dataset({quantity: orbit}).assign(_per_turn(orbit)).assign_attrs(attributes)


def stands_still(motion: xr.DataArray) -> bool:
    """Whether a displacement over direction and time [m] is rounding alone; forces are never."""
    return motion.attrs.get("units") == "m" and float(np.abs(motion).max()) < ROUNDING


def _per_turn(orbit: xr.DataArray) -> dict[str, tuple]:
    """Mean, radius and speed of every whole turn, as variables over turn."""
    turned = orbit["angle"].values / (2 * np.pi)
    whole = int(turned[-1] * (1 + 1e-9))
    edges = np.searchsorted(turned, np.arange(whole + 1) * (1 - 1e-9))
    edges[-1:] = min(edges[-1], turned.size - 1) if whole else edges[-1:]
    means, radii, speeds = [], [], []
    for first, last in pairwise(edges):
        points = orbit.transpose("direction", "time").values[:, first : last + 1]
        means.append(points.mean(axis=1))
        radii.append(np.hypot(*(points - points.mean(axis=1, keepdims=True))).max())
        speeds.append(orbit["speed"].values[first : last + 1].mean())
    units = {"units": orbit.attrs["units"]}
    return {
        "mean": (
            ("direction", "turn"),
            np.reshape(means, (whole, 2)).T,
            units | {"long_name": "mean over the turn"},
        ),
        "radius": ("turn", np.array(radii), units | {"long_name": "largest distance from the mean of the turn"}),
        "turn_speed": ("turn", np.array(speeds), {"units": "rad/s", "long_name": "mean speed in the turn"}),
        "turn": ("turn", np.arange(1, whole + 1), TURN),
    }
