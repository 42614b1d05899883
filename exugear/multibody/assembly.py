"""Assembly of the Exudyn system of a gearbox: bodies on their bearings, gear contacts, drive and load."""

from collections.abc import Mapping, Sequence
from math import cos, sin
from typing import Any, NamedTuple

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.rigidBodyUtilities import RigidBodyInertia, RotXYZ2RotationMatrix

from exugear.contact.contact_frame import E_Z, GearBody, frame_on
from exugear.contact.reference_configuration import (
    is_spatial,
    phase_of,
    reference_state,
    rotational_frame,
    rotational_row,
    spatial_row,
)
from exugear.contact.rotation import SPIN, BodyKind
from exugear.gearbox.elastic_shaft import ElasticShaft, rigid_motion
from exugear.gearbox.gearbox import Gearbox, anchors_of
from exugear.gearbox.housing import Housing, Seat
from exugear.gearbox.shaft import NO_DISPLACEMENT, Shaft
from exugear.gearbox.stage import Stage
from exugear.gearbox.static_offsets import displacements_in_housing
from exugear.mesh_force.kernel_records import changed
from exugear.multibody.bearings_and_drags import add_bearings, add_drag_between, add_drags, names_of_drags_between
from exugear.multibody.drive_items import DriveItems
from exugear.multibody.elastic_rings import (
    BuiltRing,
    RingInMesh,
    add_elastic_ring,
    located_ring,
    ring_in_mesh,
    row_on_ring,
)
from exugear.multibody.elastic_shafts import BuiltShaft, add_bodies_of_gears, add_elastic_shaft, located
from exugear.multibody.exudyn_objects import kind_of, node_of, quiet
from exugear.multibody.gear_contact import add_contact, state_of
from exugear.multibody.housing import add_housing
from exugear.multibody.imposed_motion import AT_REST
from exugear.multibody.integrator_steps import contact_state
from exugear.multibody.model import REST, BuiltMesh, BuiltSystem, Model, hold_members, linearized
from exugear.multibody.moving_seats import add_moving_seats, located_seats, moving_seats, positions_on
from exugear.multibody.planet_pins import Pin, add_pin, pin_of
from exugear.multibody.polynomial_pieces import pieces_record
from exugear.multibody.recorder import Recorder
from exugear.multibody.unbalance import add_unbalance
from exugear.planning.built_plan import BuiltPlan
from exugear.planning.coordinates import Coordinates, pose
from exugear.planning.plan import Plan
from exugear.planning.plan import plan as plan_of
from exugear.planning.rolling_bearings import with_linear_bearings
from fem.support.arguments import checked
from fem.support.validation import require

#: Angular frequency of a held body on the spring that makes static solves regular [rad/s].
HELD_OMEGA = 100.0


class Construction(NamedTuple):
    """A system under construction, and what it is built from.

    bare_mbs   Exudyn's system
    ground     number of its object that stands
    scene      plan of the gearbox
    on_seats   bearings whose seats move
    """

    bare_mbs: Any
    ground: int
    gearbox: Gearbox
    scene: Plan
    on_seats: Sequence[Seat]


class Bodies(NamedTuple):
    """Object numbers of bodies in a system.

    shafts   by name; an elastic shaft has that of its first gear
    gears    of elastic shafts, by the name of the shaft and the axial position [m]
    """

    shafts: Mapping[str, int]
    gears: Mapping[str, Mapping[float, int]]

    def of_gear(self, shaft: str, axial: float) -> int:
        """The body that carries the gear of a shaft at an axial position [m]."""
        return self.gears[shaft][axial] if shaft in self.gears else self.shafts[shaft]


class AddedContact(NamedTuple):
    """A gear contact in the system: its object number, recorder, geometry, and elastic ring, if any."""

    number: int
    recorder: Recorder
    frame: np.record
    ring: RingInMesh | None


class LocatedParts(NamedTuple):
    """Where the parts of an assembled system have their coordinates.

    spins             index of the last coordinate of each shaft, by name
    elastics, rings   elastic shafts and rings with the indices of theirs
    """

    spins: Mapping[str, int]
    elastics: Mapping[str, BuiltShaft]
    rings: Mapping[str, BuiltRing]


