"""A built gearbox in Exudyn's viewer: gears with their teeth in mesh, on their shafts; planets that orbit.

Planets on elastic pins are bodies that orbit. Those on ideal pins are spins in the model: a function of the graphics
moves their triangles with the carrier, by the coordinates that Exudyn shows.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import exudyn as exu
import numpy as np
from exudyn import graphics

from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.ring_pair import Ring, RingPair
from exugear.multibody.carrier_turns import rigid_coordinates
from exugear.multibody.model import Model
from exugear.multibody.turns import in_turn
from exugear.planning.coordinates import Coordinates
from exugear.reporting.graphics import add_graphics, gear_graphics, meshing_angles, shaft_graphics
from fem.gear.gear import Gear
from fem.support.arguments import checked
from fem.support.validation import require

#: Diameter of a drawn shaft over the smallest bore of its gears.
DIAMETER_SHARE = 0.8
#: Direction to the light from the viewer's left, homogeneous.
SIDE_LIGHT = [-10.0, 1.0, 4.0, 0.0]
#: Inner and outer radius of a ring without teeth, beyond its reference radius [modules]: the tips of its mates pass.
SMOOTH_RING = 1.25, 3.0
#: Radius of a drawn carrier beyond the centres of its planets, over the radius of their pins; its thickness over the
#: face width, and its distance from the gears.
CARRIER, THICKNESS, BEHIND = 1.6, 0.2, 0.1
CARRIER_GREY = (0.40, 0.43, 0.48, 1.0)


@checked
@in_turn
def draw(model: Model) -> None:
    """Give all bodies of the model their graphics, which mbs.SolveDynamic or Exudyn's SolutionViewer shows.

    The circles that Exudyn draws of drive and contacts are hidden. Planets stand at their places between sun and ring,
    turn with the carrier, and have pins on a plate behind the gears. The ring of a `RingPair`, a table without teeth,
    is drawn smooth.
    """
    hide(model)
    add_gears(model)
    add_shafts(model)
    add_carriers(model)


def add_gears(model: Model) -> None:
    """Draw each gear once, its teeth in mesh, with a cylinder of the shaft in its bore."""
    drawn, orbiting = set(), dict[str, list[dict[str, Any]]]()
    by_teeth = sorted(
        zip(model.gearbox.stages, model.gearbox.phases, strict=True), key=lambda x: isinstance(x[0].pair, RingPair)
    )
    for stage, phase in by_teeth:
        direction, axial = model.gearbox.direction_of(stage), model.gearbox.offsets(stage)["axial"]
        angles = (stage.angle, 0.0)
        if not isinstance(stage.pair, RingPair):
            angles = meshing_angles(stage.pair, stage.angle, direction, phase=phase, axial=axial)
        gears = (stage.pair.pinion, stage.pair.wheel)
        for (name, axial), gear, angle in zip(stage.ends, gears, angles, strict=True):
            if (name, axial) not in drawn:
                on_pin = name in model.gearbox.planets
                parts = gear_parts(gear, axial - origin(model, name), angle, on_pin)
                if turns_with_carrier(model, name):
                    orbiting.setdefault(name, []).extend(parts)
                else:
                    for part in parts:
                        add_graphics(model.bare_mbs, model.bodies[name], part)
                drawn.add((name, axial))
    for name, parts in orbiting.items():
        add_orbiting(model, name, parts)


def gear_parts(gear: Gear | Ring, axial: float, angle: float, on_pin: bool) -> list[dict[str, Any]]:
    """Graphics of a gear, with a cylinder of the shaft in its bore unless it stands on a pin, or of a smooth ring."""
    if isinstance(gear, Ring):
        inner, outer = (2 * (abs(gear.r) + share * gear.m_n) for share in SMOOTH_RING)
        return [shaft_graphics(gear.b, outer, axial=axial, d_bore=inner, tiles=120)]
    toothed = gear_graphics(gear, axial=axial, phase_angle=angle)
    return [toothed] if gear.internal or on_pin else [toothed, shaft_graphics(gear.b, gear.d_bore, axial=axial)]


def turns_with_carrier(model: Model, name: str) -> bool:
    """Whether a shaft is a planet whose body only spins, so that its graphics must follow the carrier."""
    return name in model.gearbox.planets and model.plan.shafts[name] is Coordinates.SPIN


def add_orbiting(model: Model, name: str, parts: list[dict[str, Any]]) -> None:
    """Draw a planet on an ideal pin by its first contact, which asks for its graphics at each picture."""
    carrier, box = model.gearbox.planets[name].name, model.gearbox
    contact = next(mesh.contact for mesh in model.meshes if name in (mesh.stage.fast.name, mesh.stage.slow.name))
    centre, axis = (np.array([*box.shaft_positions[shaft], 0.0]) for shaft in (carrier, name))
    spins, shown = [model.spins[shaft] for shaft in (carrier, name)], exu.ConfigurationType.Visualization

    def orbiting_planet(mbs, item):
        turned, spin = mbs.systemData.GetODE2Coordinates(shown)[spins]
        return [graphics.Move(part, centre + about_z(turned) @ (axis - centre), about_z(spin)) for part in parts]

    model.bare_mbs.SetObjectParameter(contact, "VgraphicsDataUserFunction", orbiting_planet)
    model.bare_mbs.SetObjectParameter(contact, "Vshow", True)


def about_z(angle: float) -> np.ndarray:
    """(3, 3) rotation about z."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def add_carriers(model: Model) -> None:
    """Draw each carrier as a plate behind the gears, with a pin in every planet."""
    box = model.gearbox
    for carrier in {shaft.name: shaft for shaft in box.planets.values()}.values():
        planets = [shaft for shaft in box.shafts if shaft.name in box.planets and box.planets[shaft.name] is carrier]
        gears = [(axial, gear) for shaft in planets for axial, gear in shaft.gears.items()]
        low, high = min(axial - gear.b / 2 for axial, gear in gears), max(axial + gear.b / 2 for axial, gear in gears)
        bores = [gear.d_bore for _, gear in gears if isinstance(gear, Gear)]
        thickness, d_pin = THICKNESS * (high - low), DIAMETER_SHARE * min(bores)
        back, front = low - BEHIND * (high - low), high + BEHIND * (high - low)
        at = origin(model, carrier.name)
        centre = np.array(box.shaft_positions[carrier.name])
        arms = [np.array(box.shaft_positions[shaft.name]) - centre for shaft in planets]
        radius = max(np.hypot(*arm) for arm in arms) + CARRIER * d_pin / 2
        plate = shaft_graphics(
            thickness, 2 * radius, axial=back - thickness / 2 - at, d_bore=radius, color=CARRIER_GREY, tiles=120
        )
        add_graphics(model.bare_mbs, model.bodies[carrier.name], plate)
        for arm in arms:
            pin = shaft_graphics(front - back, d_pin, axial=(front + back) / 2 - at, color=CARRIER_GREY)
            add_graphics(model.bare_mbs, model.bodies[carrier.name], graphics.Move(pin, [*arm, 0.0], np.eye(3)))


