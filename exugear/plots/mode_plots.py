"""Plots of vibration modes: Campbell diagram, and shafts and gears in the shape of a mode."""

from itertools import cycle, product
from math import pi
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle
from matplotlib.transforms import ScaledTranslation

from exugear.plots.figures import DISTINCT, axes_or_new, check_result, legend, merged, styled
from fem.support.arguments import Finite, checked
from fem.support.validation import require
from fem.units import mm, rpm

__all__ = ["plot_campbell", "plot_modes"]

MODE, SHAFT_ORDER, AT_REST, GEAR = "#333333", "#999999", "#aaaaaa", "#eeeeee"
#: Share of the strain energy in the mesh from which on a crossing is marked as a resonance.
MARKED = 0.1
#: That of the circle in the legend.
LEGEND_SHARE = 0.5
#: Highest frequency in a Campbell diagram over the highest of an order, and width of the label of an order [points].
ROOM, LABEL_WIDTH = 1.1, 16
#: Letters up to which the legend of a Campbell diagram has two columns.
LABEL_BESIDE_LABEL = 40
#: Largest displacement in a picture of a mode over the largest radius.
LARGEST = 0.5
#: Least half width of a shaft in the picture, and half of the gap beside it, over the largest radius; share of the
#: largest scale that rows of shafts must reach; height of the names above a row [m].
LEAST_HALF, GAP, NEAR_BEST, ROW_OF_NAMES = 0.6, 0.15, 0.75, 8 * mm
#: Share of a figure that the axes of a mode take.
PLOTTED = 0.8
#: Number of shafts up to which they stand in one row.
FEW = 4
#: Length in the picture below which an arrow is left out [m].
LEAST_ARROW = 1 * mm
AXIAL, ROTATION = DISTINCT[2:4]
STYLES: dict[str, dict[str, Any]] = {
    "along x": {"color": DISTINCT[0], "linewidth": 1.6},
    "along y": {"color": DISTINCT[1], "linewidth": 1.6, "linestyle": "--"},
    "along the axis": {"color": AXIAL, "marker": "^", "linewidth": 1.4},
    "rotation": {"color": ROTATION, "marker": ">", "linewidth": 1.4},
}


@checked
@styled
def plot_campbell(data: xr.Dataset, ax: Axes | None = None, marked: float = MARKED, **style) -> Axes:
    """Natural frequencies over the speed of the driving shaft, with mesh orders (dashed) and shaft orders (dotted).

    data     of `exugear.campbell`
    marked   least share of the strain energy in the mesh of the order from which a crossing is marked by a circle; its
             area grows with the share, as the legend says
    style    of the lines of the modes: matplotlib's color, linewidth, …
    """
    check_result("data", data, ("crossing_speed",), "exugear.campbell(...)")
    require(0 <= marked <= 1, f"marked must lie in [0, 1], a share of the strain energy, got {marked}")
    ax = axes_or_new(ax)
    speed, highest = data["speed"].values, float(data["order_ratio"].max() * data["speed"].max()) / (2 * pi)
    top = min(1.05 * float(data["frequency"].max()), ROOM * highest)
    ax.plot(speed / rpm, data["frequency"].values.T, **merged(style, color=MODE, linewidth=1.1))
    _draw_orders(ax, data, top)
    met = data.where(data["crossing_energy_share"] >= marked, drop=True) if data.sizes["crossing"] else data
    sizes = 160 * met["crossing_energy_share"]
    ring: dict[str, Any] = {"facecolor": "none", "edgecolor": DISTINCT[3]}
    ax.scatter(met["crossing_speed"] / rpm, met["crossing_frequency"], sizes, zorder=3, **ring)
    meaning = f"{100 * LEGEND_SHARE:.0f} % of the mode's energy in the mesh"
    ax.scatter([], [], 160 * LEGEND_SHARE, label=meaning, **ring)
    ax.set(xlabel="speed of the driving shaft [rpm]", ylabel="natural frequency [Hz]")
    ax.set(xlim=(speed[0] / rpm, speed[-1] / rpm), ylim=(0, top))
    longest = max(map(len, ax.get_legend_handles_labels()[1]))
    legend(ax, loc="lower left", bbox_to_anchor=(0.0, 1.05), ncols=2 if longest <= LABEL_BESIDE_LABEL else 1)
    return ax


