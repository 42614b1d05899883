"""Results of planetary sets: members with their torques, phases of the meshes, load sharing, orbit of the sun."""

from math import degrees, pi
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.planetary import EVEN
from exugear.gearbox.planetary_phases import effect_of_harmonics, hunting, meshing_sequence, phase_sums
from exugear.gearbox.side_band_lines import side_band_lines
from exugear.load_factors.planet_shares import planet_shares
from exugear.plots.figures import figure
from exugear.plots.run_plots import plot_orbit
from exugear.plots.set_plots import (
    plot_mesh_phases,
    plot_phase_sums,
    plot_planet_shares,
    plot_side_bands,
)
from exugear.reporting.document import Figure, Section, Table, embedded
from exugear.running.ring_variables import ring_of_run
from exugear.running.set_data import SetData, carriers_of_run, planetary_sets
from exugear.signals.member_orbit import member_orbit, stands_still
from exugear.signals.side_bands import force_seen_from_ring, lines_of
from exugear.signals.signal import NOMINAL, speed_of_shaft
from fem.units import rpm, um

#: Mesh harmonics of the table of sums, and of the side bands.
SUMS, HARMONICS = 6, 2
#: Largest change of the speed over its mean at which side bands are listed; turns of the carrier that they take.
CONSTANT, TURNS = 1e-3, 6.0
#: Lowest level of a side band in the table [dB].
LOWEST = -60.0
#: Share of the largest mean force below which a member carries no load.
UNLOADED = 1e-3
#: Side bands on either side, beyond the number of planets.
BESIDE = 2


def set_sections(data: xr.Dataset) -> list[Section]:
    """A section for each planetary set of a run: of one sun and one ring, or of any meshes on a carrier."""
    sets = planetary_sets(data)
    coupled = [carrier for carrier in carriers_of_run(data) if carrier not in [x.carrier for x in sets]]
    return [_section(data, of_set) for of_set in sets] + [_coupled_section(data, carrier) for carrier in coupled]


def _coupled_section(data: xr.Dataset, carrier: str) -> Section:
    """Section of a set whose planets mesh with one another, or with several suns or rings, as that of Ravigneaux."""
    on_carrier = [x for x in data["stage"].values.tolist() if data.attrs.get(f"{x}_carrier") == carrier]
    of_carrier = data.sel(stage=on_carrier)
    planets = list(dict.fromkeys(of_carrier["planet"].values.tolist()))
    members = [x for x in dict.fromkeys(of_carrier["member"].values.tolist()) if x not in planets]
    carried = {name: planet_shares(of_carrier, member=name) for name in members}
    forces = {
        name: float(np.abs(of_carrier["mesh_force"].values[of_carrier["member"].values == name]).mean())
        for name in members
    }
    loaded = {name: shares for name, shares in carried.items() if forces[name] > UNLOADED * max(forces.values())}
    sentences = [
        f"Load sharing at {name}: K_γ {float(shares['K_gamma']):.4g}."
        if name in loaded
        else f"The meshes with {name} carry no load."
        for name, shares in carried.items()
    ]
    figures = []
    if loaded:
        drawing = _wide(len(loaded))
        for ax, (name, shares) in zip(drawing.axes, loaded.items(), strict=True):
            plot_planet_shares(shares, ax).set_title(name)
        figures = [embedded(drawing, "Shares of the planets in the mesh forces of each member, and mesh load factors.")]
    tables = _members_of_carrier(of_carrier, carrier, members, planets), _meshes_of_carrier(of_carrier)
    return Section(f"Coupled planetary set on {carrier}", tuple(sentences), tables, tuple(figures))


def _members_of_carrier(data: xr.Dataset, carrier: str, members: list[str], planets: list[str]) -> Table:
    """Teeth, speeds and external torques of all shafts of a set; data: of its stages."""
    teeth: dict[str, dict[int, None]] = {}
    for label, planet, member in zip(*(data[x].values.tolist() for x in ("stage", "planet", "member")), strict=True):
        z = [int(data.attrs[f"{label}_{gear}_z"]) for gear in ("pinion", "wheel")]
        ends = (member, planet) if label.startswith(f"{member}-") else (planet, member)
        for name, of_gear in zip(ends, z, strict=True):
            teeth.setdefault(name, {})[of_gear] = None
    torques, rows = _torques(data), []
    for name in (carrier, *members, *planets):
        z = list(teeth.get(name, ()))
        kinds = {carrier: "carrier"} | dict.fromkeys(planets, "planet")
        role = kinds.get(name, "ring" if z and min(z) < 0 else "sun")
        speed = f"{speed_of_shaft(data, 'shaft', name).mean() / rpm:.5g}" if _known(data, name) else "not recorded"
        torque = f"{torques[name]:.5g}" if name in torques else "none"
        ratio = _ratio(data, name)
        rows.append((role, name, " and ".join(map(str, z)), ratio, speed, torque))
    columns = "member", "shaft", "teeth", "speed / driving shaft", "mean speed [rpm]", "mean external torque [N m]"
    return Table("Members of the set, speeds and torques about z", columns, tuple(rows))


