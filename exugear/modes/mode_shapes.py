"""Labels of mode shapes: shafts and their coordinates in a gearbox, bodies and coordinates in a hand-built system."""

import numpy as np
import xarray as xr

from exugear.modes.elastic_elements import names_of_nodes
from exugear.system.model import Model

COORDINATES = "x", "y", "z", "tilt_x", "tilt_y", "spin"
#: Names of the coordinates of Exudyn's nodes by their types; others are numbered.
OF_NODES = {
    "1D": ("spin",),
    "Point": ("x", "y", "z"),
    "Point2D": ("x", "y"),
    "RigidBody2D": ("x", "y", "spin"),
    "RigidBodyRxyz": COORDINATES,
}


def shapes_by_shaft(model: Model, shapes: np.ndarray) -> xr.DataArray:
    """Shapes (n, n_mode) as (mode, shaft, coordinate), rotors behind couplings among the shafts; 0 where they are fixed.

    The axis is marked by the positions x, y [m] of the shafts and the axial positions of their centres of mass [m].
    """
    box = model.gearbox
    names = [*model.spins, *(f"{name} rotor" for name in model.rotors)]
    values = np.zeros((shapes.shape[1], len(names), 6), shapes.dtype)
    for i, (name, spin) in enumerate(model.spins.items()):
        components = model.plan.shafts[name].components
        values[:, i, components] = shapes[spin + 1 - len(components) : spin + 1].T
    for i, rotor in enumerate(model.rotors.values(), len(model.spins)):
        values[:, i, 5] = shapes[rotor]
    x, y = np.transpose([box.shaft_positions[name] for name in (*model.spins, *model.rotors)])
    centres = {shaft.name: shaft.centre for shaft in box.shafts}
    centre = [centres[name] for name in (*model.spins, *model.rotors)]
    coords = {"shaft": names, "coordinate": list(COORDINATES)}
    coords |= {"shaft_x": ("shaft", x), "shaft_y": ("shaft", y), "shaft_centre": ("shaft", centre)}
    return xr.DataArray(values, dims=("mode", "shaft", "coordinate"), coords=coords)


def parts_of_shafts(model: Model) -> dict[str, tuple]:
    """Gears and bearings along the shafts, for pictures of the modes: variables over the dimension `part`."""
    parts = [
        (shaft.name, kind, axial, radius)
        for shaft in model.gearbox.shafts
        for kind, positions in (("gear", shaft.gears), ("bearing", shaft.bearings))
        for axial, radius in ((axial, part.r if kind == "gear" else 0.0) for axial, part in positions.items())
    ]
    shafts, kinds, axial, radius = zip(*parts, strict=True)
    return {
        "part_shaft": ("part", list(shafts)),
        "part_kind": ("part", list(kinds)),
        "part_axial": ("part", np.array(axial), {"units": "m", "long_name": "axial position"}),
        "part_radius": ("part", np.array(radius), {"units": "m", "long_name": "reference radius"}),
    }


def shapes_by_coordinate(mbs, shapes: np.ndarray) -> xr.DataArray:
    """Shapes (n, n_mode) as (mode, coordinate), marked by `body` and `component`; bodies by name or by their node."""
    bodies, components = [""] * len(shapes), [""] * len(shapes)
    names = names_of_nodes(mbs)
    for node in range(mbs.systemData.NumberOfNodes()):
        item, part = mbs.GetNode(node), mbs.systemData.GetNodeLTGODE2(node)
        kinds = OF_NODES.get(str(item["nodeType"]), ())
        for i, coordinate in enumerate(part):
            bodies[coordinate] = names[node]
            components[coordinate] = kinds[i] if len(kinds) == len(part) else str(i)
    labels = [f"{body} {component}" for body, component in zip(bodies, components, strict=True)]
    coords = {"coordinate": labels, "body": ("coordinate", bodies), "component": ("coordinate", components)}
    return xr.DataArray(shapes.T, dims=("mode", "coordinate"), coords=coords)