@checked
def build(gearbox: Gearbox, *, plan: Plan | None = None) -> Model:
    """Assemble the Exudyn system of a gearbox: bodies on their bearings, gear contacts, drive and load.

    plan   by default `exugear.plan(gearbox)`; a changed plan such as `exugear.plan(gearbox).with_joints()` builds an
           unreduced model. The plan of a built model counts as its `Plan`

    Returns a `Model`. You may add nodes, objects, loads and sensors to its system `model.mbs`; then call
    `model.mbs.Assemble()`. `print(model.plan)` shows which coordinates the shafts have and why, which integrator and
    step a run takes, what it costs, and how Exudyn calls the contacts.

    Raises ValueError where gearbox is no `Gearbox`, and for the plan of another gearbox.
    """
    scene, gearbox = _scene(gearbox, plan)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    site = Construction(mbs, mbs.CreateGround(), gearbox, scene, moving_seats(gearbox, scene))
    bodies = _add_bodies(site)
    mbs.variables[REST] = pieces_record(*AT_REST)
    pins = tuple(_add_pin(site, bodies, name) for name in gearbox.planets_on_pins)
    for name in gearbox.held:
        add_hold(mbs, bodies.shafts[name], gearbox.inertias[name], scene.shafts[name])
    for shaft in gearbox.shafts:
        add_torque_supports(mbs, bodies.shafts[shaft.name], shaft, scene.shafts[shaft.name])
    rings = {name: add_elastic_ring(mbs, ring) for name, ring in gearbox.elastic_rings.items()}
    rotors: dict[str, int] = {}
    for shaft in gearbox.shafts:
        rotors |= add_rotors(mbs, shaft, bodies.shafts[shaft.name], scene.shafts[shaft.name])
    elastics = {name: _add_elastic_shaft(site, bodies, rotors, elastic) for name, elastic in scene.elastic.items()}
    contacts = [
        _add_contact(site, bodies, number, ring_in_mesh(rings, gearbox, number))
        for number in range(len(gearbox.stages))
    ]
    for stage, contact in zip(gearbox.stages, contacts, strict=True):
        _let_contact_read_shafts(mbs, elastics, stage, contact)
    add_housing(mbs, gearbox, scene, bodies.shafts, elastics)
    seats = add_moving_seats(mbs, gearbox, scene, bodies.shafts, elastics)
    end_markers = {
        shaft.name: end_marker(mbs, shaft, bodies.shafts[shaft.name], rotors, scene.shafts[shaft.name])
        for shaft in gearbox.shafts
    }
    drive_items = drive_items_of(mbs, gearbox, end_markers)
    built = mbs.systemData.NumberOfObjects(), mbs.systemData.NumberOfLoads()
    with quiet():
        mbs.Assemble()
    parts = _located(site, bodies, elastics, rings)
    system = BuiltSystem(
        gearbox=gearbox,
        scene=scene,
        bare_mbs=mbs,
        container=container,
        contacts=tuple(_mesh(site, number, contact, parts) for number, contact in enumerate(contacts)),
        bodies=bodies.shafts,
        spins=parts.spins,
        rotor_spins={name: mbs.GetNodeODE2Index(node_of(mbs, rotor)) for name, rotor in rotors.items()},
        end_markers=end_markers,
        drive_items=drive_items,
        built=built,
        pins=pins,
        elastics=parts.elastics,
        rings=parts.rings,
        seats=located_seats(mbs, seats),
    )
    hold_members(system)
    return linearized(system, gearbox.independent)


