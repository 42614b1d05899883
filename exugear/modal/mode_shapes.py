"""Labels of mode shapes: shafts and their coordinates in a gearbox, bodies and coordinates in a hand-built system."""

from math import hypot
from typing import Any

import numpy as np
import xarray as xr

from exugear.modal.elastic_elements import names_of_nodes
from exugear.multibody.elastic_rings import BuiltRing
from exugear.multibody.gear_contact import contacts_of, records_of
from exugear.multibody.model import Model
from exugear.planning.eigenmodes import Eigenmodes

#: Share of the kinetic energy of a mode below which members stand.
STANDS = 1e-6
COORDINATES = "x", "y", "z", "tilt_x", "tilt_y", "spin"
#: Names of the coordinates of Exudyn's nodes by their types; others are numbered.
OF_NODES = {
    "1D": ("spin",),
    "Point": ("x", "y", "z"),
    "Point2D": ("x", "y"),
    "RigidBody2D": ("x", "y", "spin"),
    "RigidBodyRxyz": COORDINATES,
    "RigidBodyEP": ("x", "y", "z", "e_0", "e_1", "e_2", "e_3"),
    "RigidBodyRotVecLG": ("x", "y", "z", "rotation_x", "rotation_y", "rotation_z"),
}


def shapes_by_shaft(model: Model, shapes: np.ndarray) -> xr.DataArray:
    """Shapes (n, n_mode) as (mode, shaft, coordinate), with rotors among the shafts (`rotor_of`: theirs); 0 if fixed.

    The axis is marked by the positions x, y [m] of the shafts and the axial positions of their centres of mass [m].
    """
    box = model.gearbox
    names = [*model.spins, *model.rotor_spins]
    values = np.zeros((shapes.shape[1], len(names), 6), shapes.dtype)
    for i, (name, spin) in enumerate(model.spins.items()):
        components = model.plan.shafts[name].components
        values[:, i, components] = shapes[spin + 1 - len(components) : spin + 1].T
    for i, rotor in enumerate(model.rotor_spins.values(), len(model.spins)):
        values[:, i, 5] = shapes[rotor]
    shafts = [box.ends[name] for name in names]
    x, y = np.transpose([box.shaft_positions[shaft.name] for shaft in shafts])
    centre, of_rotors = [shaft.centre for shaft in shafts], [""] * len(model.spins)
    of_rotors += [shaft.name for shaft in shafts[len(model.spins) :]]
    coords: dict[str, Any] = {"shaft": names, "coordinate": list(COORDINATES)}
    coords |= {"shaft_x": ("shaft", x), "shaft_y": ("shaft", y), "shaft_centre": ("shaft", centre)}
    coords["rotor_of"] = "shaft", of_rotors
    return xr.DataArray(values, dims=("mode", "shaft", "coordinate"), coords=coords)


def bending_lines(model: Model, shapes: np.ndarray) -> dict[str, tuple]:
    """Displacements of the axes of elastic shafts in modes (n, n_mode), for pictures: variables over `line_point`.

    Empty where no shaft is elastic.
    """
    names: list[str] = []
    axial, lines = [np.zeros(0)], [np.zeros((shapes.shape[1], 2, 0), shapes.dtype)]
    for name, built in model.elastics.items():
        elastic, beam = built.elastic, built.elastic.shaft.beam
        if not elastic.spatial:
            continue
        decoupled = elastic.from_moving @ shapes[built.indices[elastic.moving]]
        moved = [elastic.motion_at(z)[:2] @ decoupled for z in beam.axial]
        names += [name] * beam.axial.size
        axial.append(beam.axial)
        lines.append(np.array(moved).transpose(2, 1, 0))
    if not names:
        return {}
    values, over = np.concatenate(lines, axis=2), ("mode", "across", "line_point")
    about = {"units": "kg^-0.5", "long_name": "displacement of the axis of the elastic shaft along x and y"}
    return {
        "line_shaft": ("line_point", names, {"units": "", "long_name": "shaft of the point"}),
        "line_axial": ("line_point", np.concatenate(axial), {"units": "m", "long_name": "axial position"}),
        "line": (over, values.real, about),
        "line_imaginary": (over, values.imag, about),
    }


