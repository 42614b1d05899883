"""Plots of vibration modes: Campbell diagram, and shafts and gears in the shape of a mode."""

from itertools import cycle, product
from math import pi
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Rectangle

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
#: Letters up to which the legend of a Campbell diagram has two columns, and shafts up to which names stand level.
LABEL_BESIDE_LABEL, MANY_SHAFTS = 40, 4
#: Largest displacement in a picture of a mode over the largest radius.
LARGEST = 0.5
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
    radius; the rotation of a rotor behind a coupling is multiplied by the largest radius on its shaft. All have the
    same scale, in which the largest is half the largest radius.
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
    positions = 2.3 * radius * np.arange(len(shafts)) / mm
    for shaft, position in zip(shafts, positions, strict=True):
        _draw_shaft(ax, shaft, position, scale, style)
    for label, line in STYLES.items():
        ax.plot([], [], label=label, **line)
    ax.set_ylabel("z [mm]")
    many = len(shafts) > MANY_SHAFTS
    ax.set_xticks(positions, [shaft.name for shaft in shafts])
    for name in ax.get_xticklabels() if many else ():
        name.set(rotation=45, ha="right")
    legend(ax, **{} if many else {"loc": "upper center", "bbox_to_anchor": (0.5, -0.2), "ncols": 4})


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

    gears      (axial position [m], reference radius [m], face width [m]) of each
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
    gears, bearings = ([part[1:] for part in parts if part[0] == kind] for kind in ("gear", "bearing"))
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


def _draw_shaft(ax: Axes, shaft: Shaft, position: float, scale: float, style: dict[str, Any]) -> None:
    """A shaft at a position [mm] in the picture, its displacements enlarged by a scale."""
    ax.plot([position, position], shaft.ends / mm, color=AT_REST, linewidth=2.0)
    for axial, radius, width in shaft.gears:
        _draw_box(ax, position, axial, width, radius)
        _draw_arrow(ax, ROTATION, (position, axial + width / 4), (scale * radius * shaft.shape[5], 0.0))
        _draw_arrow(ax, AXIAL, (position, axial), (0.0, scale * shaft.shape[2]))
    width, radius = shaft.gears[0][2] / 2, shaft.radius
    for number, spin in enumerate(shaft.rotors, start=1):
        axial = shaft.ends[0] - 2 * number * width
        ax.plot([position, position], [axial / mm, shaft.ends[0] / mm], ":", color=AT_REST, linewidth=2.0)
        _draw_box(ax, position, axial, width, radius / 2)
        _draw_arrow(ax, ROTATION, (position, axial), (scale * radius * spin, 0.0))
    ax.plot([position] * len(shaft.bearings), np.array(shaft.bearings) / mm, "^", color=MODE, markersize=5)
    for label, row in zip(("along x", "along y"), shaft.displacement(shaft.points), strict=True):
        ax.plot(position + scale * row / mm, shaft.points / mm, **merged(style, **STYLES[label]))


def _draw_box(ax: Axes, position: float, axial: float, width: float, radius: float) -> None:
    """A gear or rotor at rest; lengths in m, the position in the picture in mm."""
    corner = position - radius / mm, (axial - width / 2) / mm
    ax.add_patch(Rectangle(corner, 2 * radius / mm, width / mm, facecolor=GEAR, edgecolor=AT_REST))


def _draw_arrow(ax: Axes, colour: str, start: tuple[float, float], displacement: tuple[float, float]) -> None:
    """An arrow by a displacement [m] from a start (position in the picture [mm], axial position [m]), unless tiny."""
    x, y = start[0], start[1] / mm
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
        _draw_arrow(ax, colour, (body.x / mm, body.y), (scale * body.u, scale * body.v))
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