def _draw_orders(ax: Axes, data: xr.Dataset, top: float) -> None:
    """Lines of the orders with their harmonics where they leave the frame; a colour for each mesh frequency."""
    speed, meshes = data["speed"].values, _meshes_by_frequency(data)
    stages = list(meshes)
    ax.plot([], [], color=MODE, linewidth=1.1, label="modes")
    labelled = set()
    for name, ratio, stage in zip(*(data[x].values for x in ("order", "order_ratio", "order_stage")), strict=True):
        if stage and stage not in meshes:
            continue
        colour = DISTINCT[stages.index(stage) % len(DISTINCT)] if stage else SHAFT_ORDER
        label = f"orders of mesh {meshes[stage]}" if stage else "rotation of shafts"
        frequency, style = ratio * speed / (2 * pi), "--" if stage else ":"
        shown = None if label in labelled else label
        ax.plot(speed / rpm, frequency, style, color=colour, linewidth=1.0, label=shown)
        labelled.add(label)
        if stage:
            end = min(speed[-1], top * 2 * pi / ratio)
            column = 3 + LABEL_WIDTH * stages.index(stage)
            offset, alignment = ((column, 0), "center") if end == speed[-1] else ((0, 2), "bottom")
            at = end / rpm, ratio * end / (2 * pi)
            text = ax.annotate(f"{str(name).split(' ')[0]}x", at, offset, textcoords="offset points", color=colour)
            text.set(va=alignment, fontsize="small")


def _meshes_by_frequency(data: xr.Dataset) -> dict[str, str]:
    """The first of the meshes of a planetary set with the same frequency, and what names all of them."""
    orders: dict[tuple[str, str], list[str]] = {}
    names = ("order_stage", "order_carrier", "order_ratio")
    for stage, carrier, ratio in zip(*(data[name].values.tolist() for name in names), strict=True):
        if stage:
            orders.setdefault((stage, carrier or stage), []).append(f"{ratio:.9g}")
    alike: dict[tuple[str, ...], list[str]] = {}
    for (stage, carrier), ratios in orders.items():
        alike.setdefault((carrier, *ratios), []).append(stage)
    return {first: first + (f" and {len(others)} more" if others else "") for first, *others in alike.values()}


@checked
@styled
def plot_modes(data: xr.Dataset, ax: Axes | None = None, mode: int = 1, angle: Finite = 0.0, **style) -> Axes:
    """A mode: of a gearbox with its shafts side by side, their axes vertical; of a hand-built system seen along z.

    data   of `exugear.modes`
    mode   its number, 1 for the lowest frequency
    angle  of the vibration [rad]: 0 and pi show the largest displacements of a mode without gyroscopic terms
    style  of the lines of displaced shafts or spokes: matplotlib's linewidth, alpha, …

    Of a gearbox, lines show the displacement of a shaft's axis along x and along y, both drawn to the right, of elastic
    shafts the line in which they bend. Arrows
    along the axis show the axial displacement of the gears, arrows to the right their rotation times the reference
    radius, of a carrier times that of the orbit of its planets; the rotation of a rotor behind a coupling is multiplied
    by the largest radius on its shaft. All have the same scale, in which the largest is half the largest radius. Many
    shafts stand in rows below each other, each with its z axis.
    Of a hand-built system base circles, with a spoke that shows the rotation, are grey at rest; a body without a gear
    has a dotted spoke.
    """
    kinds = {"part_shaft", "body_radius"} & {str(name) for name in data.variables}
    require(bool(kinds), "data lacks part_shaft and body_radius; pass what exugear.modes(...) returned")
    numbers = data["mode"].values
    require(mode in numbers, f"mode must lie in [1, {numbers[-1]}], got {mode}")
    ax, chosen = axes_or_new(ax), data.sel(mode=mode)
    ax.set_aspect("equal")
    ax.set_title(_title(chosen), fontsize="medium")
    ax.grid(False)
    draw = _draw_shafts if "part_shaft" in kinds else _draw_bodies
    draw(ax, chosen, angle, style)
    return ax