def _scene(gearbox: Gearbox, plan: Plan | None) -> tuple[Plan, Gearbox]:
    """The plan by which to build, and the gearbox with its bearings; ValueError for the plan of another gearbox."""
    if plan is None:
        scene = plan_of(gearbox)
        return scene, with_linear_bearings(gearbox, scene.linear)
    scene = plan.scene if isinstance(plan, BuiltPlan) else plan
    gearbox = with_linear_bearings(gearbox, scene.linear)
    suitable = plan_of(gearbox, linear_bearings=scene.linear)
    names = [shaft.name for shaft in gearbox.shafts]
    unlike = f"plan is for the shafts {list(scene.shafts)}, the gearbox has {names}"
    require(list(scene.shafts) == names, f"{unlike}; pass exugear.plan(gearbox)")
    _check_suits(scene, suitable, gearbox.housing)
    sections = {shaft.name: shaft for shaft in gearbox.shafts if shaft.sections}
    altered = [name for name, elastic in scene.elastic.items() if elastic.shaft != sections.get(name)]
    require(not altered, f"plan is for shafts {altered} with other sections or parts; pass exugear.plan(gearbox)")
    on_joints = bool(gearbox.planets) and Coordinates.JOINT in scene.shafts.values()
    unreduced = "plan gives shafts of a planetary set ideal revolute joints, on which planets cannot orbit"
    require(not on_joints, f"{unreduced}; pass exugear.plan(gearbox), or exugear.plan(gearbox).with_bodies()")
    for name in gearbox.planets_on_pins:
        planet, carrier = scene.shafts[name], scene.shafts[gearbox.planets[name].name]
        unlike = f"plan lets planet {name!r} and its carrier move by {planet.value} and {carrier.value}"
        require(carrier in (planet, Coordinates.SPIN), f"{unlike}; pass exugear.plan(gearbox)")
    return scene, gearbox


def _check_suits(scene: Plan, suitable: Plan, housing: Housing | None) -> None:
    """ValueError unless a plan has the stages, damping, backlash and bearings of the plan of this gearbox."""
    same_stages = list(scene.laws) == list(suitable.laws)
    unlike = f"plan is for the stages {list(scene.laws)}, the gearbox has {list(suitable.laws)}"
    require(same_stages, f"{unlike}; pass exugear.plan(gearbox)")
    remedy = "plan is for another gearbox with shafts of these names; call exugear.plan with this one"
    for name, kind in scene.shafts.items():
        choice = suitable.shafts[name]
        unreduced = kind is Coordinates.JOINT or (kind.on_bearings and choice is Coordinates.PLANAR)
        require(kind is choice or unreduced, f"{remedy}: shaft {name!r} has {kind.value} instead of {choice.value}")
    of_plan = scene.elastic_housing.housing if scene.elastic_housing else None
    wrong = f"{remedy}: its housing is {of_plan}"
    require(of_plan is None or of_plan is housing, wrong)
    for label, law in scene.laws.items():
        given, needed = ((x.damping, x.backlash, x.stiffness_max) for x in (law, suitable.laws[label]))
        alike = np.allclose(given, needed, rtol=1e-9, atol=0.0, equal_nan=True)
        require(alike, f"{remedy}: damping, backlash and stiffness of {label} are {given} instead of {needed}")


def _add_bodies(site: Construction) -> Bodies:
    """Add all shafts with their bearings or joints and their drags."""
    mbs, gearbox, scene = site.bare_mbs, site.gearbox, site.scene
    gears = {
        name: add_bodies_of_gears(mbs, pose(gearbox, elastic.shaft), elastic) for name, elastic in scene.elastic.items()
    }
    shafts: dict[str, int] = {}
    for shaft in gearbox.shafts:
        on_gears = gears.get(shaft.name)
        body = on_gears[shaft.stations[0]] if on_gears else _add_supported_body(site, shaft)
        add_drags(mbs, node_of(mbs, body), gearbox.braked_on_ground[shaft.name], scene.shafts[shaft.name])
        shafts[shaft.name] = body
    for drag, name in zip(gearbox.drags_between, names_of_drags_between(gearbox.drags_between), strict=True):
        carried, carrying = (node_of(mbs, shafts[x]) for x in (drag.carried, drag.carrying))
        add_drag_between(mbs, (carried, carrying), drag, name)
    return Bodies(shafts, gears)


