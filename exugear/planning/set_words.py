"""What the model of a planetary set holds and what it leaves out, in words for the plan."""

from collections.abc import Mapping
from math import isfinite, pi

import numpy as np
import xarray as xr

from exugear.gearbox.elastic_carrier import common_twist, series_error
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.mesh_damping import mean_stiffness
from exugear.gearbox.planetary import Planetary
from exugear.planning.coordinates import Coordinates
from fem.ste.ste_map import CROSS_COMPLIANCE, CROSS_LEFT_OUT

CLAMPED = "skipped: bending of the ring between the planets, which the maps of single meshes do not hold"
#: Share of the deflection of a mesh from which coordinates are worth their time, and that they may leave out.
WORTH = 0.005


def stages_of_sets(gearbox: Gearbox) -> dict[str, tuple[str, ...]]:
    """Labels of the stages on each carrier, by its name."""
    by_carrier: dict[str, tuple[str, ...]] = {}
    for label, stage in zip(gearbox.labels, gearbox.stages, strict=True):
        if stage.carrier:
            by_carrier[stage.carrier.name] = (*by_carrier.get(stage.carrier.name, ()), label)
    return by_carrier


def words_of_sets(gearbox: Gearbox, kinds: Mapping[str, Coordinates]) -> dict[str, str]:
    """What is modelled of each set and what is skipped, with the reason, by the name of its carrier.

    kinds   coordinates of each shaft
    """
    words = {}
    for carrier in stages_of_sets(gearbox):
        on_carrier = [stage for stage in gearbox.stages if stage.carrier and stage.carrier.name == carrier]
        shafts = dict.fromkeys(shaft.name for stage in on_carrier for shaft in stage.shafts)
        planets = [name for name in shafts if name in gearbox.planets]
        members = [name for name in shafts if name not in gearbox.planets]
        words[carrier] = "; ".join([
            _words_of_planets(planets, kinds),
            _words_of_members(members, kinds),
            *_words_of_phases(gearbox, carrier),
            *[_words_of_ring(of_set) for of_set in gearbox.sets if of_set.carrier.name == carrier],
            _words_of_carrier(gearbox, carrier),
        ])  # fmt: skip
    return words


def _words_of_carrier(gearbox: Gearbox, carrier: str) -> str:
    """How a carrier yields."""
    stiffness, planets = gearbox.elastic_carriers.get(carrier), gearbox.planets_by_carrier.get(carrier, [])
    if stiffness is None:
        return "skipped: bending of the carrier (no carrier_stiffness given)"
    error = f"{100 * series_error(stiffness, planets):.2g} % of the energy of the pins"
    twist = common_twist(stiffness, gearbox.arms_of_pins)
    error += f", among it their common twist of {twist:.3g} N m/rad" if isfinite(twist) else ""
    return f"the carrier yields in series with each pin: skipped is how pins move one another, {error}"


def _words_of_planets(planets: list[str], kinds: Mapping[str, Coordinates]) -> str:
    number = f"{len(planets)} planets"
    if all(kinds[name] is Coordinates.SPIN for name in planets):
        return f"{number} on ideal pins (no pin= given): skipped is how pins yield and share the load"
    if all(kinds[name] is Coordinates.PLANAR for name in planets):
        return f"{number} on elastic pins move in the plane: skipped are tilt and axial motion, which nothing excites"
    return f"{number} on elastic pins move and tilt in space"


def _words_of_members(members: list[str], kinds: Mapping[str, Coordinates]) -> str:
    ideal = [name for name in members if kinds[name] is Coordinates.SPIN]
    floating = [name for name in members if name not in ideal]
    texts = [f"{', '.join(floating)} on bearings move sideways"] if floating else []
    if ideal:
        texts.append(f"{', '.join(ideal)} on ideal axes (no bearings given): skipped is how they move sideways")
    return ", ".join(texts)


def _words_of_phases(gearbox: Gearbox, carrier: str) -> list[str]:
    """Meshing sequence of a set that was given as data."""
    return [of_set.words[0] for of_set in gearbox.sets if of_set.carrier.name == carrier]


def _words_of_ring(of_set: Planetary) -> str:
    """How the ring of a set bends between its planets."""
    modes, stage = of_set.ring_modes, of_set.stages[1]
    compliance = 1 / mean_stiffness(stage.force, stage.pair)
    if modes is None:
        table = _listed_around(of_set, CROSS_COMPLIANCE)
        if table is None:
            return CLAMPED
        share = _largest_between(table, of_set) / compliance
        left_out = f"skipped: through the rim of its ring another planet deflects a mesh by up to {share:.2%} of what"
        advice = f"; {_advice(of_set, table.size, compliance)}" if share > WORTH else ""
        return f"{left_out} its own force does (static){advice}"
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


def _advice(of_set: Planetary, angles: int, compliance: float) -> str:
    """The fewest ring modes by whose coordinates planets of a set deflect one another, but for a share `WORTH`.

    Modes that bend a rim in few lobes are not all: those that stretch it lie among them, and between bolts modes of
    many lobes mix. So the map lists what each number of modes leaves out.

    angles       number of angles around the ring for which the map lists it
    compliance   of a mesh [m/N]
    """
    listed = _listed_around(of_set, CROSS_LEFT_OUT)
    if listed is None:
        return "Planetary(ring_modes=fem.ring_modes(ring_pair)) couples the meshes by it"
    shares = [_largest_between(table, of_set) / compliance for table in listed.reshape(-1, angles)]
    number = next((n for n, share in enumerate(shares) if share < WORTH), int(np.argmin(shares)))
    coordinates = f"ring_modes=fem.ring_modes(ring_pair, {number + 1})"
    return f"Planetary({coordinates}) couples the meshes by it and leaves out {shares[number]:.2%}"


def _listed_around(of_set: Planetary, name: str) -> np.ndarray | None:
    """Attribute of the map of the ring (n,); None where its rim is clamped, its law is a table, or it has none."""
    maps = of_set.ring_mesh if isinstance(of_set.ring_mesh, list | tuple) else [of_set.ring_mesh]
    table = maps[0].attrs.get(name) if isinstance(maps[0], xr.Dataset) else None
    return None if table is None else np.asarray(table, float)


def _largest_between(table: np.ndarray, of_set: Planetary) -> float:
    """Largest magnitude of a table over even angles around the ring, at the angles between the planets of a set."""
    angles = np.array(of_set.angles)
    apart = np.subtract.outer(angles, angles)[~np.eye(angles.size, dtype=bool)]
    around = 2 * pi * np.arange(len(table) + 1) / len(table)
    return float(np.abs(np.interp(apart % (2 * pi), around, np.append(table, table[0]))).max(initial=0.0))