def _draw_shafts(ax: Axes, data: xr.Dataset, angle: float, style: dict[str, Any]) -> None:
    """A mode of a gearbox at an angle of the vibration."""
    shafts, extremes = _shafts(_at_angle(data, angle)), _shafts(data) + _shafts(_at_angle(data, pi / 2))
    radius = max(shaft.radius for shaft in shafts)
    scale = LARGEST * radius / max(*(shaft.largest for shaft in extremes), np.finfo(float).tiny)
    along = scale * np.hypot(*np.reshape([shaft.shape[2] for shaft in extremes], (2, -1)))
    layout = _laid_out(ax, shafts, along, radius)
    for shaft, (position, below) in zip(shafts, layout.corners, strict=True):
        _draw_shaft(ax, shaft, position, below, scale, style)
    for label, line in STYLES.items():
        ax.plot([], [], label=label, **line)
    ax.set_ylabel("z [mm]")
    if layout.rows == 1:
        ax.set_xticks([position for position, _ in layout.corners], [shaft.name for shaft in shafts])
    else:
        ticks = np.linspace(layout.low, layout.high, 2) / mm
        ax.set_yticks(*zip(*((z - below, f"{z:.0f}") for below in layout.belows for z in ticks), strict=True))
        ax.set_xticks([])
        for shaft, (position, below) in zip(shafts, layout.corners, strict=True):
            over = position, layout.high / mm - below
            ax.annotate(shaft.name, over, (0, 3), textcoords="offset points", ha="center", annotation_clip=False)
        ax.set_title(ax.get_title(), fontsize="medium", pad=22)
    below_names = ScaledTranslation(0, -(28 if layout.rows == 1 else 6) / 72, ax.figure.dpi_scale_trans)
    legend(ax, loc="upper center", bbox_to_anchor=(0.5, 0), bbox_transform=ax.transAxes + below_names, ncols=4)


class Layout(NamedTuple):
    """Where shafts stand in the picture of a mode, in rows of equal height.

    corners     (horizontal position, depth of its row below the first row) of each shaft [mm]
    low, high   axial positions between which all is drawn [m]
    """

    corners: list[tuple[float, float]]
    low: float
    high: float

    @property
    def belows(self) -> list[float]:
        """Depths of the rows below the first row [mm]."""
        return sorted({below for _, below in self.corners})

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.belows)


def _laid_out(ax: Axes, shafts: list["Shaft"], along: np.ndarray, radius: float) -> Layout:
    """The fewest rows in which shafts are drawn at `NEAR_BEST` of the largest scale that any number of rows gives.

    Up to `FEW` shafts stand in one row.

    along    (n,) largest displacement of each along its axis in the picture [m]
    radius   the largest of all [m]
    """
    width, height = _size(ax)
    drawn = [
        np.append(shaft.ends, shaft.spread) + np.array([-1, 1, -1, 1]) * x
        for shaft, x in zip(shafts, along, strict=True)
    ]
    low, high = min(map(np.min, drawn)), max(map(np.max, drawn))
    halves = np.maximum([shaft.radius for shaft in shafts], LEAST_HALF * radius) + GAP * radius
    scales, corners = {}, {}
    for rows in range(1, (len(shafts) if len(shafts) > FEW else 1) + 1):
        groups = np.array_split(np.arange(len(shafts)), rows)
        lengths = [2 * halves[group].sum() for group in groups]
        names = ROW_OF_NAMES * (rows if rows > 1 else 0)
        scales[rows] = min(width / max(lengths), max(height - names, names) / (rows * (high - low)))
        apart = high - low + ROW_OF_NAMES / scales[rows]
        corners[rows] = [
            ((np.cumsum(halves[group]) + np.append(0, np.cumsum(halves[group])[:-1]))[i] / mm, row * apart / mm)
            for row, group in enumerate(groups)
            for i in range(group.size)
        ]
    best = max(scales.values())
    return Layout(corners[min(rows for rows, scale in scales.items() if scale >= NEAR_BEST * best)], low, high)


def _size(ax: Axes) -> tuple[float, float]:
    """Width and height of axes [m] as printed, about, whatever a layout engine makes of them."""
    box, spec = ax.figure.bbox, ax.get_subplotspec()
    rows, columns = spec.get_gridspec().get_geometry() if spec else (1, 1)
    printed = PLOTTED * 25.4 * mm / ax.figure.dpi
    return printed * box.width / columns, printed * box.height / rows


def _at_angle(data: xr.Dataset, angle: float) -> xr.Dataset:
    """A mode with its shape at an angle of the vibration [rad]: the real part of shape exp(i angle)."""
    imaginary = data.get("shape_imaginary", 0.0)
    turned = data.assign(shape=np.cos(angle) * data["shape"] - np.sin(angle) * imaginary)
    if "line" not in data:
        return turned
    return turned.assign(line=np.cos(angle) * data["line"] - np.sin(angle) * data["line_imaginary"])


def _shafts(data: xr.Dataset) -> list["Shaft"]:
    """All shafts of a mode."""
    return [_shaft(data, name) for name in dict.fromkeys(data["part_shaft"].values.tolist())]