def _meshes_of_carrier(data: xr.Dataset) -> Table:
    """Phase, mean force and mesh frequency of every mesh of a set; data: of its stages."""
    rows = []
    for label in data["stage"].values.tolist():
        mesh, phase = data.sel(stage=label), float(data.attrs.get(f"{label}_phase", np.nan)) % 1
        force, frequency = (float(mesh[name].mean()) for name in ("mesh_force", "mesh_frequency"))
        rows.append(
            (
                label,
                f"{phase:.4f}",
                f"{force:.5g}",
                f"{float(np.ptp(mesh['mesh_force'].values)):.4g}",
                f"{frequency:.5g}",
            )
        )
    columns = "mesh", "phase [pitch]", "mean force [N]", "peak to peak [N]", "mean mesh frequency [Hz]"
    return Table("Meshes of the set", columns, tuple(rows))


def _section(data: xr.Dataset, of_set: SetData) -> Section:
    lines = _side_bands(data, of_set)
    told = _known(data, of_set.carrier, of_set.ring)
    members = [name for name in (of_set.sun, of_set.ring, of_set.carrier) if told and _moves(data, name)]
    orbits = [name for name in members if not stands_still(member_orbit(data, name)["displacement"])]
    items = (*_phasing(of_set), *_sharing(data, of_set), *(_orbit(data, name, name in orbits) for name in members))
    tables = [_members(data, of_set), _phases(data, of_set), _sums(of_set), *([_lines(lines)] if lines else [])]
    tables.append(_ring_modes(data, of_set.ring))
    figures = [_phase_figure(of_set), _share_figure(data, of_set)]
    figures += [_orbit_figure(data, orbits)] if orbits else []
    figures += [_line_figure(lines)] if lines else []
    title = f"Planetary set on {of_set.carrier}"
    items = tuple(filter(None, (*items, _note(data))))
    return Section(title, items, tuple(table for table in tables if table.rows), tuple(figures))


def _phasing(of_set: SetData) -> list[str]:
    """Meshing sequence, what harmonics excite, and hunting teeth, a sentence each."""
    sun, at_sun, at_ring, ring = of_set.z
    sentences = [f"Phasing: {meshing_sequence(of_set.sun_phases)}."]
    gaps = np.diff([*np.sort(of_set.angles % (2 * pi)), (of_set.angles % (2 * pi)).min() + 2 * pi])
    if np.ptp(gaps) < EVEN:
        sentences.append(f"Mesh harmonics excite: {effect_of_harmonics(sun, len(of_set.planets))}.")
    sentences.append(f"{hunting(sun, at_sun, ('sun', 'planet'))}.")
    return [*sentences, f"{hunting(at_ring, ring, ('planet', 'ring'))}."]


def _sharing(data: xr.Dataset, of_set: SetData) -> list[str]:
    """K_gamma at sun and ring, with the planet that carries most."""
    sentences = []
    for member in (of_set.sun, of_set.ring):
        shares = planet_shares(data, member=member, carrier=of_set.carrier)
        if np.isfinite(shares["K_gamma"]):
            most = str(shares["planet"].values[int(shares["mean_share"].argmax("planet"))])
            factor = f"K_γ {float(shares['K_gamma']):.4g}"
            percent = f"{100 * float(shares['mean_share'].max()):.4g} %"
            sentences.append(f"Load sharing at {member}: {factor}; {most} carries most, {percent} of the mean forces.")
    return sentences


def _moves(data: xr.Dataset, name: str) -> bool:
    """Whether a run has recorded how a shaft moves on its bearings."""
    bearings = data["bearing"].values.tolist() if "bearing_displacement" in data else []
    return name in [bearing.rpartition(" at ")[0] for bearing in bearings]


def _orbit(data: xr.Dataset, name: str, moves: bool) -> str:
    """The orbit of a member in a sentence."""
    if not moves:
        return f"{name} does not move on its bearings."
    orbit = member_orbit(data, name)
    x, y = orbit["displacement"].transpose("direction", "time").values / um
    mean = f"({x.mean():.3g}, {y.mean():.3g}) µm"
    return f"{name} moves up to {np.hypot(x, y).max():.3g} µm from its axis, about the mean {mean}."


