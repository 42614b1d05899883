"""The plan of a gearbox: coordinates of its shafts and axes of its maps, with the reason for each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields

import numpy as np

from exugear.gearbox.constant_loads import given_loads, idle_stages, words_of
from exugear.gearbox.elastic_carrier import check_series
from exugear.gearbox.elastic_housing import ElasticHousing
from exugear.gearbox.elastic_shaft import ElasticShaft
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.seats_on_shafts import names_between
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.stage import Stage
from exugear.gearbox.tooth_numbers import sides_from_behind
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.mesh_friction import MeshFriction
from exugear.planning.coordinates import Coordinates
from exugear.planning.housing_choice import chosen_housing
from exugear.planning.map_axes import largest_load, missing_axes, stage_law, why_coast_differs
from exugear.planning.rolling_bearings import linear_in_runs, with_linear_bearings, words_on_rolling_bearings
from exugear.planning.sampling import listed_phases
from exugear.planning.set_words import stages_of_sets, words_of_sets
from exugear.planning.shaft_flexibility import flexibility
from fem.support.arguments import checked, keywords_after_first
from fem.support.blas_threads import one_thread
from fem.support.validation import require
from fem.units import um

#: Relative coupling stiffness, or distance [m], that counts as rounding.
ROUNDING = 1e-9
UNDAMPED = "damping: none, vibrations do not decay; give Stage(damping_ratio=0.06)"
NO_BACKLASH = "no backlash, coast flanks touch as soon as the teeth part; give GearPair(a=...) or Stage(backlash=...)"
COAST_MAPPED = "coast flank by the torques < 0 of the map"
COAST_OF_PAIRS = "coast flank by the tooth pairs of the mirror image"
COAST_MIRRORED = (
    "coast flank taken as mirror image of the driving flank, which it is not, as {}; map torques < 0 too, say "
    "fem.static_transmission_error(pair, [-350, -150, 0, 150, 350])"
)
COAST_COMPOSED = (
    "coast flank taken as mirror image of the driving flank, which it is not, as {}; where torque reverses, give the "
    "law coast=fem.tooth_pair_map(fem.mirror_image(pair), ...)"
)
RAMP = "assumed to ramp in over {:.3g} um of penetration (damping_ramp=), which moves jumps where teeth part"
JUMPS = "its force jumps at phase {}: at constant speed steps divide the mesh period; else smooth the table"


@checked
@dataclass(frozen=True)
class Plan:
    """How a gearbox becomes a model, decided from the scene alone; print it.

    shafts      coordinates of each shaft
    why         reason for the coordinates, by shaft
    laws        force law of each stage by its label, with the axes that the scene needs
    axes        reason for the axes, by stage
    undamped    whether no mesh, bearing or coupling is damped
    bearings    by shaft: whether the load leaves the linear range of its rolling bearings, and what is estimated
    losses      friction of stages and drag of shafts, by their labels and names; empty without them
    damping     of the mesh of each stage that is damped, in N s/m, its critical share and its ramp, by its label
    mirrored    by stage: why its coast flank is not the mirror image of the driving flank that the law takes
    sets        what is modelled of each planetary set and what is skipped, by the name of its carrier
    set_stages  labels of the stages on each carrier, by its name
    elastic     elastic shafts by their names, with the coordinates that they need
    flexible    reason for these coordinates or for none, by shaft with sections; their errors in a run, by stage
    steps       step of a run [s] in which the bearing forces of elastic shafts are accurate, by their names
    housing     what of a housing the run takes, and what it leaves out; empty without a housing
    elastic_housing  the housing with the coordinates that it has in a run; None where its static stiffness suffices
    linear      names of the shafts whose rolling bearings are linear in runs

    Integrator, step and cost depend on the eigenfrequencies of the built system: `BuiltPlan`, the plan of a model.
    """

    shafts: Mapping[str, Coordinates]
    why: Mapping[str, str]
    laws: Mapping[str, MeshForce]
    axes: Mapping[str, str]
    undamped: bool = False
    losses: Mapping[str, str] = field(default_factory=dict)
    damping: Mapping[str, str] = field(default_factory=dict)
    mirrored: Mapping[str, str] = field(default_factory=dict)
    bearings: Mapping[str, str] = field(default_factory=dict)
    sets: Mapping[str, str] = field(default_factory=dict)
    set_stages: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    elastic: Mapping[str, ElasticShaft] = field(default_factory=dict)
    flexible: Mapping[str, str] = field(default_factory=dict)
    steps: Mapping[str, float] = field(default_factory=dict)
    housing: str = ""
    elastic_housing: ElasticHousing | None = None
    linear: Sequence[str] = ()

    def with_joints(self) -> "Plan":
        """The unreduced plan: every shaft a rigid body in space on an ideal revolute joint."""
        return self._with(dict.fromkeys(self.shafts, Coordinates.JOINT))

    def with_bodies(self) -> "Plan":
        """The plan in which planar bodies move in space, to check the reduction."""
        planar = [name for name, kind in self.shafts.items() if kind is Coordinates.PLANAR]
        return self._with(dict.fromkeys(planar, Coordinates.BEARINGS))

    def _with(self, shafts: Mapping[str, Coordinates]) -> "Plan":
        """The plan with other coordinates of these shafts."""
        why = dict.fromkeys(shafts, "chosen by the user: unreduced, to check the reduction")
        scene = {field.name: getattr(self, field.name) for field in fields(Plan)}
        scene["elastic"] = {
            name: elastic for name, elastic in self.elastic.items() if shafts.get(name) is not Coordinates.JOINT
        }
        if all(kind is Coordinates.JOINT for kind in shafts.values()) and {*shafts} == {*self.shafts}:
            scene |= {"elastic_housing": None, "housing": "no shaft moves on its seats" * bool(self.housing)}
        return Plan(**scene | {"shafts": {**self.shafts, **shafts}, "why": {**self.why, **why}})

    def with_rigid_shafts(self) -> "Plan":
        """The plan in which shafts with sections twist towards their ends, but do not bend."""
        rigid = dict.fromkeys(self.elastic, "rigid: chosen by the user")
        scene = {field.name: getattr(self, field.name) for field in fields(Plan)}
        flexible = {name: text for name, text in self.flexible.items() if name in self.shafts} | rigid
        return Plan(**scene | {"elastic": {}, "flexible": flexible, "steps": {}})

    def lines(self) -> list[str]:
        """The printed plan, line by line, as far as it is known before the model is built."""
        lines = [f"{name}: {self._coordinates(name)} ({self.why[name]})" for name in self.shafts]
        lines += [f"planetary set on {carrier}: {text}" for carrier, text in self.sets.items()]
        lines += [f"{name}: {text}" for name, text in self.flexible.items()]
        lines += [f"housing: {self.housing}"] if self.housing else []
        lines += [f"{label}: {text}" for label, text in self.axes.items()]
        lines += [f"{label}: damping {text}" for label, text in self.damping.items()]
        lines += [f"{name}: {text}" for texts in (self.bearings, self.losses) for name, text in texts.items()]
        lines += [f"{label}: {NO_BACKLASH}" for label, law in self.laws.items() if law.backlash == 0]
        for label, law in self.laws.items():
            if law.coast is not None:
                lines.append(f"{label}: {COAST_MAPPED if law.coast.teeth is None else COAST_OF_PAIRS}")
        for label, reason in self.mirrored.items():
            coast = COAST_MIRRORED if self.laws[label].teeth is None else COAST_COMPOSED
            lines.append(f"{label}: {coast.format(reason)}")
        lines += [UNDAMPED] * self.undamped
        for label, law in self.laws.items():
            if law.jumps.size:
                lines.append(f"{label}: {JUMPS.format(listed_phases(law.jumps))}")
        return lines

    def _coordinates(self, name: str) -> str:
        """Coordinates of a shaft in words; those of an elastic one follow in a line of its own."""
        if name not in self.elastic or not self.elastic[name].spatial:
            return self.shafts[name].value
        gears = len(self.elastic[name].shaft.stations)
        return f"6 coordinates of {'its gear' if gears == 1 else 'each gear'}, elastic shaft on elastic bearings"

    def __str__(self) -> str:
        return "\n".join([*self.lines(), "integrator and step: known once the model is built (build(box).plan)"])

    __repr__ = __str__


@keywords_after_first()
@checked
def plan(
    gearbox: Gearbox,
    *,
    load: float | None = None,
    loads: Mapping[str, float] | None = None,
    housing_modes: int | None = None,
    linear_bearings: Sequence[str] | None = None,
) -> Plan:
    """Choose coordinates for the shafts of a gearbox and axes for its maps, no more than the scene needs.

    A shaft without bearings only spins. With bearings it is a planar body where nothing tilts it or pushes it along
    its axis, else a rigid body in space. A map keeps the axes (centre distance, misalignment, axial offset) along which
    its bodies move; the others are fixed at their static values. The plan gives a reason for each of these choices.

    load    torque on the driven shaft [N m] under which the plan estimates how far the gears move along axes that their
            maps lack; by default the largest that all maps carry. Where that motion matters the plan prints the
            `fem.Offsets` to map
    loads   instead, of a gearbox with several outputs: name of a shaft -> torque against its motion [N m]
    housing_modes  number of modes in which the housing vibrates, for its surface velocity more than the gears feel, or
            fewer; by default as many as change the forces of its seats by 1 %, none where static stiffness suffices
    linear_bearings  names of the shafts whose rolling bearings have in runs the constant stiffness of the centred
            position, [] for none; by default those that twice the load displaces by that stiffness within 1 %

    Returns a `Plan`: print it, pass it to `exugear.build`. Integrator, step and cost are known once the model is built.
    Raises ValueError for statically displaced shafts whose map lacks the axis, or whose map ends before their offsets.
    """
    with one_thread():
        return _plan(gearbox, load, loads, housing_modes, linear_bearings)


def _plan(
    gearbox: Gearbox,
    load: float | None,
    loads: Mapping[str, float] | None,
    housing_modes: int | None,
    linear_bearings: Sequence[str] | None,
) -> Plan:
    """`plan`; its many small eigenproblems take up to 40 times longer on several threads of a machine at work."""
    for name, stiffness in gearbox.elastic_carriers.items():
        check_series(stiffness, gearbox.ends[name], gearbox.planets_by_carrier[name], gearbox.arms_of_pins)
    chosen = load is not None or loads is not None
    torques = given_loads(gearbox, load, loads) if chosen else largest_load(gearbox)
    kinds = {shaft.name: _coordinates(gearbox, shaft)[0] for shaft in gearbox.shafts}
    linear = linear_in_runs(gearbox, kinds, torques) if linear_bearings is None else tuple(linear_bearings)
    nonlinear, gearbox = gearbox, with_linear_bearings(gearbox, linear)
    choices = {shaft.name: _coordinates(gearbox, shaft) for shaft in gearbox.shafts}
    shafts = {name: kind for name, (kind, _) in choices.items()}
    why = {name: reason for name, (_, reason) in choices.items()}
    why |= {name: f"{why[name]}; held: its spin stays 0, and it takes the reaction" for name in gearbox.held}
    if gearbox.speeds:
        free = f"one of {len(gearbox.independent)} speeds that the meshes leave free"
        why |= {name: f"{why[name]}; {free}" for name in gearbox.independent}
    elastic, flexible, steps = flexibility(gearbox, shafts)
    shafts |= {name: Coordinates.BEARINGS for name, shaft in elastic.items() if shaft.spatial}
    reduced = [stage_law(gearbox, stage, shafts) for stage in gearbox.stages]
    laws = dict(zip(gearbox.labels, (law for law, _ in reduced), strict=True))
    advice = missing_axes(gearbox, shafts, torques, elastic)
    idle, under = idle_stages(gearbox, torques), f"idle under {words_of(gearbox, torques)}, its teeth are open"
    open_teeth = [under if label in idle else "" for label in gearbox.labels]
    gaps = [f"driving flanks {gap / um:.4g} um apart, by the thickness of teeth" if gap else "" for gap in gearbox.gaps]
    behind = sides_from_behind(gearbox.stages, gearbox.flank_senses)
    texts = zip((reason for _, reason in reduced), gaps, advice, open_teeth, behind, strict=True)
    reasons = ("; ".join(filter(None, parts)) for parts in texts)
    axes = dict(zip(gearbox.labels, reasons, strict=True))
    stages = dict(zip(gearbox.labels, gearbox.stages, strict=True))
    mirrored = {label: why_coast_differs(stage, laws[label], shafts) for label, stage in stages.items()}
    mirrored = {label: reason for label, reason in mirrored.items() if reason}
    of_sets = words_of_sets(gearbox, shafts), stages_of_sets(gearbox)
    rolling = words_on_rolling_bearings(nonlinear, shafts, torques, linear)
    beside = _undamped(gearbox), _losses(gearbox), _damping(gearbox), mirrored, rolling
    housing, words = chosen_housing(gearbox, shafts, housing_modes)
    return Plan(shafts, why, laws, axes, *beside, *of_sets, elastic, flexible, steps, words, housing, linear)


def _undamped(gearbox: Gearbox) -> bool:
    """Whether no mesh, bearing or coupling is damped."""
    damping = [rotor.coupling.damping for shaft in gearbox.shafts for rotor in shaft.rotors]
    damping += [bearing.damping_time for shaft in gearbox.shafts for bearing in shaft.bearings.values()]
    return not any([*damping, *(stage.force.damping for stage in gearbox.stages)])


def _damping(gearbox: Gearbox) -> dict[str, str]:
    """Damping of each damped mesh in words."""
    return {
        label: f"{stage.force.damping:.4g} N s/m, {stage.force.damping / stage.critical_damping:.3g} of the critical "
        f"{stage.critical_damping:.4g} N s/m of both shafts free to spin, {RAMP.format(stage.force.damping_ramp / um)}"
        for label, stage in zip(gearbox.labels, gearbox.stages, strict=True)
        if stage.force.damping
    }


def _losses(gearbox: Gearbox) -> dict[str, str]:
    """Friction of stages and drag of shafts in words."""
    friction = {
        label: f"friction between the teeth, coefficient {_coefficient(stage.friction, stage)}"
        for label, stage in zip(gearbox.labels, gearbox.stages, strict=True)
        if stage.friction
    }
    drags = {x.name: [repr(drag) for _, drag in gearbox.braked_on_ground[x.name].drags] for x in gearbox.shafts}
    for carried, carrying, drag in gearbox.drags_between:
        drags[carried].append(f"{drag!r} by its speed against {carrying!r}")
    return friction | {name: f"braked by {', '.join(texts)}" for name, texts in drags.items() if texts}


def _coefficient(friction: MeshFriction, stage: Stage) -> str:
    """Coefficient of friction of a stage; with the loss where it is a number."""
    coefficient = friction.coefficient
    if isinstance(coefficient, float | int):
        return f"{coefficient:g}, loss {friction.loss(stage.pair):.2%} of the power"
    return f"by {coefficient!r}"


def _coordinates(gearbox: Gearbox, shaft: Shaft) -> tuple[Coordinates, str]:
    """Coordinates that a shaft needs, and the reason."""
    if not shaft.bearings:
        on_pin = "it turns on an ideal pin, and its mass with the carrier"
        return Coordinates.SPIN, on_pin if shaft.name in gearbox.planets else "no bearings given: ideal ones"
    on_carriers = [stage for stage in _stages_of(gearbox, shaft) if stage.carrier]
    ideal = {x.name for stage in on_carriers for x in stage.shafts if x.name in gearbox.planets and not x.bearings}
    apart = f"shaft {shaft.name!r} moves on its bearings, but planets {sorted(ideal)} turn on ideal pins"
    require(not ideal, f"{apart}; give the set elastic ones, Planetary(pin=Bearing(...)), or leave the bearings out")
    support = "an elastic pin" if shaft.name in gearbox.planets else "elastic bearings"
    if cause := _cause_of_tilt(gearbox, shaft) or _cause_in_set(gearbox, shaft):
        return Coordinates.BEARINGS, f"it has {support}, and {cause}"
    return Coordinates.PLANAR, f"it has {support}, and nothing tilts it or pushes it along its axis"


def _stages_of(gearbox: Gearbox, shaft: Shaft) -> list[Stage]:
    """The stages to which a shaft belongs."""
    return [stage for stage in gearbox.stages if shaft in stage.shafts]


def _cause_in_set(gearbox: Gearbox, shaft: Shaft) -> str:
    """The first cause by which a planet on its pin, or a carrier under such planets, tilts with others of its set."""
    carrier = gearbox.planets.get(shaft.name, shaft)
    planets = gearbox.planets_by_carrier.get(carrier.name, [])
    tilting = [planet.name for planet in planets if _cause_of_tilt(gearbox, planet)]
    if carrier.name == shaft.name:
        return f"its planets {tilting} tilt on their pins" if tilting else ""
    if carrier.bearings and (tilting or _cause_of_tilt(gearbox, carrier)):
        return f"its carrier {carrier.name!r} tilts"
    return ""


def _cause_of_tilt(gearbox: Gearbox, shaft: Shaft) -> str:
    """The first cause that moves a shaft out of its plane; empty where there is none."""
    stages = [stage for stage in _stages_of(gearbox, shaft) if shaft in (stage.fast, stage.slow)]
    planes = {*shaft.gears}.union(*(planet.gears for planet in gearbox.planets_by_carrier.get(shaft.name, [])))
    gear_position = min(planes, default=shaft.centre)
    laws = [stage.force for stage in stages]
    causes = {
        "it carries several gears": len(shaft.gears) > 1,
        "its planets lie in other planes than its gear": len(planes) > 1,
        "helical gears push it along its axis": any(stage.pair.beta_b for stage in stages),
        "mid-planes of its mesh differ": any(abs(np.diff(stage.axial_positions)) > ROUNDING for stage in stages),
        "the force centroid of its mesh moves along the face": any(np.any(law.centroid) for law in laws),
        "its map has a misalignment axis": any("misalignment" in law.offsets for law in laws),
        "its mass lies beside its gear or planets": abs(shaft.centre - gear_position) > ROUNDING,
        "its bearings do not lie symmetrically about its gear or planets": _bearings_couple_tilt(shaft, gear_position),
        "forces, unbalance or its weight act on it": shaft.is_loaded,
        "a bearing is not linear": not all(bearing.linear for bearing in shaft.bearings.values()),
        "its stage has tilted shafts": any(has_tilted_shafts(stage) for stage in stages),
        "its pin leans as its carrier yields": bool(gearbox.elastic_carriers) and _leans(gearbox, shaft.name),
        "bearings stand between it and another shaft": shaft.name in names_between(gearbox.between),
        "its seats in the housing yield": gearbox.housing is not None and shaft.name in dict(gearbox.housing.seats),
    }
    return next((cause for cause, holds in causes.items() if holds), "")


def _bearings_couple_tilt(shaft: Shaft, gear_position: float) -> bool:
    """Whether a radial force at the gear also tilts the shaft or pushes it along its axis."""
    stiffness = sum((b.at(axial - gear_position) for axial, b in shaft.bearings.items()), np.zeros((6, 6)))
    scale = np.sqrt(np.maximum(np.diag(stiffness), np.finfo(float).tiny))
    return bool(np.abs(stiffness / np.outer(scale, scale))[:2, 2:5].max() > ROUNDING)


def _leans(gearbox: Gearbox, planet: str) -> bool:
    """Whether a radial force on the pin of a planet also tilts it, by the carrier below."""
    carrier = gearbox.planets.get(planet)
    pins = gearbox.series_pins if carrier and carrier.name in gearbox.elastic_carriers else {}
    return planet in pins and bool(pins[planet].stiffness[0, 4])


def has_tilted_shafts(stage: Stage) -> bool:
    """Whether the shafts of a stage, or its carrier, are tilted."""
    return any(shaft.offset.tilt_x or shaft.offset.tilt_y for shaft in stage.shafts)
