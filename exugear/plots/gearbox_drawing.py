"""Drawing of a gearbox to scale: shafts with their sections, gears, bearings and discs, from the side."""

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Coupling, Shaft, TorqueSupport
from exugear.gearbox.shaft_loads import ExternalForce
from exugear.gearbox.stage import Stage
from exugear.mesh_force.ring_pair import Ring
from exugear.plots.figures import axes_or_new, merged, styled
from fem.gear.gear import Gear
from fem.support.arguments import checked
from fem.units import mm

__all__ = ["plot_gearbox"]

BODY, TOOTH, SHAFT, BEARING, LINE = "#c9d3dc", "#8aa1b4", "#e4e8ec", "#ffffff", "0.2"
FORCE = "#b3261e"
#: Diameter of a shaft whose sections are not known, as share of its smallest gear, and its overhang [gear widths].
NOMINAL, OVERHANG = 0.35, 0.3
#: Height of a bearing over the shaft's diameter, and its width over that height, where its size is not known.
BEARING_HEIGHT, BEARING_WIDTH = 0.45, 0.8


class Box(NamedTuple):
    """A rectangle of the drawing: middle along z, width, and its two radii from the shaft's axis, all [m]."""

    z: float
    width: float
    inner: float
    outer: float


@checked
@styled
def plot_gearbox(gearbox: Gearbox, ax: Axes | None = None, **style) -> Axes:
    """Side view of a gearbox to scale, its shafts unfolded into the plane of the drawing.

    Mates lie at their centre distance; of a planetary set one planet is drawn, with the number of those that equal it.
    Gears have their tip and root circles, bearings are crossed out, arrows show external forces. Shafts without
    sections have a nominal diameter, as dashed lines show.

    style   of all bodies: matplotlib's edgecolor, linewidth, hatch, …
    """
    ax = axes_or_new(ax)
    heights = unfolded(gearbox)
    drawn = [shaft for shaft in gearbox.shafts if shaft.name in heights]
    for shaft in drawn:
        _draw_shaft(ax, shaft, heights[shaft.name], style)
    ax.set(aspect="equal", xlabel="z [mm]", yticks=[])
    ax.spines["left"].set_visible(False)
    ax.autoscale_view()
    ax.grid(False)
    _name(ax, drawn, heights, gearbox)
    return ax


def _name(ax: Axes, shafts: list[Shaft], heights: dict[str, float], gearbox: Gearbox) -> None:
    """Names with numbers of teeth beside the drawing; those of shafts on one axis below each other."""
    for height in sorted({*heights.values()}):
        names = [_label(gearbox, shaft) for shaft in shafts if heights[shaft.name] == height]
        position: dict[str, Any] = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points"}
        text = "\n".join(names)
        ax.annotate(text, (0.0, height / mm), (-6, 0), ha="right", va="center", annotation_clip=False, **position)


def _label(gearbox: Gearbox, shaft: Shaft) -> str:
    """Name and numbers of teeth; behind a planet how many equal ones there are."""
    teeth = [f"z {gear.z}" for gear in shaft.gears.values()]
    carrier = gearbox.planets.get(shaft.name)
    alike = [name for name, on in gearbox.planets.items() if on is carrier and gearbox.ends[name].gears == shaft.gears]
    times = f" (× {len(alike)})" if carrier is not None and len(alike) > 1 else ""
    return shaft.name + times if not teeth else f"{shaft.name}: {', '.join(teeth)}{times}"


def unfolded(gearbox: Gearbox) -> dict[str, float]:
    """Height of each shaft's axis in the drawing [m]: below its mate by the centre distance, members of a set alike."""
    heights: dict[str, float] = {gearbox.stages[0].fast.name: 0.0}
    left = list(gearbox.stages)
    while left:
        coupled = [stage for stage in left if stage.fast.name in heights or stage.slow.name in heights]
        if not coupled:
            break
        for stage in coupled:
            left.remove(stage)
            if stage.carrier is not None and not _shows_planet(gearbox, stage):
                continue
            known, mate = stage.fast.name, stage.slow.name
            if known not in heights:
                known, mate = mate, known
            heights.setdefault(mate, heights[known] - _apart(gearbox, known, mate, stage.pair.a))
            if stage.carrier is not None:
                sun = next(name for name in (stage.fast.name, stage.slow.name) if name not in gearbox.planets)
                heights.setdefault(stage.carrier.name, heights[sun])
    return heights


def _apart(gearbox: Gearbox, known: str, mate: str, a: float) -> float:
    """Distance below a known shaft [m]: planets lie above the axis of their set, where their ring and sun lie."""
    if known in gearbox.planets:
        return abs(a)
    return -abs(a) if mate in gearbox.planets else abs(a)


def _shows_planet(gearbox: Gearbox, stage: Stage) -> bool:
    """Whether the planet of a stage is the first one of its carrier, which stands for all."""
    planet = next((name for name in (stage.fast.name, stage.slow.name) if name in gearbox.planets), None)
    first = next(name for name, carrier in gearbox.planets.items() if carrier is stage.carrier)
    return planet is None or planet == first


def _draw_shaft(ax: Axes, shaft: Shaft, height: float, style: dict[str, Any]) -> None:
    radius = _draw_body(ax, shaft, height, style)
    for axial, part in ((axial, part) for axial, group in shaft.parts.items() for part in _each(group)):
        if isinstance(part, Gear):
            _draw_gear(ax, part, axial, height, style)
        elif isinstance(part, Bearing | RollingBearing):
            _draw_bearing(ax, part, axial, height, radius(axial), style)
        elif isinstance(part, ExternalForce):
            _draw_force(ax, part, axial, height, radius(axial))
        elif isinstance(part, Coupling | TorqueSupport):
            ax.plot(axial / mm, height / mm, "s", color=LINE, markersize=5)


