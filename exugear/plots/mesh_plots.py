"""Plots of finite element meshes: a transverse section, the surface of a solid."""

from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from exugear.plots.figures import axes_or_new, merged, styled
from fem.support.arguments import Finite, Numbers, checked
from fem.support.validation import require
from fem.units import mm

__all__ = ["plot_section", "plot_solid"]

STEEL = "#c9d3dc"


@checked
@styled
def plot_section(
    points: Numbers, quads: Numbers, ax: Axes | None = None, height: Finite | None = None, **style
) -> Axes:
    """Transverse section of a mesh, points (2, n) [m] and quads (4, n); height: shows this much below the tip [m].

    style   of the elements: matplotlib's facecolor, edgecolor, linewidth, …
    """
    points, quads = _coordinates(points, 2) / mm, _corners("quads", quads)
    ax = axes_or_new(ax)
    elements = merged(style, PolyCollection, facecolor=STEEL, edgecolor="k", linewidth=0.3)
    ax.add_collection(PolyCollection(points[:, quads].T, **elements))
    top = points[1].max()
    if height is None:
        ax.autoscale_view()
    else:
        ax.set(xlim=(-0.75 * height / mm, 0.75 * height / mm), ylim=(top - height / mm, top + 0.03 * height / mm))
    ax.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
    ax.grid(False)
    return ax


@checked
@styled
def plot_solid(points: Numbers, facets: Numbers, ax: Axes | None = None, **style) -> Axes:
    """Surface of a solid mesh in space, points (3, n) [m] and the rings of its outer facets (4, n).

    style   of the facets: matplotlib's edgecolor, linewidth, alpha, …
    """
    corners = _coordinates(points, 3)[:, _corners("facets", facets)].transpose(2, 1, 0) / mm
    space: Any = axes_or_new(ax, projection="3d")
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    shade = 0.55 + 0.45 * np.abs(normal @ np.array([0.3, 0.4, 0.86]))
    faces = merged(style, Poly3DCollection, facecolor=colormaps["bone"](shade), edgecolor="k", linewidth=0.1)
    space.add_collection3d(Poly3DCollection(corners, **faces))
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    for name, a, b in zip("xyz", low, high, strict=True):
        getattr(space, f"set_{name}lim")(a, b)
    space.set_box_aspect(high - low, zoom=1.25)
    space.view_init(elev=32, azim=68)
    space.set_axis_off()
    return space


def _coordinates(points, dim: int) -> np.ndarray:
    points = np.asarray(points, float)
    fits = points.ndim == 2 and len(points) == dim and bool(np.isfinite(points).all())
    require(fits, f"points must be ({dim}, n) finite coordinates [m], got an array of shape {points.shape}")
    return points


def _corners(name: str, cells) -> np.ndarray:
    cells = np.asarray(cells)
    fits = cells.ndim == 2 and len(cells) == 4 and cells.dtype.kind in "iu"
    require(fits, f"{name} must be (4, n) numbers of points, got {cells.dtype} of shape {cells.shape}")
    return cells