def kinds_of_modes(model: Model, modes: Eigenmodes) -> dict[str, tuple]:
    """Kind of each mode of planetary sets as a variable over `mode`; empty without planets.

    By the kinetic energy of the shafts that are no planets: in the plane and in tilts, and in spins and along z. Spins
    go with motion along the axes, translations with tilts (T. Eritenel, R. G. Parker, J. Sound Vib. 325, 2009). Modes
    of an elastic ring have more than half of their kinetic energy in its rim.
    """
    box, (total, moved, turned) = model.gearbox, np.zeros((3, modes.omega.size))
    if not box.planets:
        return {}
    for shaft in box.shafts:
        inertias = np.array([shaft.mass] * 3 + [shaft.transverse] * 2 + [box.body_inertias[shaft.name]])
        energies, components = np.zeros((6, modes.omega.size)), model.plan.shafts[shaft.name].components
        last = model.spins[shaft.name] + 1
        energies[components] = np.abs(modes.shapes[last - len(components) : last]) ** 2
        energies *= inertias[:, None]
        total += energies.sum(axis=0)
        if shaft.name not in box.planets:
            moved, turned = moved + energies[[0, 1, 3, 4]].sum(axis=0), turned + energies[[2, 5]].sum(axis=0)
    rims = np.sum([_energy_of_ring(ring, modes) for ring in model.rings.values()], axis=0)
    moves, turns = moved > STANDS * total, turned > STANDS * total
    choices = {"ring": rims > total, "mixed": moves & turns, "translational": moves, "rotational": turns}
    kinds = np.select([*choices.values()], [*choices], "planet")
    about = {"units": "", "long_name": "kind of the mode, by the motion of sun, ring and carrier"}
    return {"kind": ("mode", kinds.astype(str), about)}


def _energy_of_ring(ring: BuiltRing, modes: Eigenmodes) -> np.ndarray:
    """(n_mode,) twice the kinetic energy of an elastic ring at a unit angular frequency."""
    return ring.elastic.masses @ np.abs(modes.shapes[ring.indices]) ** 2


def parts_of_shafts(model: Model) -> dict[str, tuple]:
    """Gears and bearings along the shafts, for pictures of the modes: variables over the dimension `part`.

    A carrier is a part, too, by the radius on which its first planet orbits and the width of this planet.
    """
    box = model.gearbox
    gears = [(x.name, "gear", axial, abs(gear.r), gear.b) for x in box.shafts for axial, gear in x.gears.items()]
    first = {carrier.name: box.ends[planet] for planet, carrier in reversed(box.planets.items())}
    carriers = [
        (name, "carrier", axial, hypot(*np.subtract(box.shaft_positions[x.name], box.shaft_positions[name])), gear.b)
        for name, x in first.items()
        for axial, gear in x.gears.items()
    ]
    bearings = [(x.name, "bearing", axial, 0.0, 0.0) for x in box.shafts for axial in x.bearings]
    shafts, kinds, axial, radius, width = zip(*gears, *carriers, *bearings, strict=True)
    return {
        "part_shaft": ("part", list(shafts), {"units": "", "long_name": "shaft of the part"}),
        "part_kind": ("part", list(kinds), {"units": "", "long_name": "gear, carrier or bearing"}),
        "part_axial": ("part", np.array(axial), {"units": "m", "long_name": "axial position"}),
        "part_radius": ("part", np.array(radius), {"units": "m", "long_name": "reference radius"}),
        "part_width": ("part", np.array(width), {"units": "m", "long_name": "face width"}),
    }


def shapes_by_coordinate(mbs, shapes: np.ndarray) -> xr.DataArray:
    """Shapes (n, n_mode) as (mode, coordinate), marked by `body`, by name or node, and `component`.

    Also by the position of the body in the reference configuration and the base radius of its largest gear [m].
    """
    bodies, components = [""] * len(shapes), [""] * len(shapes)
    names, outlines, marks = names_of_nodes(mbs), _outlines(mbs), np.zeros((len(shapes), 3))
    for node in range(mbs.systemData.NumberOfNodes()):
        item, part = mbs.GetNode(node), mbs.systemData.GetNodeLTGODE2(node)
        kinds = OF_NODES.get(str(item["nodeType"]), ())
        for i, coordinate in enumerate(part):
            bodies[coordinate], marks[coordinate] = names[node], outlines[node]
            components[coordinate] = kinds[i] if len(kinds) == len(part) else str(i)
    labels = [f"{body} {component}" for body, component in zip(bodies, components, strict=True)]
    coords: dict[str, Any] = {
        "coordinate": labels,
        "body": ("coordinate", bodies),
        "component": ("coordinate", components),
    }
    marked = zip(("body_x", "body_y", "body_radius"), marks.T, strict=True)
    coords |= {name: ("coordinate", column, {"units": "m"}) for name, column in marked}
    return xr.DataArray(shapes.T, dims=("mode", "coordinate"), coords=coords)


def _outlines(mbs) -> dict[int, tuple[float, float, float]]:
    """Position x, y in the reference configuration and base radius of the largest gear [m] of each node."""
    outlines = {}
    for number in range(mbs.systemData.NumberOfNodes()):
        x, y = (*mbs.GetNode(number).get("referenceCoordinates", ()), 0.0, 0.0)[:2]
        outlines[number] = x, y, 0.0
    for item in map(mbs.GetObject, range(mbs.systemData.NumberOfObjects())):
        if "Rotational" in str(item["objectType"]):
            outlines[int(item["nodeNumber"])] = *item["referencePosition"][:2], 0.0
    for contact in contacts_of(mbs):
        frame = records_of(mbs, contact)[1]
        for node, gear in zip(mbs.GetObject(contact)["nodeNumbers"], (frame.pinion, frame.wheel), strict=False):
            x, y, radius = outlines[int(node)]
            outlines[int(node)] = x, y, max(radius, abs(float(gear.r_b)))
    return outlines
