"""Sections of a shaft: cylinders end to end from an axial position on, and how gears add to mass and stiffness."""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from exugear.gearbox.disc import Disc
from fem.gear.gear import Gear
from fem.gear.material import Material, cylinder
from fem.support.validation import require, text_of
from fem.units import mm

#: Largest size of a section [m]; the user is taken to mean another unit beyond.
LARGEST = 10.0


class Section(NamedTuple):
    """A hollow cylinder of a shaft: diameter, length, inner diameter and axial position of its begin [m]."""

    d: float
    length: float
    d_inner: float = 0.0
    start: float = 0.0

    @property
    def end(self) -> float:
        """Axial position of its end [m]."""
        return self.start + self.length


class Cylinder(NamedTuple):
    """A section between two axial positions, or the part of one [m].

    d_stiff   diameter up to which the material resists bending and torsion: that of a gear adds to the shaft's
    """

    start: float
    end: float
    d: float
    d_inner: float
    d_stiff: float


def sections_of(owner: str, values: object) -> tuple[tuple[float, ...], ...]:
    """Checked sections from (d, length) or (d, length, d_inner) each; ValueError names the section."""
    listed = isinstance(values, Sequence) and not isinstance(values, str) and len(values) > 0
    require(listed, f"sections of {owner} must be a list of (d, length) or (d, length, d_inner), got {text_of(values)}")
    sections = []
    for number, value in enumerate(values):  # type: ignore[arg-type, var-annotated]
        name = f"section {number} of {owner}"
        try:
            d, length, *inner = (float(x) for x in value)
            section = Section(d, length, *inner)
            require(len(inner) < 2, "")
        except (TypeError, ValueError):
            raise ValueError(f"{name} must be (d, length) or (d, length, d_inner), got {text_of(value)}") from None
        sizes = f"got d {section.d:g}, length {section.length:g}, d_inner {section.d_inner:g} m; pass metres: 30*mm"
        fits = 0 <= section.d_inner < section.d < LARGEST and 0 < section.length < LARGEST
        require(fits, f"{name} needs d > d_inner >= 0 and length > 0, below {LARGEST:g} m, {sizes}")
        sections.append((section.d, section.length, section.d_inner))
    return tuple(sections)


def placed(sections: Sequence[Sequence[float]], start: float) -> tuple[Section, ...]:
    """Sections end to end from an axial position [m] on."""
    bounds = start + np.concatenate([[0.0], np.cumsum([section[1] for section in sections])])
    return tuple(
        Section(d, length, d_inner, float(z)) for (d, length, d_inner), z in zip(sections, bounds, strict=False)
    )


def bounds_of(sections: Sequence[Section]) -> np.ndarray:
    """(n + 1,) axial positions of the ends of n sections [m]."""
    return np.array([sections[0].start, *(section.end for section in sections)])


def ring_on(sections: Sequence[Section], axial: float, gear: Gear, name: str) -> Disc:
    """The body of a gear beside the shaft on which it sits: from the shaft's surface to the mean of tip and root.

    ValueError for a shaft as thick as the gear.
    """
    d_mean = abs(gear.r_a + gear.r_f)
    total, inertia, transverse = cylinder(gear.material.density, gear.b, d_mean)
    for section in sections:
        first, last = max(section.start, axial - gear.b / 2), min(section.end, axial + gear.b / 2)
        if last <= first:
            continue
        thick = f"section of {section.d / mm:g} mm at the gear of shaft {name!r} at {axial / mm:g} mm"
        remedy = f"is as thick as the gear's body of {d_mean / mm:.4g} mm; make it thinner"
        require(section.d < d_mean, f"{thick} {remedy}")
        removed = cylinder(gear.material.density, last - first, section.d)
        lever = (first + last) / 2 - axial
        total, inertia = total - removed.mass, inertia - removed.inertia
        transverse -= removed.transverse + removed.mass * lever**2
    return Disc(total, inertia, transverse)


def cylinders_of(
    sections: Sequence[Section], stations: Sequence[float], gears: dict[float, Gear], longest: float
) -> list[Cylinder]:
    """The sections divided at stations [m], at the faces of the gears, and into pieces of longest diameters at most.

    A gear stiffens the shaft: within its face width up to the root circle, but from its faces on no more than a cone of
    45 degrees, along which the load spreads into the material.
    """
    edges = bounds_of(sections)
    faces = [
        axial + side * gear.b * share for axial, gear in gears.items() for side in (-0.5, 0.5) for share in (1, 0.5)
    ]
    inside = [x for x in (*stations, *faces) if edges[0] < x < edges[-1]]
    cuts = np.unique(np.round([*edges, *inside], 9))
    pieces = []
    for first, last in pairwise(cuts):
        section = sections[int(np.searchsorted(edges, (first + last) / 2)) - 1]
        number = max(1, int(np.ceil((last - first) / (longest * section.d))))
        for start, end in zip(*(np.linspace(first, last, number + 1)[i:][:number] for i in (0, 1)), strict=True):
            pieces.append(
                Cylinder(start, end, section.d, section.d_inner, _stiffened(section.d, (start + end) / 2, gears))
            )
    return pieces


def _stiffened(d: float, axial: float, gears: dict[float, Gear]) -> float:
    """Diameter [m] that resists bending at an axial position: of the shaft, or of a gear around it."""
    return max([d, *(_of_gear(d, axial - position, gear) for position, gear in gears.items())])


def _of_gear(d: float, from_middle: float, gear: Gear) -> float:
    """Diameter [m] of a gear that carries at a distance from its mid-plane [m]; 0 beside it."""
    depth = gear.b / 2 - abs(from_middle)
    return min(abs(2 * gear.r_f), d + 2 * depth) if depth > 0 and gear.r_f > 0 else 0.0


def mass_of(sections: Sequence[Section], material: Material) -> list[tuple[float, Disc]]:
    """(axial position of the middle [m], body) of each section."""
    return [
        (
            (section.start + section.end) / 2,
            Disc(*cylinder(material.density, section.length, section.d, section.d_inner)),
        )
        for section in sections
    ]
