"""A built gearbox for Exudyn's own viewer: its gears with the teeth where they mesh, their seats, its shafts."""

from collections.abc import Sequence

import numpy as np

from exugear.gearbox.shaft import Shaft
from exugear.plan.coordinates import Coordinates
from exugear.post.graphics import add_gear_graphics, add_graphics, meshing_angles, shaft_graphics
from exugear.simulation.model import Model
from fem.support.arguments import checked
from fem.support.validation import require

#: Diameter of a drawn shaft over the smallest bore of its gears.
SLIMMER = 0.8


@checked
def draw(model: Model) -> None:
    """Give all bodies of the model their graphics; then mbs.SolveDynamic or exudyn's SolutionViewer shows them.

    Drive and contacts are no longer drawn as Exudyn's circles.
    """
    hide(model)
    drawn = set()
    for stage, phase in zip(model.gearbox.stages, model.gearbox.phases, strict=True):
        direction = model.gearbox.turns[stage.fast.name]
        angles = meshing_angles(stage.pair, stage.angle, direction, phase=phase)
        gears = (stage.pair.pinion, stage.pair.wheel)
        for (name, axial), gear, angle in zip(stage.ends, gears, angles, strict=True):
            if (name, axial) not in drawn:
                at = axial - origin(model, name)
                add_gear_graphics(model.mbs, model.bodies[name], gear, axial=at, phase_angle=angle)
                add_graphics(model.mbs, model.bodies[name], shaft_graphics(gear.b, gear.d_bore, axial=at))
                drawn.add((name, axial))
    for shaft in model.gearbox.shafts:
        low, high = ends(shaft)
        d = SLIMMER * min(gear.d_bore for gear in shaft.gears.values())
        axial = (low + high) / 2 - origin(model, shaft.name)
        add_graphics(model.mbs, model.bodies[shaft.name], shaft_graphics(high - low, d, axial=axial))


@checked
def picture(
    model: Model, *, rotation: Sequence[float] = (0.4, 0.6, 0.0), size: Sequence[int] = (900, 600), zoom: float = 0.92
) -> np.ndarray:
    """Image (height, width, 3) of a drawn model by Exudyn's raytracer, which needs no screen.

    rotation   of the view about x, y and z [rad]
    size       width and height [pixels]
    zoom       half the height of what is seen over that which shows everything
    """
    require(zoom > 0, f"zoom must be > 0, got {zoom}")
    settings, renderer = model.container.visualizationSettings, model.container.renderer
    settings.view0.window.renderWindowSize = list(size)
    settings.raytracer.imageSizeFactor, settings.raytracer.multiSampling = 1, 4
    settings.loads.show = settings.view0.scene.drawCoordinateSystem = settings.raytracer.advanced.showText = False
    renderer.ZoomAll()
    whole = renderer.GetState()
    renderer.SetModelView(zoom * whole["zoom"], list(rotation), list(whole["centerPoint"]))
    return np.array(renderer.RedrawAndGetImage(useRaytracer=True))


def hide(model: Model) -> None:
    """Draw no drive and no contacts."""
    for item in (model.drive, *(mesh.contact for mesh in model.meshes)):
        model.mbs.SetObjectParameter(item, "Vshow", False)


def origin(model: Model, name: str) -> float:
    """Axial place of a body's origin [m]: a planar body lies at 0."""
    planar = model.plan.shafts[name] is Coordinates.PLANAR
    return 0.0 if planar else next(shaft.centre for shaft in model.gearbox.shafts if shaft.name == name)


def ends(shaft: Shaft) -> tuple[float, float]:
    """Axial ends of what a shaft carries, or of its length [m]."""
    if shaft.length is not None:
        return 0.0, shaft.length
    low = min([axial - gear.b / 2 for axial, gear in shaft.gears.items()] + list(shaft.parts))
    high = max([axial + gear.b / 2 for axial, gear in shaft.gears.items()] + list(shaft.parts))
    return low, high