def _add_elastic_shaft(
    site: Construction, bodies: Bodies, rotors: Mapping[str, int], elastic: ElasticShaft
) -> BuiltShaft:
    """Add what bends and twists between the bodies of the gears of an elastic shaft, and its end rotor."""
    name = elastic.shaft.name
    stages = sum(elastic.shaft in stage.shafts for stage in site.gearbox.stages)
    on_seats = positions_on(site.on_seats, elastic.shaft)
    return add_elastic_shaft(
        site.bare_mbs, elastic, bodies.gears[name], rotors.get(elastic.shaft.end_name), stages, on_seats
    )


def _add_contact(site: Construction, bodies: Bodies, number: int, ring: RingInMesh | None) -> AddedContact:
    """Add the contact of a stage, by its number; ring: the elastic ring in the mesh, if any."""
    mbs, gearbox = site.bare_mbs, site.gearbox
    label, stage = gearbox.labels[number], gearbox.stages[number]
    items, recorder = [bodies.shafts[shaft.name] for shaft in stage.shafts], Recorder()
    for side, (name, axial) in enumerate(stage.ends):
        items[side] = bodies.of_gear(name, axial)
    orbits = stage.carrier is not None and stage.carrier.name in gearbox.carriers_of_pins
    if orbits:
        items = items[:2]
    displaced = any(shaft.offset != NO_DISPLACEMENT for shaft in stage.shafts)
    kinds = [kind_of(mbs, item) for item in items]
    frame = _frame(gearbox, number, kinds[:2], spatial=displaced or set(kinds) != {SPIN})
    if ring:
        frame = changed(frame, modes=ring.record.modes)
    friction = stage.friction.table(stage.pair) if stage.friction else None
    records = site.scene.laws[label].table, frame, contact_state(ring.record if ring else None), friction
    contact = add_contact(mbs, label, items, records, recorder, stage.pair, ring, orbits=orbits)
    return AddedContact(contact, recorder, frame, ring)


def _let_contact_read_shafts(mbs, elastics: Mapping[str, BuiltShaft], stage: Stage, contact: AddedContact) -> None:
    """Let the contact of a stage read the accelerations that its elastic shafts compute in steps."""
    for side, shaft in enumerate((stage.fast, stage.slow)):
        if shaft.name in elastics:
            by_shafts = state_of(mbs, contact.number)["by_shafts"]
            elastics[shaft.name].in_steps.read_by(contact.number, by_shafts[side:])


def _located(
    site: Construction, bodies: Bodies, elastics: Mapping[str, BuiltShaft], rings: Mapping[str, BuiltRing]
) -> LocatedParts:
    """The `LocatedParts` of the assembled system."""
    mbs = site.bare_mbs
    return LocatedParts(
        {
            name: mbs.GetNodeODE2Index(node_of(mbs, body)) + site.scene.shafts[name].spin_index
            for name, body in bodies.shafts.items()
        },
        {name: located(mbs, elastic) for name, elastic in elastics.items()},
        {name: located_ring(mbs, ring) for name, ring in rings.items()},
    )


def _mesh(site: Construction, number: int, contact: AddedContact, parts: LocatedParts) -> BuiltMesh:
    """The mesh of a stage, by its number, from its contact."""
    stage, law, frame = site.gearbox.stages[number], site.scene.laws[site.gearbox.labels[number]], contact.frame
    reference = reference_state(law.table.head, frame) if is_spatial(frame) else (-frame.gap, 0.0, phase_of(frame, 0.0))
    row = _row(site, stage, contact, parts)
    return BuiltMesh(stage, law, contact.number, contact.recorder, frame, row, *reference)


def _frame(gearbox: Gearbox, number: int, kinds: Sequence[BodyKind], *, spatial: bool) -> np.record:
    """Contact frame of a stage on bodies of these kinds; spatial: whether they are displaced, or move beside spins."""
    stage, phase = gearbox.stages[number], gearbox.phases[number]
    direction = gearbox.flank_senses[number]
    gap = gearbox.gaps[number]
    if not spatial:
        return changed(rotational_frame(stage.pair, phase, direction), gap=gap)
    pinion, wheel = (
        GearBody(kind, np.array(pose(gearbox, shaft)), E_Z, (s - shaft.centre) * E_Z)
        for kind, shaft, s in zip(kinds, (stage.fast, stage.slow), stage.axial_positions, strict=True)
    )
    nominal: dict[str, Any] = {"e_x": cos(stage.angle), "e_y": sin(stage.angle), "height": 0.0, "gap": gap}
    if stage.carrier and stage.carrier.name not in gearbox.carriers_of_pins:
        centres = [shaft.centre for shaft in (stage.fast, stage.slow)]
        nominal["fixed"] = displacements_in_housing(stage, gearbox.shaft_positions, centres)
    return frame_on(stage.pair, phase, direction, (pinion, wheel), **nominal)