def _each(group) -> tuple:
    return group if isinstance(group, tuple) else (group,)


def _draw_body(ax: Axes, shaft: Shaft, height: float, style: dict[str, Any]):
    """Draw the shaft, and return its radius as a function of the axial position."""
    if shaft.cylinders:
        bounds = []
        for section in shaft.cylinders:
            middle = (section.start + section.end) / 2
            box = Box(middle, section.length, section.d_inner / 2, section.d / 2)
            _draw(ax, box, height, style, facecolor=SHAFT)
            bounds.append((section.start, section.end, section.d / 2))
        return lambda axial: max((r for a, b, r in bounds if a - mm <= axial <= b + mm), default=bounds[0][2])
    sizes = [abs(gear.d_f) for gear in shaft.gears.values() if isinstance(gear, Gear) and not gear.internal]
    ends = [
        axial + side * _half_width(part) for axial, g in shaft.parts.items() for part in _each(g) for side in (-1, 1)
    ]
    if not ends:
        return lambda axial: mm
    low, high = min(ends), max(ends)
    radius = NOMINAL * min(sizes) / 2 if sizes else 0.05 * (high - low) + mm
    more = OVERHANG * radius
    box = Box((low + high) / 2, high - low + 2 * more, 0.0, radius)
    _draw(ax, box, height, style, facecolor="none", linestyle="--")
    ax.plot([(low - more) / mm, (high + more) / mm], [height / mm] * 2, color=LINE, linewidth=0.6, dashes=(8, 2, 2, 2))
    return lambda axial: radius


def _half_width(part) -> float:
    return part.b / 2 if isinstance(part, Gear | Ring) else 0.0


def _draw_gear(ax: Axes, gear: Gear, axial: float, height: float, style: dict[str, Any]) -> None:
    """Body up to the root circle, teeth up to the tip circle; a ring from its tip circle outwards."""
    tip, root = abs(gear.d_a) / 2, abs(gear.d_f) / 2
    if gear.internal:
        _draw(ax, Box(axial, gear.b, root, abs(gear.d_rim) / 2), height, style, facecolor=BODY)
        _draw(ax, Box(axial, gear.b, tip, root), height, style, facecolor=TOOTH)
        return
    _draw(ax, Box(axial, gear.b, 0.0, root), height, style, facecolor=BODY)
    _draw(ax, Box(axial, gear.b, root, tip), height, style, facecolor=TOOTH)


def _draw_bearing(
    ax: Axes, bearing: Bearing | RollingBearing, axial: float, height: float, radius: float, style: dict[str, Any]
) -> None:
    """Crossed out on both sides of the shaft; a rolling bearing as high as its pitch circle tells, on the shaft."""
    tall = max(BEARING_HEIGHT * 2 * radius, 3 * mm)
    if isinstance(bearing, RollingBearing):
        tall = max(bearing.rows[0].D_pw - 2 * radius, bearing.rows[0].D_w)
    box = Box(axial, BEARING_WIDTH * tall, radius, radius + tall)
    _draw(ax, box, height, style, facecolor=BEARING)
    for side in (-1, 1):
        (left, right), (low, high) = _limits(box, height, side)
        for ends in ((low, high), (high, low)):
            ax.plot([left, right], ends, color=LINE, linewidth=0.8)


def _draw_force(ax: Axes, force: ExternalForce, axial: float, height: float, radius: float) -> None:
    """An arrow onto the shaft, with its size: along the axis for a thrust, across for any other force."""
    size = np.linalg.norm(force.wrench[:3])
    across = float(np.hypot(force.x, force.y)) >= abs(force.z)
    tip = (axial / mm, (height + radius) / mm) if across else (axial / mm, height / mm)
    away = (0, 22) if across else (-22 if force.z > 0 else 22, 0)
    text = f"{size:.3g} N" if size else f"{np.hypot(force.moment_x, force.moment_y):.3g} N m"
    arrow = {"arrowstyle": "-|>", "color": FORCE, "shrinkB": 0}
    options: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": "small", "color": FORCE}
    ax.annotate(text, tip, away, textcoords="offset points", arrowprops=arrow, annotation_clip=False, **options)


def _limits(box: Box, height: float, side: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """Limits of a rectangle along z and across [mm], on one side of the axis."""
    across = sorted([(height + side * box.inner) / mm, (height + side * box.outer) / mm])
    return ((box.z - box.width / 2) / mm, (box.z + box.width / 2) / mm), (across[0], across[1])


def _draw(ax: Axes, box: Box, height: float, style: dict[str, Any], **fill) -> None:
    """A rectangle on both sides of the axis, or across it."""
    drawn = merged(style, Rectangle, edgecolor=LINE, linewidth=0.8, **fill)
    if box.inner <= 0:
        (left, right), (_, high) = _limits(box, height, 1)
        low = 2 * height / mm - high
        ax.add_patch(Rectangle((left, low), right - left, high - low, **drawn))
        return
    for side in (-1, 1):
        (left, right), (low, high) = _limits(box, height, side)
        ax.add_patch(Rectangle((left, low), right - left, high - low, **drawn))
