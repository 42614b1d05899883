"""A shaft as data: the parts on it, its inertia, the support by its bearings, and its static displacement."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf, isfinite, pi, sqrt
from typing import Annotated, Any, NamedTuple

import numpy as np

from exugear.gearbox.beam import Beam, beam_of, twist_shapes, whirl_frequencies
from exugear.gearbox.bearing import Bearing
from exugear.gearbox.disc import Disc, require_all, require_possible
from exugear.gearbox.drag import AnyDrag, BearingDrag, Drag, SkfDrag
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft_loads import ExternalForce, Unbalance, about, gravity_of
from exugear.gearbox.shaft_sections import Section, bounds_of, cylinders_of, mass_of, placed, ring_on, sections_of
from exugear.mesh_force.ring_pair import Ring
from fem.gear.gear import Gear
from fem.gear.material import STEEL, Material
from fem.support.arguments import DERIVED, Finite, checked
from fem.support.plausibility import check_rotor_mass, check_torsion
from fem.support.representation import short
from fem.support.validation import number, require, set_fields, text_of
from fem.units import mm

#: Largest relaxation time of couplings [s], beyond which the user is taken to mean another unit; stiffness [N m/rad]
#: from which on the user is taken to mean a rigid coupling.
RELAXATION, RIGID = 1.0, 1e12
#: Relative difference of a field from its value by the sections that is rounding.
ROUNDING = 1e-9
#: Distance of a coupling from the end of a shaft that is rounding [m]; longest element over the diameter of a shaft.
AT_END, ELEMENT = 1e-6, 0.125
#: Least eigenvalue of a stiffness matrix, scaled to a unit diagonal, that counts as support of a shaft.
LEAST_HOLD = 1e-12


@checked
@short(torsion="N m/rad", damping="N m s/rad", inertia="kg m^2")
@dataclass(frozen=True)
class Coupling:
    """A torsional spring and damper between the shaft and an outside rotor, the motor or the brake.

    The drive or the load then acts on the rotor instead of the shaft. A shaft may carry several couplings, and rotors
    may be coupled to further rotors: chains and trees of inertias and torsional springs. The drive or the load of the
    shaft then acts on the outermost rotor of the first chain, others on a rotor by its name.

    torsion   stiffness [N m/rad]
    damping   [N m s/rad]
    inertia   of the outside rotor about z [kg m^2]
    further   `Coupling` from that rotor to a further rotor, or several of them
    name      of the rotor, in drives, loads and data; by default "<shaft> rotor", "<shaft> rotor 2", ...

    Raises ValueError for a coupling that is effectively rigid, and for values that suggest another unit.
    """

    torsion: float
    damping: float = 0.0
    inertia: float = field(kw_only=True)
    further: Any = field(default=(), kw_only=True)
    name: str = field(default="", kw_only=True)

    def __post_init__(self):
        further = (self.further,) if isinstance(self.further, Coupling) else self.further
        couplings = isinstance(further, list | tuple) and all(isinstance(x, Coupling) for x in further)
        require(couplings, f"further must be a Coupling or a list of them, got {text_of(further)}")
        set_fields(self, further=tuple(further))
        require_all("a coupling", self, {"torsion": "N m/rad", "inertia": "kg m^2"})
        rigid = f"torsion {self.torsion:g} N m/rad is effectively rigid (from {RIGID:g} on)"
        require(self.torsion < RIGID, f"{rigid}; leave the coupling out and add a Disc")
        require(0 <= self.damping < inf, f"damping of a coupling must be >= 0 N m s/rad, got {self.damping}")
        slow = f"damping / torsion of a coupling must stay below {RELAXATION:g} s, got {self.damping / self.torsion:g}"
        require(self.damping < RELAXATION * self.torsion, f"{slow}; pass N m s/rad and N m/rad: 20 kN m/rad are 20e3")


@checked
@short(x="um", y="um", z="um", tilt_x="mrad", tilt_y="mrad", pivot="mm")
@dataclass(frozen=True)
class Placement:
    """Static displacement of a whole shaft with its bearings from its nominal position.

    x, y, z          displacement of the point of its axis at the pivot [m]
    tilt_x, tilt_y   rotation about x, then about the tilted y axis, through that point [rad]
    pivot            axial position of the point [m]

    Raises ValueError beyond 0.01 m and 0.05 rad.
    """

    x: float = 0.0
    y: float = 0.0
    tilt_x: float = 0.0
    tilt_y: float = 0.0
    z: float = 0.0
    pivot: float = 0.0

    def __post_init__(self):
        require(abs(self.pivot) < 10, f"pivot must lie within 10 m, got {self.pivot:g}; pass metres: 30*mm")
        for name in ("x", "y", "z"):
            value = getattr(self, name)
            require(abs(value) < 0.01, f"{name} of a placement must lie within 0.01 m, got {value}; pass metres: 20*um")
        for name in ("tilt_x", "tilt_y"):
            value = getattr(self, name)
            require(abs(value) < 0.05, f"{name} must lie within 0.05 rad, got {value}; pass radians: 0.5e-3")

    @property
    def axis(self) -> np.ndarray:
        """(3,) direction of the displaced shaft."""
        sin_x, sin_y, cos_x, cos_y = *np.sin([self.tilt_x, self.tilt_y]), *np.cos([self.tilt_x, self.tilt_y])
        return np.array([sin_y, -sin_x * cos_y, cos_x * cos_y])

    @checked
    def at(self, axial: Finite) -> np.ndarray:
        """(3,) displaced point of the axis at an axial position [m], from the nominal point at the axial position 0."""
        return np.array([self.x, self.y, self.z + self.pivot]) + (axial - self.pivot) * self.axis


class Rotor(NamedTuple):
    """A rotor outside a shaft: its name, the coupling to it, the name of that spring, and the body that bears it.

    body   name of the shaft, or of the rotor, from which the coupling leads to this one
    """

    name: str
    coupling: Coupling
    spring: str
    body: str


def rotors_of(shaft: str, couplings: Sequence[tuple[str, Coupling]]) -> tuple[Rotor, ...]:
    """The rotors behind couplings, each before those behind it; couplings: by the body that bears each."""
    rotors: list[Rotor] = []

    def add(couplings: Sequence[tuple[str, Coupling]]) -> None:
        for body, coupling in couplings:
            number = f" {len(rotors) + 1}" if rotors else ""
            name = coupling.name or f"{shaft} rotor{number}"
            rotors.append(Rotor(name, coupling, f"{shaft} coupling{number}", body))
            add([(name, further) for further in coupling.further])

    add(couplings)
    return tuple(rotors)


@checked
@short(torsion="N m/rad", damping_time="s")
@dataclass(frozen=True)
class TorqueSupport:
    """A torsional spring and damper between a shaft and the housing: an elastic torque arm, which takes the reaction.

    torsion        stiffness [N m/rad]
    damping_time   damping over stiffness [s]

    A shaft with it does not turn but for its deflection. Raises ValueError for values that suggest another unit.
    """

    torsion: float
    damping_time: float = 0.0

    def __post_init__(self):
        require_all("a torque support", self, {"torsion": "N m/rad"})
        rigid = f"torsion {self.torsion:g} N m/rad is effectively rigid (from {RIGID:g} on)"
        require(self.torsion < RIGID, f"{rigid}; leave the support out and hold the shaft: Gearbox(..., held=...)")
        ratio = f"damping_time must lie in [0, 0.1) s, got {self.damping_time}; pass damping / stiffness"
        require(0 <= self.damping_time < 0.1, ratio)


Load = ExternalForce | Unbalance
Part = Gear | Ring | Bearing | RollingBearing | Disc | Coupling | TorqueSupport | Drag | BearingDrag | SkfDrag | Load
NO_DISPLACEMENT = Placement()
PART_NAMES = "Bearing", "RollingBearing", "Disc", "Coupling", "TorqueSupport", "ExternalForce", "Unbalance", "Drag"


def check_parts(name: str, parts) -> None:
    """ValueError unless parts maps axial positions [m] to parts that a shaft may carry."""
    if not isinstance(parts, Mapping):
        raise ValueError(f"{name} must map axial positions to gears and bearings, got {text_of(parts)}")
    for axial, part in parts.items():
        number(f"axial positions of {name}", axial)
        group = part if isinstance(part, list | tuple) else (part,)
        wrong = [x for x in group if not isinstance(x, Part)]
        kinds = f"{name} holds fem.Gear, RingPair.wheel, {', '.join(PART_NAMES)}, BearingDrag and SkfDrag"
        require(not wrong, f"{kinds}, got {text_of(wrong[0]) if wrong else wrong} at {axial:g} m")


@checked
@short(parts="mm", inertia="kg m^2", mass="kg", transverse="kg m^2", length="mm")
@dataclass(frozen=True)
class Shaft:
    """A shaft along z with its gears. Without bearings it only spins; on bearings it also moves and tilts.

    A carrier is a shaft on which planets turn, with or without gears of its own.

    name         of the shaft, unique in a gearbox
    parts        axial position [m] -> `fem.Gear`, `Bearing`, `RollingBearing`, `Disc`, `Coupling`, `TorqueSupport`,
                 `ExternalForce`, `Unbalance`, `Drag`, `BearingDrag` or `SkfDrag`, or a list of them; the ring of a
                 `RingPair` (its `wheel`) has no body: pass inertia and mass, or a `Disc`
    inertia      about z [kg m^2]; by default that of its discs and gears, a gear taken as a solid disc of its
                 material up to the mean of tip and root circle: the shaft fills the bore over the face width
    mass         [kg]; by default the mass of the same discs and gears
    transverse   inertia about x and y through the centre of mass [kg m^2]; by default that of the same discs and gears
                 at their axial positions
    start        axial position [m] at which the shaft begins
    length       [m]; all parts must then lie within [start, start + length]
    offset       `Placement`: static displacement from the nominal position
    gravity      acceleration (x, y, z) [m/s^2] by which the shaft weighs on its bearings: (0, -9.81, 0)
    sections     (diameter, length) or (diameter, length, inner diameter) [m] of each section, end to end from `start`
                 on. The shaft is then elastic: mass, inertia and length follow from its sections, its discs, and the
                 material of its gears outside of the sections; do not pass them. `exugear.plan` chooses the elastic
                 coordinates that it needs. Without sections it is rigid
    material     `fem.Material` of the sections
    damping_ratio
                 share of the critical damping in each elastic mode of the shaft
    torque_at    axial position [m] of the end on which drive, load and the couplings there act: the shaft twists
                 between it and its gears. By default that of the first coupling, else the end of the shaft that lies
                 farther from its gears. Further couplings elsewhere act on the next gear in series with the shaft
                 between, whose inertia turns with that gear

    Raises ValueError for shafts without a body, parts outside the shaft, impossible inertias, bearings that do not hold
    the shaft against displacement and tilt, and for forces, unbalance or gravity without bearings.
    """

    name: str
    parts: Annotated[Mapping[float, Part | Sequence[Part]], check_parts]
    inertia: float = field(default=DERIVED, kw_only=True)
    mass: float = field(default=DERIVED, kw_only=True)
    transverse: float = field(default=DERIVED, kw_only=True)
    start: float = field(default=0.0, kw_only=True)
    length: float | None = field(default=None, kw_only=True)
    gravity: Sequence[float] = field(default=(0.0, 0.0, 0.0), kw_only=True)
    offset: Placement = field(default=NO_DISPLACEMENT, kw_only=True)
    sections: Sequence[Sequence[float]] | None = field(default=None, kw_only=True)
    material: Material = field(default=STEEL, kw_only=True)
    damping_ratio: float = field(default=0.01, kw_only=True)
    torque_at: float | None = field(default=None, kw_only=True)
    centre: float = field(init=False, repr=False)

    def __post_init__(self):
        groups = {0.0 + axial: x if isinstance(x, list | tuple) else (x,) for axial, x in sorted(self.parts.items())}
        listed = {axial: group[0] if len(group) == 1 else tuple(group) for axial, group in groups.items()}
        set_fields(self, parts=listed)
        self._check_sections()
        self._check_parts()
        self._check_positions()
        self._fill_defaults()
        require_all(f"shaft {self.name!r}", self, {"inertia": "kg m^2", "mass": "kg", "transverse": "kg m^2"})
        require_possible(f"shaft {self.name!r}", self)
        self._check_rotors()
        self._check_support()
        self._check_loads()
        self._check_beside_gears()

    def _check_sections(self) -> None:
        """Require what sections need, and that data of elastic shafts do not stand beside rigid ones."""
        owner = f"shaft {self.name!r}"
        ratio = f"damping_ratio of {owner} must lie in [0, 0.5), got {self.damping_ratio:g}"
        require(0 <= self.damping_ratio < 0.5, f"{ratio}; steel shafts have 0.005 to 0.02")
        begins = f"start of {owner} must lie within 10 m, got {self.start:g}; pass metres: 30*mm"
        require(isfinite(self.start) and abs(self.start) < 10, begins)
        if self.sections is None:
            rigid = f"torque_at of {owner} needs sections=, between which and the gears the shaft twists"
            require(self.torque_at is None, f"{rigid}; leave it out, or pass sections=[(d, length), ...]")
            return
        set_fields(self, sections=sections_of(owner, self.sections))
        first, last = (float(x) for x in bounds_of(self.cylinders)[[0, -1]])
        self._derive("length", last - first)
        if self.torque_at is not None:
            within = f"torque_at of {owner} must lie in [{first:g}, {last:g}] m, got {self.torque_at:g}"
            require(first - ROUNDING <= self.torque_at <= last + ROUNDING, within)

    def _derive(self, name: str, value: float) -> None:
        """Set a field by its value, which a shaft with sections may be given but not otherwise."""
        given = getattr(self, name)
        alike = given is None or not self.sections or abs(given - value) <= ROUNDING * value
        by_sections = f"sections of shaft {self.name!r} give its {name}, {value:.6g}, got {given}"
        require(alike, f"{by_sections}; leave {name} out, or add a Disc for what the sections lack")
        set_fields(self, **{name: value if given is None else given})

    def _check_parts(self) -> None:
        require(bool(self.name), "name of a shaft must not be empty; drives and loads name the shaft on which they act")
        drawn = self.name[0] != "_" and "$" not in self.name
        require(drawn, f"name of a shaft must not begin with _ or hold $, which plots cannot draw, got {self.name!r}")
        for kind in (Gear | Ring, Bearing | RollingBearing):
            positions = [axial for axial, _ in parts_of(self, kind)]
            of_kind = "Gear" if kind == Gear | Ring else "Bearing"
            twice = f"shaft {self.name!r} carries two of a kind at one position: {of_kind} at {positions} m"
            require(len(set(positions)) == len(positions), f"{twice}; move one of them")
        unloaded = [axial for axial, drag in parts_of(self, BearingDrag | SkfDrag) if drag.needs_load]
        unknown = f"load of the BearingDrag at {unloaded} m of shaft {self.name!r} is not known; pass load=... [N]"
        require(not unloaded, f"{unknown}, or let an elastic Bearing carry it")

    def _check_positions(self) -> None:
        for axial in self.parts:
            far = f"axial positions must lie within 10 m, got {axial:g}; pass metres: 30*mm"
            require(isfinite(axial) and abs(axial) < 10, far)
        if self.length is None:
            alone = f"start of shaft {self.name!r} is {self.start:g} m"
            require(self.start == 0, f"{alone}, which counts beside sections or a length only; pass one of them")
            return
        require(0 < self.length < 10, f"length must lie in (0, 10) m, got {self.length:g}; pass metres: 300*mm")
        end = self.start + self.length
        outside = [axial / mm for axial in self.parts if not self.start - AT_END <= axial <= end + AT_END]
        remedy = f"{outside} mm of [{self.start / mm:g}, {end / mm:g}] mm; move the parts or lengthen the shaft"
        require(not outside, f"positions outside the shaft {self.name!r}: {remedy}")

    def _fill_defaults(self) -> None:
        turning = self.bodies
        total = sum(disc.mass for _, disc in turning)
        if not turning:
            self._fill_without_body()
            return
        set_fields(self, centre=sum(disc.mass * axial for axial, disc in turning) / total)
        self._derive("mass", total)
        self._derive("inertia", sum(disc.inertia for _, disc in turning))
        levers = [disc.mass * (axial - self.centre) ** 2 for axial, disc in turning]
        widths = [disc.transverse - disc.inertia / 2 for _, disc in turning]
        self._derive("transverse", self.inertia / 2 + self.mass * (sum(levers) + sum(widths)) / total)

    def _fill_without_body(self) -> None:
        """Centre and transverse inertia of a shaft whose parts have no mass: of a carrier, or of a `RingPair`."""
        known = self.inertia is not None and self.mass is not None
        body = f"shaft {self.name!r} has no part with a body: no fem.Gear and no Disc"
        require(known, f"{body}; pass inertia= and mass=, or add a Disc to parts")
        axial = list(self.gears) or list(self.parts) or [0.0]
        set_fields(self, centre=sum(axial) / len(axial))
        if self.transverse is None:
            set_fields(self, transverse=self.inertia / 2)

    def _check_rotors(self) -> None:
        names = [self.name, *(rotor.name for rotor in self.rotors)]
        require(len({*names}) == len(names), f"rotors of shaft {self.name!r} share a name, got {names}; rename one")

    def _check_support(self) -> None:
        """Require bearings that support all motions but the spin: a stiffness matrix of rank 5."""
        if not self.bearings:
            return
        support = self.support[:5, :5]
        size = np.diag(support)
        stiffness = f"got {min(size[:2]):g} and {size[2]:g} N/m; give a bearing radial= and axial="
        supported = bool((size[:3] > 0).all())
        require(supported, f"bearings of shaft {self.name!r} need radial and axial stiffness in total, {stiffness}")
        scale = np.sqrt(np.where(size > 0, size, 1.0))
        holds = np.linalg.eigvalsh(support / np.outer(scale, scale))[0] > LEAST_HOLD
        remedy = "give its bearing tilt stiffness or add a second bearing"
        require(bool(holds), f"shaft {self.name!r} is free to tilt; {remedy}")

    def _check_loads(self) -> None:
        """Require bearings that carry forces, unbalance and weight."""
        set_fields(self, gravity=gravity_of(f"shaft {self.name!r}", self.gravity))
        acting = [type(part).__name__ for _, part in parts_of(self, Load)] + ["gravity"] * any(self.gravity)
        carried = f"shaft {self.name!r} has no bearings that carry its {', '.join(acting)}"
        require(bool(self.bearings) or not acting, f"{carried}; add a Bearing or RollingBearing to its parts")

    def _check_beside_gears(self) -> None:
        """Warn of parts that no machine has beside such gears: probably in another unit."""
        if not self.gears:
            return
        largest = max(self.gears.values(), key=lambda gear: gear.r**2 * gear.b)
        bodies = [blank(gear).mass for _, gear in parts_of(self, Gear)]
        for _, disc in self.discs if bodies else ():
            check_rotor_mass(disc.mass, sum(bodies))
        if self.coupling:
            check_torsion(self.coupling.torsion, 2 * abs(largest.r), largest.b)

    @property
    def gears(self) -> dict[float, Gear | Ring]:
        """Axial position [m] -> gear."""
        return dict(parts_of(self, Gear | Ring))

    @property
    def bearings(self) -> dict[float, Bearing | RollingBearing]:
        """Axial position [m] -> bearing."""
        return dict(parts_of(self, Bearing | RollingBearing))

    @property
    def discs(self) -> list[tuple[float, Disc]]:
        """(axial position [m], disc) of each disc."""
        return parts_of(self, Disc)

    @property
    def bodies(self) -> list[tuple[float, Disc]]:
        """(axial position [m], body) of all that has mass: discs, gears and sections."""
        return self.beside_sections + mass_of(self.cylinders, self.material)

    @property
    def beside_sections(self) -> list[tuple[float, Disc]]:
        """(axial position [m], body) of discs and gears; of gears on sections the material around these."""
        rings = [(axial, ring_on(self.cylinders, axial, gear, self.name)) for axial, gear in parts_of(self, Gear)]
        return self.discs + (rings if self.sections else [(x, blank(gear)) for x, gear in parts_of(self, Gear)])

    @property
    def cylinders(self) -> tuple[Section, ...]:
        """The sections; none of a rigid shaft."""
        return placed(self.sections, self.start) if self.sections else ()

    @property
    def forces(self) -> list[tuple[float, ExternalForce]]:
        """(axial position [m], force) of each external force."""
        return parts_of(self, ExternalForce)

    @property
    def unbalances(self) -> list[tuple[float, Unbalance]]:
        """(axial position [m], unbalance) of each unbalance."""
        return parts_of(self, Unbalance)

    @property
    def constant_load(self) -> np.ndarray:
        """(6,) external forces and weight on the centre of mass [N], and their moments about it [N m]."""
        weight = self.mass * np.array([*self.gravity, 0.0, 0.0, 0.0])
        return sum((about(axial - self.centre, force.wrench) for axial, force in self.forces), weight)

    @property
    def is_loaded(self) -> bool:
        """Whether external forces, unbalance or weight act on the shaft."""
        return bool(self.forces or self.unbalances or any(self.gravity))

    @property
    def drags(self) -> list[tuple[float, AnyDrag]]:
        """(axial position [m], drag) of each drag, first those of the bearings."""
        of_bearings = [(axial, bearing.drag) for axial, bearing in self.bearings.items() if bearing.drag]
        return of_bearings + parts_of(self, AnyDrag)

    @property
    def torque_supports(self) -> list[TorqueSupport]:
        """The torsional springs between the shaft and the housing."""
        return [support for _, support in parts_of(self, TorqueSupport)]

    @property
    def coupling(self) -> Coupling | None:
        """The first coupling to an outside rotor; None without one."""
        return next((part for _, part in parts_of(self, Coupling)), None)

    @cached_property
    def rotors(self) -> tuple[Rotor, ...]:
        """The end of an elastic shaft, and the rotors behind all couplings, each before those that are coupled to it.

        Between the end and the gears the shaft is a torsional spring; the inertia of that piece is divided so that its
        lowest mode is exact where the end is held.
        """
        couplings, name, end = parts_of(self, Coupling), self.end_name, self.twist
        at_end = [bool(end) and abs(axial - self.end_position) < AT_END for axial, _ in couplings]
        on_bodies = [
            (name, part) if ends else (self.name, self._in_series(axial, part))
            for ends, (axial, part) in zip(at_end, couplings, strict=True)
        ]
        behind = rotors_of(self.name, on_bodies)
        return (Rotor(name, end, f"{self.name} torsion", self.name), *behind) if end else behind

    def _in_series(self, axial: float, coupling: Coupling) -> Coupling:
        """A coupling beside the end of an elastic shaft, in series with the shaft between it and the next gear."""
        if not self.sections or any(abs(axial - station) < AT_END for station in self.stations[:1]):
            return coupling
        nearest = min(self.stations, key=lambda station: abs(station - axial))
        beside = f"coupling of shaft {self.name!r} at {axial / mm:g} mm lies beyond a gear that is not next to its end"
        ends = f"{beside}, {self.end_position / mm:g} mm; name its end by torque_at={axial:g}"
        require(nearest == self.stations[0], ends)
        shape = twist_shapes(self.beam, [axial, nearest])[:, 0]
        stiffness = float(shape @ self.beam.torsion_stiffness @ shape)
        share = stiffness / (stiffness + coupling.torsion)
        return replace(coupling, torsion=share * coupling.torsion, damping=share**2 * coupling.damping)

    @property
    def end_position(self) -> float:
        """Axial position [m] on which drive, load and couplings of an elastic shaft act (`torque_at`)."""
        if self.torque_at is not None:
            return self.torque_at
        couplings = [axial for axial, _ in parts_of(self, Coupling)]
        if couplings:
            return couplings[0]
        gears = [*self.gears] or [self.centre]
        first, last = (float(x) for x in bounds_of(self.cylinders)[[0, -1]])
        return last if last - max(gears) > min(gears) - first else first

    @property
    def stations(self) -> tuple[float, ...]:
        """Axial positions [m] of the gears, rising in distance from the end; of a shaft without gears its centre."""
        return tuple(sorted([*self.gears] or [self.centre], key=lambda axial: abs(axial - self.end_position)))

    @cached_property
    def beam(self) -> Beam:
        """The finite elements of an elastic shaft, with nodes at all parts; ValueError without sections."""
        return beam_through(self, ())

    @cached_property
    def twist(self) -> Coupling | None:
        """The torsional spring of an elastic shaft between its gears and its end, with the inertia of the end.

        None for a rigid shaft, and where the end lies at a gear.
        """
        if not self.sections:
            return None
        end, stations = self.end_position, self.stations
        inside = min(stations) < end < max(stations)
        between = (
            f"torque_at of shaft {self.name!r} is {end / mm:g} mm, between its gears at {[x / mm for x in stations]} mm"
        )
        require(not inside, f"{between}; drive or load the shaft beside them")
        shape = twist_shapes(self.beam, [end, *stations])[:, 0]
        stiffness = float(shape @ self.beam.torsion_stiffness @ shape)
        if abs(end - stations[0]) < AT_END or stiffness >= RIGID:
            return None
        turning = self.beam.torsion_mass @ shape
        inertia = 2 * float(turning.sum()) - float(shape @ turning)
        damping = 2 * self.damping_ratio * sqrt(stiffness * (self.inertia - inertia))
        return Coupling(stiffness, damping, inertia=inertia, name=self.end_name)

    @property
    def end_name(self) -> str:
        """Name of the rotor that stands for the end of an elastic shaft."""
        return f"{self.name} end"

    @property
    def body_inertia(self) -> float:
        """Inertia about z [kg m^2] of the shaft without its end, which turns on its own."""
        return self.inertia - (self.twist.inertia if self.twist else 0.0)

    @checked
    def bending_frequencies(self, speed: Finite = 0.0) -> np.ndarray:
        """(n,) natural frequencies [Hz] of bending of an elastic shaft on its bearings, rising, without its mates.

        speed   [rad/s], at which gyroscopic moments split each frequency into backward and forward whirl

        Bearings have their tangent stiffness, the mean of both directions. Raises ValueError for rigid shafts.
        """
        return whirl_frequencies(self.beam, self.planar_supports, speed) / (2 * pi)

    @property
    def planar_supports(self) -> dict[float, np.ndarray]:
        """(2, 2) stiffness of each bearing over displacement and slope in one plane, the mean of both planes."""
        flip = np.diag([1.0, -1.0])
        return {
            axial: (k[np.ix_([0, 4], [0, 4])] + flip @ k[np.ix_([1, 3], [1, 3])] @ flip) / 2
            for axial, k in ((axial, bearing.stiffness) for axial, bearing in self.bearings.items())
        }

    @property
    def end(self) -> str:
        """Name of the body that drive or load act on: the outermost rotor of the first chain, else the shaft itself."""
        body = self.name
        while behind := [rotor.name for rotor in self.rotors if rotor.body == body]:
            body = behind[0]
        return body

    @property
    def end_rotor(self) -> Rotor | None:
        """The rotor that drive or load act on; None without a coupling."""
        return next((rotor for rotor in self.rotors if rotor.name == self.end), None)

    @property
    def turning_inertia(self) -> float:
        """Inertia about z of the shaft and of the rotors behind its couplings [kg m^2]."""
        return self.body_inertia + self.rotor_inertia

    @property
    def rotor_inertia(self) -> float:
        """Inertia about z of the end of the shaft and of all rotors behind its couplings [kg m^2]."""
        return sum(rotor.coupling.inertia for rotor in self.rotors)

    @property
    def support(self) -> np.ndarray:
        """(6, 6) stiffness of all bearings about the centre of mass, over x, y, z and about x, y, z."""
        return sum((bearing.at(axial - self.centre) for axial, bearing in self.bearings.items()), np.zeros((6, 6)))


def parts_of(shaft: Shaft, kind=Part) -> list:
    """All parts of a kind as (axial position [m], part), also where a list of parts shares a position."""
    groups = ((axial, part if isinstance(part, tuple) else (part,)) for axial, part in shaft.parts.items())
    return [(axial, part) for axial, group in groups for part in group if isinstance(part, kind)]


def with_bearings(shaft: Shaft, change: Callable[[float, Any], Any]) -> Shaft:
    """The shaft with other bearings; change: (axial position [m], bearing) -> the one in its place."""
    parts: dict[float, list] = {axial: [] for axial in shaft.parts}
    for axial, part in parts_of(shaft):
        parts[axial].append(change(axial, part) if isinstance(part, Bearing | RollingBearing) else part)
    return replace(shaft, parts=parts)


def blank(gear: Gear) -> Disc:
    """The body of a gear, by which `fem.Gear.mass` is told, as a disc."""
    check_rotor_mass(gear.mass)
    return Disc(gear.mass, gear.inertia, gear.transverse)


def beam_through(shaft: Shaft, axial: Sequence[float]) -> Beam:
    """The finite elements of an elastic shaft with further nodes at axial positions [m] on it; ValueError without."""
    if not shaft.sections:
        raise ValueError(f"shaft {shaft.name!r} has no sections; pass sections=[(d, length), ...]")
    toothed = dict(parts_of(shaft, Gear))
    nodes = [*shaft.parts, *shaft.stations, shaft.end_position, *axial]
    pieces = cylinders_of(shaft.cylinders, nodes, toothed, ELEMENT)
    return beam_of(pieces, shaft.material, shaft.beside_sections)