def _row(site: Construction, stage: Stage, contact: AddedContact, parts: LocatedParts) -> np.ndarray:
    """The row of a mesh over the coordinates of the system."""
    frame, scene, elastics = contact.frame, site.scene, parts.elastics
    spins = dict(parts.spins) | {name: elastics[name].spins[axial] for name, axial in stage.ends if name in elastics}
    is_planar_set = any(scene.shafts[shaft.name].on_bearings for shaft in (stage.fast, stage.slow))
    row, entries = np.zeros(site.bare_mbs.systemData.ODE2Size()), np.zeros((2, 6))
    if is_spatial(frame):
        entries[:] = spatial_row(frame).reshape(2, 6)
    else:
        entries[:, 5] = rotational_row(frame)
    shafts = stage.shafts[:2]
    if stage.carrier and not is_planar_set:
        entries, shafts = np.vstack([entries, -entries.sum(axis=0)]), stage.shafts
    for shaft, entry in zip(shafts, entries, strict=True):
        components, last = scene.shafts[shaft.name].components, spins[shaft.name] + 1
        row[last - len(components) : last] = entry[components]
    if contact.ring:
        row[parts.rings[stage.slow.name].indices] = row_on_ring(contact.ring, float(frame.phase))
    return row


def _add_supported_body(site: Construction, shaft: Shaft) -> int:
    """Add a shaft as a body with its bearings or its joint; returns the number of the body."""
    mbs, gearbox, coordinates = site.bare_mbs, site.gearbox, site.scene.shafts[shaft.name]
    x, y, z, a, b, _ = pose(gearbox, shaft)
    if coordinates is Coordinates.SPIN:
        node = mbs.AddNode(eii.Node1D(name=shaft.name, referenceCoordinates=[0.0]))
        inertia = gearbox.body_inertias[shaft.name]
        data = {"inertia": inertia, "nodeNumber": node, "referencePosition": [x, y, z]}
        return mbs.AddObject(eii.ObjectRotationalMass1D(name=shaft.name, **data))
    if coordinates is Coordinates.PLANAR:
        node = mbs.AddNode(eii.NodeRigidBody2D(name=shaft.name, referenceCoordinates=[x, y, 0.0]))
        data = {"mass": shaft.mass, "inertia": shaft.body_inertia, "nodeNumber": node}
        body = mbs.AddObject(eii.ObjectRigidBody2D(name=shaft.name, **data))
        if shaft.name not in gearbox.planets:
            add_bearings(mbs, node, shaft, coordinates)
        return body
    body = mbs.CreateRigidBody(
        name=shaft.name,
        referencePosition=[x, y, z],
        referenceRotationMatrix=RotXYZ2RotationMatrix([a, b, 0.0]),
        inertia=RigidBodyInertia(mass=shaft.mass, inertiaTensor=np.diag([shaft.transverse] * 2 + [shaft.body_inertia])),
        nodeType=exu.NodeType.RotationRxyz,
    )
    if shaft.name in gearbox.planets:
        return body
    if coordinates is Coordinates.JOINT:
        axis = list(shaft.offset.axis)
        mbs.CreateRevoluteJoint(itemNumbers=[site.ground, body], position=[x, y, z], axis=axis, useGlobalFrame=True)
    else:
        add_bearings(mbs, node_of(mbs, body), shaft, coordinates, positions_on(site.on_seats, shaft))
        for axial, unbalance in shaft.unbalances:
            rows = rigid_motion(axial - shaft.centre)[:2]
            add_unbalance(mbs, [node_of(mbs, body)], rows, coordinates.spin_index, unbalance)
    return body


