"""A built gearbox in Exudyn's viewer: gears with their teeth in mesh, on their shafts."""

from collections.abc import Sequence

import numpy as np

from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.ring_pair import RingPair
from exugear.multibody.model import Model
from exugear.multibody.turns import in_turn
from exugear.planning.coordinates import Coordinates
from exugear.reporting.graphics import add_gear_graphics, add_graphics, meshing_angles, shaft_graphics
from fem.gear.gear import Gear
from fem.support.arguments import checked
from fem.support.validation import require

#: Diameter of a drawn shaft over the smallest bore of its gears.
DIAMETER_SHARE = 0.8
#: Direction to the light from the viewer's left, homogeneous.
SIDE_LIGHT = [-10.0, 1.0, 4.0, 0.0]


@checked
@in_turn
def draw(model: Model) -> None:
    """Give all bodies of the model their graphics, which mbs.SolveDynamic or Exudyn's SolutionViewer shows.

    The circles that Exudyn draws of drive and contacts are hidden.
    """
    orbiting = "draw: the gears of planetary sets are not drawn yet"
    require(not model.gearbox.planets, f"{orbiting}; exugear.plots shows their runs and modes")
    hide(model)
    add_gears(model)
    add_shafts(model)


def add_gears(model: Model) -> None:
    """Draw each gear once, its teeth in mesh, with a cylinder of the shaft in its bore."""
    drawn = set()
    for stage, phase in zip(model.gearbox.stages, model.gearbox.phases, strict=True):
        if isinstance(stage.pair, RingPair):
            raise ValueError(f"draw: the ring of stage {stage.name!r} is a table without teeth; draw other gearboxes")
        direction, axial = model.gearbox.direction_of(stage), model.gearbox.offsets(stage)["axial"]
        angles = meshing_angles(stage.pair, stage.angle, direction, phase=phase, axial=axial)
        gears = (stage.pair.pinion, stage.pair.wheel)
        for (name, axial), gear, angle in zip(stage.ends, gears, angles, strict=True):
            if (name, axial) not in drawn and isinstance(gear, Gear):
                mbs, body, on_body = model.mbs, model.bodies[name], axial - origin(model, name)
                add_gear_graphics(mbs, body, gear, axial=on_body, phase_angle=angle)
                if not gear.internal:
                    add_graphics(mbs, body, shaft_graphics(gear.b, gear.d_bore, axial=on_body))
                drawn.add((name, axial))


def add_shafts(model: Model) -> None:
    """Draw each shaft as a cylinder in the bores of its gears; that of rings alone has none."""
    for shaft in model.gearbox.shafts:
        low, high = ends(shaft)
        bores = [gear.d_bore for gear in shaft.gears.values() if isinstance(gear, Gear) and not gear.internal]
        if not bores:
            continue
        d = DIAMETER_SHARE * min(bores)
        axial = (low + high) / 2 - origin(model, shaft.name)
        add_graphics(model.mbs, model.bodies[shaft.name], shaft_graphics(high - low, d, axial=axial))


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
    for item in (*model.drives, *(mesh.contact for mesh in model.meshes)):
        model.mbs.SetObjectParameter(item, "Vshow", False)


def origin(model: Model, name: str) -> float:
    """Axial position of the origin of a shaft's body [m]; 0 for a planar body."""
    planar = model.plan.shafts[name] is Coordinates.PLANAR
    return 0.0 if planar else next(shaft.centre for shaft in model.gearbox.shafts if shaft.name == name)


def ends(shaft: Shaft) -> tuple[float, float]:
    """Axial ends [m] of a shaft by its length, else by the parts that it carries."""
    if shaft.length is not None:
        return 0.0, shaft.length
    low = min([axial - gear.b / 2 for axial, gear in shaft.gears.items()] + list(shaft.parts))
    high = max([axial + gear.b / 2 for axial, gear in shaft.gears.items()] + list(shaft.parts))
    return low, high
