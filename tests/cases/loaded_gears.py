"""Elastic gears under loads on their flanks: those of contacts, and given ones."""

from typing import Any, NamedTuple

import numpy as np
from involutes import arc_length
from line_contact import half_width
from paper_gears import paper_gear, paper_pair

import fem
from fem import Density
from fem.stress.flank_loads import FlankLoad, flank_loads, tooth_contacts
from fem.stress.gear_elasticity import ElasticGear, nodal_forces, plane_gear, section_refined_at
from fem.stress.stress_recovery import stress
from fem.units import deg, mm

GEAR = paper_gear()
ROUGH = fem.Resolution(Density(flank=6, fillet=1, tooth=2, rim=1, body=2, width=1), 4)
PITCH_POINT = paper_pair().roll_pitch


def helical_gear(hand: int = 1) -> fem.Gear:
    return fem.Gear(z=57, m_n=2.5 * mm, b=23 * mm, beta=hand * 15 * deg, d_bore=60 * mm)


def load_on(arc, force, low=0.0, high=1.0, *, tooth: int = 0) -> FlankLoad:
    """Forces (n_strip,) [N] on strips between arc lengths (n_strip + 1,) [m], in one slice; [N/m] without its ends."""
    return FlankLoad(tooth, np.array([arc]), np.array([low]), np.array([high]), np.array([force]))


def in_slices(load: FlankLoad, low, high, width) -> FlankLoad:
    """The line load on slices from low to high (n,) [m], times a width of each (n,) [m]."""
    low, high, width = np.atleast_1d(low), np.atleast_1d(high), np.atleast_1d(width)
    return FlankLoad(load.tooth, np.tile(load.edges, (low.size, 1)), low, high, load.force * width[:, None])


def hertz_load(line_load: float, tooth: int = 0) -> tuple[FlankLoad, float, float]:
    """Elliptical pressure at the pitch point on twelve strips, its half-width [m] and its largest value [Pa]."""
    half = half_width(line_load, PITCH_POINT / 2)
    x = np.linspace(-1, 1, 13)
    share = np.diff(x * np.sqrt(1 - x**2) + np.arcsin(x)) / np.pi
    load = load_on(arc_length(GEAR, PITCH_POINT) + half * x, line_load * share, tooth=tooth)
    return load, half, 2 * line_load / (np.pi * half)


class LoadedContact(NamedTuple):
    """A contact, its state, and the loads on the teeth of pinion and wheel."""

    contact: Any
    state: Any
    loads: tuple[list[FlankLoad], list[FlankLoad]]


def loaded_contacts(pair: fem.GearPair, torque: float, phases, offsets=None, resolution=None) -> list[LoadedContact]:
    """Contacts at phases under a torque of the pinion [N m]."""
    contacts, misalignment = tooth_contacts(pair, phases, offsets, resolution)
    states = [contact.state(torque / pair.pinion.r_b, misalignment) for contact in contacts]
    return [LoadedContact(*solved, flank_loads(*solved)) for solved in zip(contacts, states, strict=True)]


def elastic_section(gear: fem.Gear, density: Density) -> ElasticGear:
    """Quadratic triangles in plane strain."""
    return plane_gear(gear, fem.section(gear, density).to_meshtri())


def section_around_loads(gear: fem.Gear, density: Density, loads: list[FlankLoad], share: float) -> ElasticGear:
    """The same, with edges of at most a share of the loads' half-widths under them."""
    return plane_gear(gear, section_refined_at(gear, density, loads, share))


def displacement_under(elastic: ElasticGear, loads: list[FlankLoad]) -> np.ndarray:
    """(n_dofs,) [m]."""
    return elastic.displacement(nodal_forces(elastic, loads))


def stress_under(elastic: ElasticGear, loads: list[FlankLoad]) -> np.ndarray:
    """(3, 3, n_vertex) recovered stress [Pa]."""
    return stress(elastic, displacement_under(elastic, loads))