class Shaft(NamedTuple):
    """A shaft in the shape of a mode.

    gears      (axial position [m], reference radius [m], face width [m]) of each; of a carrier those of its planets,
               with the radius of their orbit
    bearings   their axial positions [m]
    centre     axial position of its centre of mass [m]
    shape      (6,) displacements, tilts and spin
    rotors     spins of the rotors behind its couplings
    line       (3, n) axial positions [m], displacements of the axis along x and y of an elastic shaft; else (3, 0)
    """

    name: str
    gears: list[tuple[float, float, float]]
    bearings: list[float]
    centre: float
    shape: np.ndarray
    rotors: list[float]
    line: np.ndarray

    @property
    def radius(self) -> float:
        """Largest radius of its gears [m]."""
        return max(radius for _, radius, _ in self.gears)

    @property
    def spread(self) -> np.ndarray:
        """(2,) axial positions between which its parts lie [m]."""
        sides = [axial + side * width / 2 for axial, _, width in self.gears for side in (-1, 1)]
        rotors = [self.ends[0] - (2 * number + 0.5) * self.gears[0][2] / 2 for number in range(1, len(self.rotors) + 1)]
        return np.array([min(sides + rotors), max(sides)])

    @property
    def ends(self) -> np.ndarray:
        """(2,) axial positions of the outermost parts [m], with a margin; of an elastic shaft its ends."""
        if self.line.size:
            return self.line[0, [0, -1]]
        positions = [axial + side * width for axial, _, width in self.gears for side in (-1, 1)] + self.bearings
        return np.array([min(positions), max(positions)])

    @property
    def largest(self) -> float:
        """Largest displacement of its axis and of the rims of its gears."""
        spins = [self.shape[5], *self.rotors]
        return max(np.abs(self.displacement(self.points)).max(), abs(self.shape[2]), *(self.radius * np.abs(spins)))

    @property
    def points(self) -> np.ndarray:
        """(n,) axial positions between which the axis is straight [m]."""
        return self.line[0] if self.line.size else self.ends

    def displacement(self, axial) -> np.ndarray:
        """(2, n) displacement along x and y at axial positions (n,)."""
        if self.line.size:
            return np.array([np.interp(axial, self.line[0], moved) for moved in self.line[1:]])
        x, y, _, tilt_x, tilt_y, _ = self.shape
        lever = axial - self.centre
        return np.array([x + lever * tilt_y, y - lever * tilt_x])


def _shaft(data: xr.Dataset, name: str) -> Shaft:
    """A shaft of a mode by its name."""
    of_shaft = data.isel(part=np.flatnonzero(data["part_shaft"] == name))
    columns = (of_shaft[f"part_{column}"].values.tolist() for column in ("kind", "axial", "radius", "width"))
    parts = list(zip(*columns, strict=True))
    kinds = ("gear", "carrier"), ("bearing",)
    gears, bearings = ([part[1:] for part in parts if part[0] in kind] for kind in kinds)
    shape, shafts = data["shape"].sel(shaft=name), data["shaft"].values
    rotors = shafts[data["rotor_of"].values == name] if "rotor_of" in data.coords else shafts[shafts == f"{name} rotor"]
    spins = data["shape"].sel(shaft=rotors, coordinate="spin").values.tolist()
    line = np.zeros((3, 0))
    if "line" in data:
        chosen = data["line_shaft"].values == name
        line = np.vstack([data["line_axial"].values[chosen], data["line"].values[:, chosen]])
    return Shaft(
        name, gears, [axial for axial, *_ in bearings], float(shape["shaft_centre"]), shape.values, spins, line
    )


def _draw_shaft(ax: Axes, shaft: Shaft, position: float, below: float, scale: float, style: dict[str, Any]) -> None:
    """A shaft at a position in a row that lies below the first row [mm], its displacements enlarged by a scale."""
    ax.plot([position, position], shaft.ends / mm - below, color=AT_REST, linewidth=2.0)
    for axial, radius, width in shaft.gears:
        _draw_box(ax, position, axial / mm - below, width, radius)
        _draw_arrow(ax, ROTATION, (position, (axial + width / 4) / mm - below), (scale * radius * shaft.shape[5], 0.0))
        _draw_arrow(ax, AXIAL, (position, axial / mm - below), (0.0, scale * shaft.shape[2]))
    width, radius = shaft.gears[0][2] / 2, shaft.radius
    for number, spin in enumerate(shaft.rotors, start=1):
        axial = shaft.ends[0] - 2 * number * width
        ax.plot([position, position], np.array([axial, shaft.ends[0]]) / mm - below, ":", color=AT_REST, linewidth=2.0)
        _draw_box(ax, position, axial / mm - below, width, radius / 2)
        _draw_arrow(ax, ROTATION, (position, axial / mm - below), (scale * radius * spin, 0.0))
    ax.plot([position] * len(shaft.bearings), np.array(shaft.bearings) / mm - below, "^", color=MODE, markersize=5)
    for label, row in zip(("along x", "along y"), shaft.displacement(shaft.points), strict=True):
        ax.plot(position + scale * row / mm, shaft.points / mm - below, **merged(style, **STYLES[label]))