def _add_pin(site: Construction, bodies: Bodies, name: str) -> Pin:
    """Add the pin of a planet by its name."""
    mbs, gearbox = site.bare_mbs, site.gearbox
    carrier, planet = gearbox.planets[name], gearbox.ends[name]
    poses, spin_index = (pose(gearbox, planet), pose(gearbox, carrier)), site.scene.shafts[name].spin_index
    pin = pin_of(planet, carrier, poses, spin_index, gearbox.series_pins.get(name))
    add_pin(mbs, (node_of(mbs, bodies.shafts[carrier.name]), node_of(mbs, bodies.shafts[name])), pin)
    return pin


def add_hold(mbs, body: int, inertia: float, coordinates: Coordinates) -> None:
    """Hold the spin of a body [kg m^2] by a spring to ground.

    Contacts and pins see a held body at rest and exert nothing on its coordinate (`hold_members`), so that the spring
    never carries a torque: static solves need it for a regular matrix.
    """
    markers = [_ground_marker(mbs), spin_marker(mbs, body, coordinates.spin_index)]
    add_spring(mbs, markers, HELD_OMEGA**2 * inertia)


def add_torque_supports(mbs, body: int, shaft: Shaft, coordinates: Coordinates) -> None:
    """Add the torsional springs between a shaft and the housing."""
    for support in shaft.torque_supports:
        markers = [_ground_marker(mbs), spin_marker(mbs, body, coordinates.spin_index)]
        add_spring(mbs, markers, support.torsion, support.damping_time * support.torsion)


def add_spring(mbs, markers: list[int], stiffness: float, damping: float = 0.0, name: str = "") -> None:
    """Add a spring [N m/rad] and damper [N m s/rad] between two spins, which pictures leave out."""
    item: Any = eii.CoordinateSpringDamper(name=name, markerNumbers=markers, stiffness=stiffness, damping=damping)
    item.visualization["show"] = False
    mbs.AddObject(item)


def _ground_marker(mbs) -> int:
    """Marker on a coordinate that stands."""
    return mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))


def spin_marker(mbs, body: int, spin_index: int) -> int:
    """Marker on the spin of a body, by its index among the body's coordinates."""
    return mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node_of(mbs, body), coordinate=spin_index))


def add_rotors(mbs, shaft: Shaft, body: int, coordinates: Coordinates) -> dict[str, int]:
    """Add the rotors behind the couplings of a shaft with their springs; returns their numbers by name."""
    rotors: dict[str, int] = {}
    for rotor in shaft.rotors:
        node = mbs.AddNode(eii.Node1D(name=rotor.name, referenceCoordinates=[0.0]))
        data = {"inertia": rotor.coupling.inertia, "nodeNumber": node}
        number = mbs.AddObject(eii.ObjectRotationalMass1D(name=rotor.name, **data))
        inner = spin_marker(mbs, rotors[rotor.body], 0) if rotor.body in rotors else None
        inner = spin_marker(mbs, body, coordinates.spin_index) if inner is None else inner
        k, c, markers = rotor.coupling.torsion, rotor.coupling.damping, [inner, spin_marker(mbs, number, 0)]
        add_spring(mbs, markers, k, c, rotor.spring)
        rotors[rotor.name] = number
    return rotors


def end_marker(mbs, shaft: Shaft, body: int, rotors: Mapping[str, int], coordinates: Coordinates) -> int:
    """Marker on the spin of the body that drive or load of a shaft act on (`Shaft.end`)."""
    if shaft.end in rotors:
        return spin_marker(mbs, rotors[shaft.end], 0)
    return spin_marker(mbs, body, coordinates.spin_index)


def drive_items_of(mbs, gearbox: Gearbox, end_markers: Mapping[str, int]) -> DriveItems:
    """A constraint for each speed that the gearbox leaves free, and the load on the driven shaft, by their markers."""
    ends = [end_markers[name] for name in anchors_of(gearbox, [gearbox.driving.name])]
    ground, aside = _ground_marker(mbs), _ground_marker(mbs)
    return DriveItems(mbs, ground, aside, ends, end_markers[gearbox.driven.name])
