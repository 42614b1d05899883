"""The gear train of a REXS file: stages between shafts and planetary sets, in the order of the power."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import atan2, cos, hypot, isnan, nan, sin
from typing import Any, NamedTuple

import xarray as xr

from exugear.exchange.rexs_bearings import (
    BEARINGS,
    DAMPING_TIME,
    GUIDANCE,
    SOFT,
    STIFF,
    Options,
    bearing_of,
    rolling_pin,
)
from exugear.exchange.rexs_file import Component
from exugear.exchange.rexs_gears import density_of, gear_of, given_diameters, material_of
from exugear.exchange.rexs_reading import Reading, placing_errors
from exugear.exchange.rexs_shafts import (
    SHORTEST,
    ShaftLayout,
    bearings_of,
    continuous,
    gear_position,
    gears_on,
    gravity_of,
    layout_of,
    masses_of,
    position_of,
    seats_on_shafts,
    torque_position,
    u_of_gear,
)
from exugear.gearbox.bearing import Bearing
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.planetary import Planetary
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Disc, Shaft
from exugear.gearbox.shaft_loads import ExternalForce
from exugear.gearbox.stage import Stage
from fem.gear.gear import Gear
from fem.pair.pair import GearPair
from fem.support.validation import require
from fem.units import deg, mm, um

#: Largest difference between the centre distance of a stage and the distance of its shafts [m].
CLOSE = 0.05 * mm
#: Backlash that counts as none, and that which is assumed where the file holds none [modules].
NO_BACKLASH, ASSUMED_BACKLASH = 1e-3, 0.04
#: Step by which tips are shortened [modules], and most steps.
SHORTENING, SHORTENINGS = 0.02, 25
#: Couplings that hold a shaft where they lead to the housing.
COUPLINGS = "coupling", "switchable_coupling"


@dataclass(frozen=True)
class Mesh:
    """A cylindrical stage: its component, and the two gears with their shafts, the driving one first."""

    component: Component
    gears: tuple[Component, Component]
    shafts: tuple[str, ...]

    @property
    def reversed(self) -> "Mesh":
        """The same with the other gear as pinion."""
        return Mesh(self.component, self.gears[::-1], self.shafts[::-1])


class Planet(NamedTuple):
    """A planet: its shaft, and its gears at the sun and at the ring, two of a stepped planet."""

    layout: ShaftLayout
    at_sun: Component
    at_ring: Component

    @property
    def gears(self) -> list[Component]:
        """Its gears, each once."""
        return [self.at_sun, *([] if self.at_ring is self.at_sun else [self.at_ring])]


@dataclass(frozen=True)
class Set:
    """A planetary stage: its component, shafts of sun, ring and carrier, gears of sun and ring, and planets."""

    component: Component
    shafts: tuple[str, ...]
    sun: Component
    ring: Component
    planets: tuple[Planet, ...]


class Train:
    """Stages and sets of a file with their shafts and gears, of which gearboxes are made."""

    def __init__(self, reading: Reading, options: Options):
        self.reading, self.options = reading, options
        self.layouts: dict[str, ShaftLayout] = {}
        self._names: dict[str, str] = {}
        file = reading.file
        sets = [self._set(stage) for stage in file.of_type("planetary_stage")]
        stages = [
            stage for stage in file.of_type("cylindrical_stage") if not reading.owner_of(stage, "planetary_stage")
        ]
        self.members: list[Mesh | Set] = [*sets, *(self._mesh(stage) for stage in stages)]
        for stage in file.of_type("cylindrical_stage"):
            reading.use(stage)
        self._place_shafts()
        self.held = [name for each in sets for name in each.shafts if self._is_held(self.layouts[name])]
        self._gears: dict[str, tuple[float, Gear]] = {}
        self._shafts: dict[str, Shaft] = {}

    def _place_shafts(self) -> None:
        """Positions that the file does not hold follow from the stages: distance, angle, gears opposite each other."""
        planets = [x.layout for member in self.members if isinstance(member, Set) for x in member.planets]
        layouts = {layout.component.id: layout for layout in (*self.layouts.values(), *planets)}
        if all(layout.known for layout in layouts.values()):
            return
        links = []
        for stage in self.reading.file.of_type("cylindrical_stage"):
            gears = gears_of_stage(self.reading, stage)
            owners = [self.reading.owner_of(gear, "shaft") for gear in gears]
            a = abs(self.reading.number(stage, "center_distance", "m"))
            # about -u from w: v = a sin, w = a cos
            angle = self.reading.number(stage, "rotating_angle_around_neg_u_axis", "rad")
            links.append(([layouts[x.id] for x in owners], gears, (a * sin(angle), a * cos(angle))))  # type: ignore[union-attr]
        if not any(layout.known for layout in layouts.values()):
            links[0][0][0].known = True
        for _ in layouts:
            for (first, second), gears, (x, y) in links:
                for known, unknown, sign in ((first, second, 1), (second, first, -1)):
                    if known.known and not unknown.known:
                        unknown.position = known.position[0] + sign * x, known.position[1] + sign * y
                        gear, mate = gears if known is first else gears[::-1]
                        opposite = known.axial(u_of_gear(self.reading, gear))
                        unknown.known = True
                        unknown.begin = opposite - unknown.sense * u_of_gear(self.reading, mate)
                        words = "position from its stage, as the file does not hold it"
                        self.reading.account.assumed(unknown.component.title, words)
        for member in self.members:
            if isinstance(member, Set):
                sun, _, carrier = (self.layouts[name] for name in member.shafts)
                if not carrier.known:
                    carrier.position, carrier.begin, carrier.known = sun.position, sun.begin, sun.known
        lost = [layout.component.title for layout in layouts.values() if not layout.known]
        require(not lost, f"positions of {lost} do not follow from stages; export support_vector")

    def begin(self, forces: Mapping[str, Mapping[float, ExternalForce]]) -> None:
        """Make all gears and shafts, each once; forces: external ones by shaft and axial position [m]."""
        self.gravity = gravity_of(self.reading)
        components = [gear for member in self.members for gear in _gears_of_member(member)]
        on_shafts = {
            name: [gear for gear in gears_on(self.reading, layout.component) if gear in components]
            for name, layout in self.layouts.items()
        }
        for name, gears in on_shafts.items():
            self._gears |= {gear.id: self._placed_gear(self.layouts[name], gear) for gear in gears}
        for member in self.members:
            if isinstance(member, Set):
                on_planets = [(x.layout, gear) for x in member.planets for gear in x.gears]
                self._gears |= {gear.id: self._placed_gear(layout, gear) for layout, gear in on_planets}
                for alike in zip(*(x.gears for x in member.planets), strict=True):
                    kinds = {self._gears[gear.id][1] for gear in alike}
                    require(len(kinds) == 1, f"planets of {member.component.title} differ, which is not read: {kinds}")
        for member in self.members:
            for pinion, wheel, a in self._mates(member):
                self._shorten(pinion, wheel, a)
        of_sets = {name for member in self.members if isinstance(member, Set) for name in member.shafts}
        parallel = [layout for name, layout in self.layouts.items() if name not in of_sets]
        self._seats = seats_on_shafts(self.reading, parallel)
        self._pins = {x.component.id: self._pin(x) for x in self.members if isinstance(x, Set)}
        for name, gears in on_shafts.items():
            placed = [self._gears[gear.id] for gear in gears]
            self._shafts[name] = self._shaft(name, placed, forces.get(name, {}))

    @property
    def first_shaft(self) -> str:
        """The shaft whose speed the file defines, else that of the first gear."""
        defining = (x.name for x in self.layouts.values() if self.reading.flag(x.component, "defines_speed"))
        return next(defining, self.members[0].shafts[0])

    def loaded_shafts(self) -> list[str]:
        """Shafts with an outside load that transmits torque."""
        loads = {name: self.reading.parts_of(x.component, "external_load") for name, x in self.layouts.items()}
        return [name for name, x in loads.items() if any(self.reading.flag(load, "transmits_torque") for load in x)]

    def in_order(self, first: str) -> list[Mesh | Set]:
        """Members from the first shaft on, the driving gear first; ValueError where some are not coupled to it."""
        reached, ordered, left = {first}, [], [*self.members]
        while left:
            coupled = [member for member in left if reached & {*member.shafts}]
            if not coupled:
                apart = sorted({name for member in left for name in member.shafts})
                unit = (
                    f"the shafts {apart} of {self.reading.file.path} are not coupled to {first!r} by cylindrical stages"
                )
                raise ValueError(f"{unit}; export one gear train")
            for member in coupled:
                left.remove(member)
                turned = isinstance(member, Mesh) and member.shafts[0] not in reached
                ordered.append(member.reversed if turned else member)  # type: ignore[union-attr]
                reached |= {*member.shafts}
        return ordered

    def pairs(self, member: Mesh | Set) -> list[tuple[GearPair, float]]:
        """Pairs of a member, of a set those of sun and ring, with the z of the wheel from the pinion [m]."""
        pairs = []
        for pinion, wheel, a in self._mates(member):
            (z_1, first), (z_2, second) = self._gears[pinion.id], self._gears[wheel.id]
            with placing_errors(member.component, self.reading.file):
                pairs.append((GearPair(first, second, a=a), z_2 - z_1 if isinstance(member, Mesh) else 0.0))
        return pairs

    def _mates(self, member: Mesh | Set) -> list[tuple[Component, Component, float]]:
        """Gears that mesh and their centre distance [m]; of a set those of the first planet."""
        if isinstance(member, Mesh):
            return [(*member.gears, self._centre_distance(member))]
        planet, centre = member.planets[0], self.layouts[member.shafts[0]].position
        a = hypot(planet.layout.position[0] - centre[0], planet.layout.position[1] - centre[1])
        return [(member.sun, planet.at_sun, a), (planet.at_ring, member.ring, a)]

    def _shorten(self, pinion: Component, wheel: Component, a: float) -> None:
        """Shorten tips, whose diameters the file does not hold, until they clear the roots of their mates."""
        free = [gear for gear in (wheel, pinion) if "d_a" not in given_diameters(self.reading, gear)]
        for gear in free:
            full = self._gears[gear.id][1]
            for step in range(SHORTENINGS + 1):
                shorter = replace(full, d_a=full.d_a - 2 * step * SHORTENING * full.m_n)
                first, second = (shorter if x is gear else self._gears[x.id][1] for x in (pinion, wheel))
                if _run_together(first, second, a):
                    break
            else:
                continue
            if step:
                alike = [x for x in self._gears if self._gears[x][1] == full]
                self._gears |= {x: (self._gears[x][0], shorter) for x in alike}
                words = f"tip shortened by {step * SHORTENING:.2g} m_n to clear the mate's root"
                self.reading.account.assumed(gear.title, f"{words}: d_a = {shorter.d_a / mm:.6g} mm")
            return

    def gearbox(self, members: Iterable[Mesh | Set], laws: list[xr.Dataset], damping_ratio: float, **ends) -> Gearbox:
        """The gearbox with a map for each pair of the members, in their order."""
        given = iter(laws)
        parts: Any = []
        for member in members:
            if isinstance(member, Set):
                parts.append(self._planetary(member, next(given), next(given), damping_ratio))
            else:
                parts.append(self._stage(member, next(given), damping_ratio))
        between = {
            (seat.carried.name, seat.axial): (seat.carrying.name, seat.axial)
            for seat in self._seats.values()
            if self._shafts[seat.carried.name].bearings
        }
        return Gearbox(parts, held=tuple(self.held), between=between, **ends)

    def note(self, members: Iterable[Mesh | Set]) -> None:
        """Note the pairs and what is assumed of them."""
        for member in members:
            if any(self.gravity) and isinstance(member, Set):
                self.reading.account.left_out(member.component.title, "weight of its planets, which orbit")
            for pair, _ in self.pairs(member):
                self.reading.account.read(member.component.title, f"{pair}")
                _, assumed = self._backlash(member.component, pair)
                if assumed:
                    self.reading.account.assumed(member.component.title, assumed)
        for name in self.held:
            self.reading.account.read(self.layouts[name].component.title, "held by the housing")

    def _layout(self, component: Component) -> ShaftLayout:
        """The layout of a shaft, made once."""
        if component.id not in self._names:
            plain = (component.name or f"shaft {component.id}").replace("$", "").lstrip("_") or f"shaft {component.id}"
            name = f"{plain} [{component.id}]" if plain in self.layouts else plain
            self._names[component.id] = name
            self.layouts[name] = layout_of(self.reading, component, name)
        return self.layouts[self._names[component.id]]

    def _shaft_of(self, gear: Component) -> ShaftLayout:
        owner = self.reading.owner_of(gear, "shaft")
        require(owner is not None, f"{gear.title} stands on no shaft; export its relations")
        return self._layout(owner)  # type: ignore[arg-type]

    def _mesh(self, stage: Component) -> Mesh:
        gears = gears_of_stage(self.reading, stage)
        return Mesh(stage, gears, tuple(self._shaft_of(gear).name for gear in gears))

    def _set(self, stage: Component) -> Set:
        """The set of a planetary stage: its shafts by their relations, its gears by its meshes."""
        reading, file = self.reading, self.reading.file
        reading.use(stage)

        def shafts(type: str) -> list[Component]:
            related = file.related(type, planetary_stage=stage.id)
            return [file.components[relation.roles["shaft"]] for relation in related]

        central, carriers, planets = (shafts(f"{x}_shaft") for x in ("central", "planet_carrier", "planet"))
        gears = {shaft.id: gears_on(reading, shaft) for shaft in central}
        rings = [gear for x in gears.values() for gear in x if gear.type == "ring_gear"]
        suns = [gear for x in gears.values() for gear in x if gear.type != "ring_gear"]
        simple = len(rings) == len(suns) == 1 and carriers and planets
        kinds = f"{len(suns)} suns, {len(rings)} rings, {len(planets)} planets"
        require(bool(simple), f"{stage.title} has {kinds}; sets of one sun, one ring and planets between are read")
        on_planets = []
        for shaft in planets:
            on_shaft = gears_on(reading, shaft)
            layout = layout_of(reading, shaft, shaft.name or f"planet {shaft.id}")
            on_planets.append(Planet(layout, *(self._mate(mate, on_shaft, shaft) for mate in (suns[0], rings[0]))))
        if on_planets[0].at_sun is not on_planets[0].at_ring:
            angle = f"{self.options.step_angle / deg:.6g} deg"
            words = f"a tooth at the ring stands {angle} ahead of one at the sun, step_angle=, as REXS does not hold it"
            reading.account.assumed(stage.title, f"of a stepped planet {words}")
        carrier = self._layout(carriers[0])
        for further in carriers[1:]:
            self._names[further.id] = carrier.name
            reading.use(further)
        sun, ring = (self._shaft_of(gear) for gear in (suns[0], rings[0]))
        return Set(stage, (sun.name, ring.name, carrier.name), suns[0], rings[0], tuple(on_planets))

    def _mate(self, gear: Component, candidates: list[Component], shaft: Component) -> Component:
        """The gear of a planet that meshes with a sun or ring, by the meshes of the file where it has two."""
        if len(candidates) == 1:
            return candidates[0]
        ids = {x.id: x for x in candidates}
        for stage in self.reading.file.of_type("cylindrical_stage"):
            pair = [x.id for x in gears_of_stage(self.reading, stage)]
            if gear.id in pair and ids.keys() & {*pair}:
                return ids[next(x for x in pair if x in ids)]
        raise ValueError(
            f"{shaft.title} carries {len(ids)} gears, none of which meshes with {gear.title}; export stages"
        )

    def _is_held(self, layout: ShaftLayout) -> bool:
        """Whether an engaged coupling leads from a shaft to the housing."""
        for role in ("inner_part", "outer_part"):
            for relation in self.reading.file.related("side", **{role: layout.component.id}):
                parts = [self.reading.file.components[id] for id in relation.roles.values()]
                coupling = next((part for part in parts if part.type in COUPLINGS), None)
                if coupling is not None and any(part.type == "gear_casing" for part in parts):
                    self.reading.use(coupling)
                    states = self.reading.flags(coupling, "is_engaged", default=True)
                    return any(states)
        return False

    def _placed_gear(self, layout: ShaftLayout, component: Component) -> tuple[float, Gear]:
        axial = gear_position(self.reading, layout, component)
        axis = self.reading.vector(component, "u_axis_vector", "m")
        sense = layout.sense if axis is None else 1 if axis[0] > 0 else -1
        with placing_errors(component, self.reading.file):
            return axial, gear_of(self.reading, component, layout.at(axial), sense)

    def _shaft(self, name: str, gears: list[tuple[float, Gear]], forces: Mapping[float, ExternalForce]) -> Shaft:
        layout, account = self.layouts[name], self.reading.account
        of_set = next((x for x in self.members if isinstance(x, Set) and name in x.shafts), None)
        bearings = self._bearings(layout, of_set)
        acting = self._acting(layout.component.title, bearings, forces)
        masses, sections = masses_of(self.reading, layout), None
        options: dict[str, Any] = {"gravity": self.gravity} if bearings else {}
        if of_set is None and self.options.elastic:
            faces = [(axial - gear.b / 2, axial + gear.b / 2, gear.d_f) for axial, gear in gears if not gear.internal]
            needed = [*(axial for axial, _ in (*gears, *masses)), *bearings, *acting]
            seats = [x.axial for x in self._seats.values() if x.carrying is layout]
            sections = continuous(layout, [*needed, *seats], faces, seats)
        if sections:
            discs = masses
            options |= {"sections": sections.sections, "start": sections.start}
            options |= {"material": material_of(self.reading, layout.component)}
            end, positions = torque_position(self.reading, layout), [axial for axial, _ in gears]
            last = sections.start + sum(section[1] for section in sections.sections)
            if end is not None and sections.start - SHORTEST <= end <= last + SHORTEST:
                inside = min(positions) < end < max(positions)
                options |= {} if inside else {"torque_at": min(max(end, sections.start), last)}
            for words in sections.assumed:
                account.assumed(layout.component.title, words)
        else:
            covered = [(axial - gear.b / 2, axial + gear.b / 2) for axial, gear in gears]
            discs = [*merged(layout.bare_discs(covered, density_of(self.reading, layout.component))), *masses]
        if of_set and name == of_set.shafts[2]:
            discs += self._carrier_discs(of_set, bare=not discs)
        parts: dict[float, list] = {}
        for axial, part in [*gears, *discs, *bearings.items(), *acting.items()]:
            parts.setdefault(axial, []).append(part)
        listed = {axial: tuple(group) if len(group) > 1 else group[0] for axial, group in parts.items()}
        with placing_errors(layout.component, self.reading.file):
            shaft = Shaft(name, listed, **options)
        kind = "elastic where the plan shows that it matters" if sections else "rigid"
        account.read(layout.component.title, f"{len(layout.sections)} sections, {shaft.mass:.4g} kg, {kind}")
        return shaft

    def _bearings(self, layout: ShaftLayout, of_set: Set | None) -> dict[float, Any]:
        """The bearings of a shaft; of a member of a planetary set linear ones if its planets have elastic pins."""
        title = layout.component.title
        if of_set is None:
            return bearings_of(self.reading, layout, rolling=self.options.rolling, seats=self._seats)
        if self._pins[of_set.component.id] is None:
            self.reading.account.assumed(title, "ideal bearings, as the planets of its set turn on ideal pins")
            return {}
        if layout.name in self.held:
            self.reading.account.assumed(title, "ideal bearings, as the housing holds it")
            return {}
        planets = [planet.layout.component for planet in of_set.planets]
        bearings = bearings_of(self.reading, layout, rolling=False, planets=planets)
        if not holds(bearings):
            given = "has no bearings" if not bearings else "would be free on its bearings"
            self.reading.account.assumed(title, f"ideal bearings: it {given}")
            return {}
        return bearings

    def _acting(
        self, title: str, bearings: Mapping[float, Any], forces: Mapping[float, ExternalForce]
    ) -> Mapping[float, ExternalForce]:
        """The external forces that bearings carry; others are left out in words."""
        for axial, force in forces.items():
            where = f"{force} at {axial / mm:.4g} mm"
            if bearings:
                self.reading.account.read(title, where)
            else:
                self.reading.account.left_out(title, f"{where}: ideal bearings take it")
        return forces if bearings else {}

    def _carrier_discs(self, each: Set, *, bare: bool) -> list[tuple[float, Disc]]:
        """Side plates of a carrier; where it has no body at all, a disc of steel over its planets, as wide as they."""
        discs = []
        for carrier in self.reading.parts_of(each.component, "planet_carrier"):
            self.reading.use(carrier)
            for plate in self.reading.parts_of(carrier, "side_plate"):
                self.reading.use(plate)
                width = self.reading.number(plate, "length", "m")
                outer, inner = (self.reading.number(plate, f"{x}_diameter", "m", 0.0) for x in ("outer", "inner"))
                position = position_of(self.reading, plate)
                axial = 0.0 if position is None else float(position[0]) + width / 2
                discs.append((axial, Disc.cylinder(width, outer, inner, density_of(self.reading, plate))))
                self.reading.account.read(plate.title, f"disc of {discs[-1][1].mass:.4g} kg")
        if discs or not bare:
            return discs
        layout, gear = each.planets[0].layout, each.planets[0].at_sun
        centre = self.layouts[each.shafts[0]].position
        width = self.reading.number(gear, "face_width", "m")
        diameter = 2.2 * hypot(layout.position[0] - centre[0], layout.position[1] - centre[1])
        words = f"a steel disc of {diameter / mm:.4g} mm, {width / mm:.4g} mm wide, as it has no section"
        self.reading.account.assumed(self.layouts[each.shafts[2]].component.title, words)
        return [(layout.begin, Disc.cylinder(width, diameter))]

    def _stage(self, mesh: Mesh, law: xr.Dataset, damping_ratio: float) -> Stage:
        (pair, _), (z_1, _) = self.pairs(mesh)[0], self._gears[mesh.gears[0].id]
        (x_1, y_1), (x_2, y_2) = (self.layouts[name].position for name in mesh.shafts)
        sign = -1 if pair.internal else 1
        fast, slow = (self._shafts[name] for name in mesh.shafts)
        options: dict[str, Any] = {"angle": atan2(sign * (y_2 - y_1), sign * (x_2 - x_1))}
        if sum(gear == pair.pinion for gear in fast.gears.values()) > 1:
            options["axial_position"] = z_1
        options["backlash"] = self._backlash(mesh.component, pair)[0]
        return Stage(fast, slow, law, damping_ratio=damping_ratio, **options)

    def _planetary(self, member: Set, sun_law: xr.Dataset, ring_law: xr.Dataset, damping_ratio: float) -> Planetary:
        sun, ring, carrier = (self._shafts[name] for name in member.shafts)
        x, y = self.layouts[member.shafts[0]].position
        angles = [atan2(each.layout.position[1] - y, each.layout.position[0] - x) for each in member.planets]
        (sun_pair, _), (ring_pair, _) = self.pairs(member)
        options: dict[str, Any] = {
            "sun_pair": sun_pair,
            "ring_pair": ring_pair,
            "angles": angles,
            "pin": self._pins[member.component.id],
        }
        axial = self._gears[member.sun.id][0]
        options["planet"] = [self._planet(planet, axial) for planet in member.planets]
        stepped = member.planets[0].at_sun is not member.planets[0].at_ring
        options["step_angle"] = self.options.step_angle if stepped else None
        return Planetary(
            sun=sun,
            ring=ring,
            carrier=carrier,
            sun_mesh=sun_law,
            ring_mesh=ring_law,
            damping_ratio=damping_ratio,
            **{name: value for name, value in options.items() if value is not None},
        )

    def _planet(self, planet: Planet, axial: float) -> Shaft:
        """A planet with the material of its shaft, its gear opposite the sun at an axial position [m]."""
        first = self._gears[planet.at_sun.id][0]
        gears = [(axial + self._gears[gear.id][0] - first, self._gears[gear.id][1]) for gear in planet.gears]
        faces = [(at - gear.b / 2, at + gear.b / 2) for at, gear in gears]
        discs = merged(planet.layout.bare_discs(faces, density_of(self.reading, planet.layout.component)))
        parts: dict[float, list] = {}
        for at, part in [*gears, *discs]:
            parts.setdefault(at, []).append(part)
        return Shaft(planet.layout.name, {at: tuple(x) if len(x) > 1 else x[0] for at, x in parts.items()})

    def _pin(self, each: Set) -> Bearing | RollingBearing | None:
        """The bearing between planet and pin, of several all about the planet's gear; None for an ideal one.

        Rolling bearings keep their force law as rows of a single bearing, else all count by their linear stiffness.
        """
        planet = each.planets[0]
        layout, middle = planet.layout, self._gears[planet.at_sun.id][0]
        components = []
        for relation in self.reading.file.related("side", outer_part=layout.component.id):
            component = self.reading.file.components[relation.roles.get("assembly", layout.component.id)]
            if component.type in BEARINGS:
                u = self.reading.number(component, "u_coordinate_on_shaft_outer_side", "m", nan)
                components.append((component, 0.0 if isnan(u) else layout.axial(u) - middle))
        if self.options.rolling and components and (law := rolling_pin(self.reading, components, layout.sense)):
            self.reading.account.read(each.component.title, f"planets on rolling bearings: {law}")
            return law
        radial = axial = tilt = 0.0
        for component, lever in components:
            bearing = bearing_of(self.reading, component, None, rolling=False)
            radial, axial = radial + bearing.radial, axial + bearing.axial  # type: ignore[union-attr]
            tilt += bearing.tilt + bearing.radial * lever**2  # type: ignore[union-attr]
        if radial < SOFT or radial >= STIFF:
            return None
        if axial < SOFT:
            axial = GUIDANCE
            self.reading.account.assumed(each.component.title, f"washers hold planets along their pins: {axial:g} N/m")
        pin = Bearing(radial=radial, axial=axial, tilt=tilt, damping_time=DAMPING_TIME)
        self.reading.account.read(each.component.title, f"planets on elastic pins: {pin}")
        return pin

    def _centre_distance(self, mesh: Mesh) -> float:
        """Of the stage [m], which its shafts must have; where the file lacks it, that of the shafts."""
        (x_1, y_1), (x_2, y_2) = (self.layouts[name].position for name in mesh.shafts)
        apart = hypot(x_2 - x_1, y_2 - y_1)
        self.reading.number(mesh.component, "rotating_angle_around_neg_u_axis", "rad", 0.0)
        a = abs(self.reading.number(mesh.component, "center_distance", "m", apart))
        unlike = (
            f"center_distance of {mesh.component.title} is {a / mm:g} mm, but its shafts lie {apart / mm:g} mm apart"
        )
        require(abs(a - apart) < CLOSE, f"{unlike}; export the positions again")
        return a

    def _backlash(self, component: Component, pair: GearPair) -> tuple[float, str]:
        """Along the line of action [m]: of the stage, or of the gears, or assumed, with the words for it."""
        ends = "minimum", "maximum"
        low, high = (self.reading.number(component, f"{end}_normal_backlash", "m", 0.0) for end in ends)
        if high > 0:
            return (low + high) / 2 / cos(pair.beta_b), ""
        if pair.backlash > NO_BACKLASH * pair.pinion.m_n:
            return pair.backlash, ""
        assumed = ASSUMED_BACKLASH * pair.pinion.m_n
        return assumed, f"backlash of {assumed / um:.4g} um, {ASSUMED_BACKLASH:g} m_n, as the sizes leave none"


def merged(discs: Sequence[tuple[float, Disc]]) -> list[tuple[float, Disc]]:
    """Discs at axial positions [m] as a rigid body, at its centre of mass; none of none."""
    if not discs:
        return []
    mass = sum(disc.mass for _, disc in discs)
    centre = sum(disc.mass * axial for axial, disc in discs) / mass
    transverse = sum(disc.transverse + disc.mass * (axial - centre) ** 2 for axial, disc in discs)
    return [(centre, Disc(mass, sum(disc.inertia for _, disc in discs), transverse))]


def holds(bearings: Mapping[float, Any]) -> bool:
    """Whether bearings at axial positions [m] hold a shaft against all motions but its spin."""
    if not bearings:
        return False
    try:
        Shaft("shaft", {0.0: Disc.cylinder(10 * mm, 50 * mm), **bearings})
    except ValueError:
        return False
    return True


def _gears_of_member(member: Mesh | Set) -> tuple[Component, ...]:
    return member.gears if isinstance(member, Mesh) else (member.sun, member.ring)


def _run_together(pinion: Gear, wheel: Gear, a: float) -> bool:
    try:
        GearPair(pinion, wheel, a=a)
    except ValueError as error:
        return "interference" not in str(error) and "clearance" not in str(error)
    return True


def gears_of_stage(reading: Reading, stage: Component) -> tuple[Component, Component]:
    """The two gears of a stage."""
    for relation in reading.file.related("stage", stage=stage.id):
        ids = [relation.roles.get(role, "") for role in ("gear_1", "gear_2")]
        if all(id in reading.file.components for id in ids):
            return reading.file.components[ids[0]], reading.file.components[ids[1]]
    raise ValueError(f"{stage.title} of {reading.file.path} has no relation with two gears; export its relations")