def _draw_box(ax: Axes, position: float, middle: float, width: float, radius: float) -> None:
    """A gear or rotor at rest about its middle in the picture [mm]; width and radius in m."""
    corner = position - radius / mm, middle - width / 2 / mm
    ax.add_patch(Rectangle(corner, 2 * radius / mm, width / mm, facecolor=GEAR, edgecolor=AT_REST))


def _draw_arrow(ax: Axes, colour: str, start: tuple[float, float], displacement: tuple[float, float]) -> None:
    """An arrow by a displacement [m] from a start in the picture [mm], unless tiny."""
    x, y = start
    end = x + displacement[0] / mm, y + displacement[1] / mm
    if max(np.abs(displacement)) > LEAST_ARROW:
        arrow = {"arrowstyle": "-|>", "color": colour, "shrinkA": 0, "shrinkB": 0, "linewidth": 1.4}
        ax.annotate("", end, (x, y), arrowprops=arrow)


class Body(NamedTuple):
    """A body of a hand-built system in the shape of a mode: position, base radius, displacements [m], spin."""

    name: str
    x: float
    y: float
    radius: float
    u: float
    v: float
    spin: float

    @property
    def largest(self) -> float:
        """Largest displacement of its centre and of the rim of its gear."""
        return max(abs(self.u), abs(self.v), self.radius * abs(self.spin))


def _bodies(data: xr.Dataset) -> list[Body]:
    """The bodies of a mode of a hand-built system."""
    bodies, names = [], data["body"].values
    for name in dict.fromkeys(names.tolist()):
        part = data.isel(coordinate=np.flatnonzero(names == name))
        moved = dict(zip(part["component"].values.tolist(), part["shape"].values.tolist(), strict=True))
        outline = (float(part[f"body_{mark}"][0]) for mark in ("x", "y", "radius"))
        bodies.append(Body(name, *outline, *(moved.get(component, 0.0) for component in ("x", "y", "spin"))))
    return bodies


def _draw_bodies(ax: Axes, data: xr.Dataset, angle: float, style: dict[str, Any]) -> None:
    """A mode of a hand-built system at an angle of the vibration, seen along z."""
    bodies, extremes = _bodies(_at_angle(data, angle)), _bodies(data) + _bodies(_at_angle(data, pi / 2))
    smallest = min(body.radius for body in bodies if body.radius > 0)
    scale = LARGEST * smallest / max(*(body.largest for body in extremes), np.finfo(float).tiny)
    styles = cycle(product(("-", "--", "-."), DISTINCT))
    for body, (rim_line, colour) in zip(bodies, styles, strict=False):
        dash = "-" if body.radius else ":"
        for factor, outline in ((0.0, AT_REST), (scale, colour)):
            x, y, turn = body.x + factor * body.u, body.y + factor * body.v, factor * body.spin
            line = merged(style, linewidth=1.4, color=outline)
            circle = {"fill": False, "linewidth": 1.4, "linestyle": rim_line, "color": outline}
            ax.add_patch(Circle((x / mm, y / mm), body.radius / mm, **circle))
            rim = x + (body.radius or smallest) * np.cos(turn), y + (body.radius or smallest) * np.sin(turn)
            ax.plot([x / mm, rim[0] / mm], [y / mm, rim[1] / mm], dash, **line)
        _draw_arrow(ax, colour, (body.x / mm, body.y / mm), (scale * body.u, scale * body.v))
        ax.plot([], [], rim_line, color=colour, label=body.name)
    ax.autoscale_view()
    ax.set(xlabel="x [mm]", ylabel="y [mm]")
    legend(ax)


def _title(data: xr.Dataset) -> str:
    """Frequency and damping of a mode, and the element with the most strain energy."""
    damping = f"damping ratio {float(data['damping_ratio']) * 100:.2g} %"
    text = f"mode {int(data['mode'])}: {float(data['frequency']):.0f} Hz, {damping}"
    element = int(data["energy_share"].argmax("element"))
    share = float(data["energy_share"][element])
    return (
        f"{text}\n{share * 100:.0f} % of the strain energy in {data['element'].values[element]}" if share > 0 else text
    )