def _note(data: xr.Dataset) -> str:
    """What the run did not record of the orbits; empty if it did, or if all members only spin."""
    missing = "bearing_force" in data and "bearing_displacement" not in data
    return "Orbits were not recorded: run with displacement=True." if missing else ""


def _members(data: xr.Dataset, of_set: SetData) -> Table:
    """Teeth, speeds and external torques of sun, planets, ring and carrier."""
    sun, at_sun, at_ring, ring = of_set.z
    teeth = {of_set.sun: str(sun), of_set.ring: str(ring), of_set.carrier: "", of_set.planets[0]: str(at_sun)}
    teeth[of_set.planets[0]] += f" and {at_ring}" if at_ring != at_sun else ""
    roles = {of_set.sun: "sun", of_set.ring: "ring", of_set.carrier: "carrier", of_set.planets[0]: "each planet"}
    torques = _torques(data)
    rows = []
    for name, role in roles.items():
        speed = f"{speed_of_shaft(data, 'shaft', name).mean() / rpm:.5g}" if _known(data, name) else "not recorded"
        ratio = _ratio(data, name)
        torque = f"{torques[name]:.5g}" if name in torques else "none"
        label = name if role != "each planet" else f"{of_set.planets[0]} to {of_set.planets[-1]}"
        rows.append((role, label, teeth[name], ratio, speed, torque))
    columns = "member", "shaft", "teeth", "speed / driving shaft", "mean speed [rpm]", "mean external torque [N m]"
    return Table("Members of the set, speeds and torques about z", columns, tuple(rows))


def _ratio(data: xr.Dataset, name: str) -> str:
    """Speed of a shaft over that of the driving shaft; the mean one where a run chooses several free speeds."""
    if "independent_speeds" not in data.attrs or data.attrs.get("title") == NOMINAL:
        return f"{float(data.attrs[f'{name}_speed_ratio']):.6g}"
    driving = float(data["speed"].mean())
    known = _known(data, name) and driving != 0
    return f"{speed_of_shaft(data, 'shaft', name).mean() / driving:.6g}" if known else "not recorded"


def _known(data: xr.Dataset, *names: str) -> bool:
    """Whether a run tells the speeds of shafts: they may be free, and are recorded with power=True alone."""
    try:
        return all(speed_of_shaft(data, "shaft", name).size > 0 for name in names)
    except ValueError:
        return False


def _torques(data: xr.Dataset) -> dict[str, float]:
    """Mean torque [N m] about z of drives, loads and the housing, by the name of the shaft."""
    torques: dict[str, float] = {}
    for kind, end, with_motion in (("drive", "drive_end", 1), ("load", "load_end", -1), ("reaction", "held_end", 0)):
        if f"{kind}_torque" not in data:
            continue
        values = data[f"{kind}_torque"]
        means = np.atleast_1d(values.mean("time").values)
        for name, mean in zip(np.atleast_1d(data[end].values).tolist(), means.tolist(), strict=True):
            ratio = float(data.attrs.get(f"{name}_speed_ratio", np.nan))
            sense = with_motion * (1.0 if ratio >= 0 else -1.0) if with_motion else 1.0
            if np.isfinite(ratio):
                torques[name] = torques.get(name, 0.0) + sense * mean
    return torques


def _phases(data: xr.Dataset, of_set: SetData) -> Table:
    """Phases of the meshes and mean shares of each planet."""
    sharing = [planet_shares(data, member=name, carrier=of_set.carrier) for name in (of_set.sun, of_set.ring)]
    at_sun, at_ring = (shares["mean_share"].values for shares in sharing)
    columns = zip(of_set.planets, of_set.angles, of_set.sun_phases, of_set.ring_phases, at_sun, at_ring, strict=True)
    rows = []
    for planet, angle, sun, ring, *shares in columns:
        percent = (f"{100 * share:.3f}" if np.isfinite(share) else "no load" for share in shares)
        rows.append((planet, f"{degrees(angle) % 360:.6g}", f"{sun % 1:.4f}", f"{ring % 1:.4f}", *percent))
    phase = "phase with the sun [pitch]", "phase with the ring [pitch]"
    share = "share at the sun [%]", "share at the ring [%]"
    return Table("Phases of the meshes and load sharing", ("planet", "angle [°]", *phase, *share), tuple(rows))


