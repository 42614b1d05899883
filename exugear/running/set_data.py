"""The planetary sets of a run: members, planets, teeth and phases, from the labels and attributes of its data."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from fem.support.validation import require


class SetData(NamedTuple):
    """A planetary set of a run, by the names of its shafts.

    sun, ring     "" where the planets of the carrier mesh with no sun, or with no ring
    planets       in the order of their stages
    angles        (n_planet,) of the planets about the sun in the reference configuration [rad]
    z             teeth of sun, planet at the sun, planet at the ring, and ring (< 0); 0 of what is missing
    sun_stages    labels of the meshes with the sun, in the order of the planets
    ring_stages   of those with the ring
    sun_phases, ring_phases
                  (n_planet,) of these meshes in the reference configuration, as shares of a pitch
    """

    carrier: str
    sun: str
    ring: str
    planets: tuple[str, ...]
    angles: np.ndarray
    z: tuple[int, int, int, int]
    sun_stages: tuple[str, ...]
    ring_stages: tuple[str, ...]
    sun_phases: np.ndarray
    ring_phases: np.ndarray


def carriers_of_run(data: xr.Dataset) -> list[str]:
    """Names of the carriers of the planets of a run."""
    carriers = (data.attrs.get(f"{label}_carrier") for label in np.ravel(data["stage"].values).tolist())
    return list(dict.fromkeys(str(carrier) for carrier in carriers if carrier))


def planetary_sets(data: xr.Dataset) -> list[SetData]:
    """The sets of a run that have one sun and one ring; others, as that of Ravigneaux, are left out."""
    if "planet" not in data.coords:
        return []
    labels, planets, members = (data[name].values.tolist() for name in ("stage", "planet", "member"))
    stages = dict(zip(labels, zip(planets, members, strict=True), strict=True))
    sets = []
    for carrier in carriers_of_run(data):
        of_carrier = {x: ends for x, ends in stages.items() if data.attrs.get(f"{x}_carrier") == carrier}
        if any(member in planets for _, member in of_carrier.values()):
            continue
        sides: dict[bool, dict[str, tuple[str, str]]] = {True: {}, False: {}}
        for label, ends in of_carrier.items():
            sides[data.attrs[f"{label}_wheel_z"] < 0][label] = ends
        if all(len({member for _, member in side.values()}) == 1 for side in sides.values()):
            sets.append(_set_of(data, carrier, sides[False], sides[True]))
    return sets


def _set_of(data: xr.Dataset, carrier: str, at_sun: dict, at_ring: dict) -> SetData:
    """The set of a carrier; stage -> (planet, member) with the sun and with the ring."""
    (sun,), (ring,) = ({member for _, member in side.values()} for side in (at_sun, at_ring))
    first, last = next(iter(at_sun)), next(iter(at_ring))
    names = [(first, "pinion"), (first, "wheel"), (last, "pinion"), (last, "wheel")]
    z = tuple(int(data.attrs[f"{label}_{gear}_z"]) for label, gear in names)
    phases = [np.array([data.attrs.get(f"{x}_phase", np.nan) for x in side]) for side in (at_sun, at_ring)]
    angles = np.array([data.attrs[f"{label}_angle"] for label in at_sun])
    planets = tuple(planet for planet, _ in at_sun.values())
    return SetData(carrier, sun, ring, planets, angles, z, tuple(at_sun), tuple(at_ring), *phases)  # type: ignore


def set_of_run(data: xr.Dataset, argument: str, name: str | None) -> SetData:
    """The set of a run of which a shaft is the ring, or else sun, carrier or planet; without a name the only one."""
    sets = planetary_sets(data)
    require(bool(sets), "run must be of a gearbox with a planetary set of one sun and one ring, this one has none")
    if name is None:
        several = f"{argument} must name a shaft of one of the sets on the carriers {[x.carrier for x in sets]}"
        require(len(sets) == 1, several)
        return sets[0]
    members = [shaft for x in sets for shaft in (x.sun, x.ring, x.carrier, *x.planets)]
    require(name in members, f"{argument} must be a shaft of a set, one of {members}, got {name!r}")
    of_name = [x for x in sets if name == x.ring] or [x for x in sets if name in (x.sun, x.carrier, *x.planets)]
    several = f"{name!r} belongs to the sets on the carriers {[x.carrier for x in of_name]}; name another shaft of one"
    require(len(of_name) == 1, f"{argument} must tell one set: {several}")
    return of_name[0]