def add_shafts(model: Model) -> None:
    """Draw each shaft as a cylinder in the bores of its gears; rings alone have none, and planets stand on pins."""
    for shaft in model.gearbox.shafts:
        bores = [gear.d_bore for gear in shaft.gears.values() if isinstance(gear, Gear) and not gear.internal]
        if not bores or shaft.name in model.gearbox.planets:
            continue
        low, high = ends(shaft)
        d = DIAMETER_SHARE * min(bores)
        axial = (low + high) / 2 - origin(model, shaft.name)
        add_graphics(model.bare_mbs, model.bodies[shaft.name], shaft_graphics(high - low, d, axial=axial))


@contextmanager
def shown_at(model: Model, angle: float) -> Iterator[None]:
    """Let the viewer show a model whose driving shaft has turned by an angle [rad], all shafts at their ratios."""
    system, shown = model.bare_mbs.systemData, exu.ConfigurationType.Current  # which the raytracer shows
    before = system.GetODE2Coordinates(shown)
    try:
        system.SetODE2Coordinates(rigid_coordinates(model, angle * model.gearbox.nominal_ratios), shown)
        yield
    finally:
        system.SetODE2Coordinates(before, shown)


@checked
@in_turn
def picture(
    model: Model, *, rotation: Sequence[float] = (0.4, 0.6, 0.0), size: Sequence[int] = (900, 600), zoom: float = 0.92
) -> np.ndarray:
    """Image (height, width, 3) of a drawn model by Exudyn's raytracer, which needs no screen.

    rotation   of the view about x, y and z [rad]
    size       width and height [pixels]
    zoom       height of the view over the height that shows the whole model

    Raises ValueError for a zoom that is not positive.
    """
    require(zoom > 0, f"zoom must be > 0, got {zoom}")
    settings, renderer = model.container.visualizationSettings, model.container.renderer
    settings.view0.window.renderWindowSize = list(size)
    settings.raytracer.imageSizeFactor, settings.raytracer.multiSampling = 1, 4
    settings.loads.show = settings.view0.scene.drawCoordinateSystem = settings.raytracer.advanced.showText = False
    beside = settings.openGL.light1  # without it the teeth, which face away from the first light, are black
    beside.useCameraFrame, beside.position, beside.diffuse, beside.specular = True, SIDE_LIGHT, 0.55, 0.1
    renderer.ZoomAll()
    whole = renderer.GetState()
    renderer.SetModelView(zoom * whole["zoom"], list(rotation), list(whole["centerPoint"]))
    return np.array(renderer.RedrawAndGetImage(useRaytracer=True))


def hide(model: Model) -> None:
    """Hide Exudyn's symbols of drive and contacts."""
    for i in range(len(model.drive_items.ends)):
        model.drive_items.set_constraint(i, {"Vshow": False})
    for mesh in model.meshes:
        model.bare_mbs.SetObjectParameter(mesh.contact, "Vshow", False)


def origin(model: Model, name: str) -> float:
    """Axial position of the origin of a shaft's body [m]; 0 for a planar body."""
    planar = model.plan.shafts[name] is Coordinates.PLANAR
    return 0.0 if planar else next(shaft.centre for shaft in model.gearbox.shafts if shaft.name == name)


def ends(shaft: Shaft) -> tuple[float, float]:
    """Axial ends [m] of a shaft by its length, else by the parts that it carries."""
    if shaft.length is not None:
        return shaft.start, shaft.start + shaft.length
    low = min([axial - gear.b / 2 for axial, gear in shaft.gears.items()] + list(shaft.parts))
    high = max([axial + gear.b / 2 for axial, gear in shaft.gears.items()] + list(shaft.parts))
    return low, high