def _ring_modes(data: xr.Dataset, ring: str) -> Table:
    """Modes of the rim of an elastic ring with what they do in the run; no rows of another ring."""
    columns = "mode", "lobes", "frequency [Hz]", "damping ratio", "mean radial [µm]", "rms about it [µm]"
    rows: list[tuple[str, ...]] = []
    if elastic := ring_of_run(data, ring):
        modes, (_, of_ring) = elastic[0].modes, elastic
        radial = np.sqrt(np.mean(modes["radial"].values ** 2, axis=1))
        amplitude = of_ring["ring_amplitude"].transpose("time", ...).values
        means, swings = np.abs(amplitude.mean(axis=0)) * radial / um, amplitude.std(axis=0) * radial / um
        listed = zip(modes["lobes"].values, modes["frequency"].values, means, swings, strict=True)
        ratio = f"{elastic[0].damping_ratio:g}"
        for i, (lobes, frequency, mean, swing) in enumerate(listed, start=1):
            rows.append((str(i), f"{lobes:g}", f"{frequency:.5g}", ratio, f"{mean:.3g}", f"{swing:.3g}"))
    title = "Modes of the ring on its supports: radial displacement of its rim, rms around it"
    return Table(title, columns, tuple(rows))


def _sums(of_set: SetData) -> Table:
    """Sums over the planets by mesh harmonic."""
    torque, lateral = phase_sums(of_set.sun_phases, of_set.angles, SUMS)
    rows = ((str(i), f"{x:.4f}", f"{y:.4f}") for i, (x, y) in enumerate(zip(torque, lateral, strict=True), start=1))
    columns = "mesh harmonic", "in the torque", "in the lateral force on the sun"
    return Table("Sums over equal planets, over that of planets in phase", columns, tuple(rows))


def _side_bands(data: xr.Dataset, of_set: SetData) -> xr.Dataset | None:
    """Side bands of the mesh forces as the ring hears them; None where the speed changes or turns are too few."""
    speed = data["speed"].values
    known = _known(data, of_set.carrier, of_set.ring)
    if not known or speed.size < 2 or np.ptp(speed) > CONSTANT * np.abs(speed).max():
        return None
    heard = force_seen_from_ring(data, ring=of_set.ring, reach=pi / len(of_set.planets))
    if np.ptp(heard["angle"].values) < TURNS * 2 * pi:
        return None
    settled = heard.isel(time=slice(int(np.searchsorted(heard["angle"].values, 0.2 * pi)), None))
    return lines_of(settled, side_band_lines(of_set.z, of_set.angles, HARMONICS, len(of_set.planets) + BESIDE, ()))


def _lines(lines: xr.Dataset) -> Table:
    """Levels and causes of the side bands."""
    columns = zip(*(lines[name].values for name in ("order", "mean_amplitude", "level", "cause")), strict=True)
    rows = [(f"{o:g}", f"{a:.3g}", f"{level:.1f}", str(cause)) for o, a, level, cause in columns if level > LOWEST]
    names = "order", "amplitude [N]", "level [dB]", "what excites it"
    return Table("Side bands of the mesh forces at the ring, per turn of the carrier against it", names, tuple(rows))


def _phase_figure(of_set: SetData) -> Figure:
    torque, lateral = phase_sums(of_set.sun_phases, of_set.angles, SUMS)
    columns: dict[str, Any] = {"angle": of_set.angles, "sun_phase": of_set.sun_phases, "ring_phase": of_set.ring_phases}
    phases = xr.Dataset(
        {name: ("planet", values) for name, values in columns.items()}
        | {"torque_sum": ("harmonic", torque), "lateral_sum": ("harmonic", lateral)},
        {"planet": list(of_set.planets), "harmonic": np.arange(1, SUMS + 1)},
    )
    drawing = _wide(2)
    plot_mesh_phases(phases, drawing.axes[0])
    plot_phase_sums(phases, drawing.axes[1])
    return embedded(drawing, "Phases of the meshes of each planet, and what mesh harmonics add up to over the planets.")


def _share_figure(data: xr.Dataset, of_set: SetData) -> Figure:
    drawing = _wide(2)
    for ax, member in zip(drawing.axes, (of_set.sun, of_set.ring), strict=True):
        plot_planet_shares(planet_shares(data, member=member, carrier=of_set.carrier), ax)
    return embedded(drawing, "Shares of the planets in the mesh forces, and mesh load factor.")


def _orbit_figure(data: xr.Dataset, members: list[str]) -> Figure:
    drawing = _wide(len(members))
    for ax, name in zip(drawing.axes, members, strict=True):
        plot_orbit(member_orbit(data, name), ax)
    return embedded(drawing, "Orbits of the members on bearings in the last turn of the carrier against the ring.")


def _line_figure(lines: xr.Dataset) -> Figure:
    drawing = _wide(1)
    plot_side_bands(lines, drawing.axes[0])
    words = "each planet heard within half its distance to the next one"
    return embedded(drawing, f"Side bands of the mesh forces as a point of the ring hears them, {words}.")


def _wide(columns: int):
    """A figure across the page."""
    drawing = figure(columns=columns)
    drawing.set_size_inches(8.0, 3.2)
    return drawing
