"""The page of a report on the static load over the faces of the gears."""

import numpy as np
import xarray as xr

from exugear.plots.face_plots import plot_bearing_loads, plot_line_load, plot_shaft_deflection
from exugear.reporting.document import Section, Table
from exugear.reporting.results import drawn
from fem.support.validation import require
from fem.units import mm, um


def load_section(data: xr.Dataset) -> Section:
    """Line loads, face load factors, deflection lines and bearing forces, as `exugear.load_distribution` tells them."""
    require("K_H_beta_B" in data, "load_distribution must be what exugear.load_distribution returns")
    items = (
        f"Static load {data.attrs['load']}; teeth: {data.attrs['mesh_model']}; shafts, bearings and housing elastic.",
        "K_Hβ is the largest over the mean line load; method B has the constant mesh stiffness of ISO 6336-1 over the "
        "face; the closed form that of the effective misalignment alone.",
    )
    figures = [drawn(plot_line_load, "Line load over the faces of the gears, over its mean.", data)]
    if data.sizes["bearing"]:
        lines = "Deflection lines of the shafts in {}, with their bearings as triangles."
        figures += [drawn(plot_shaft_deflection, lines.format(x), data, direction=x) for x in ("x", "y")]
        figures += [drawn(plot_bearing_loads, "Bearing forces on the shafts.", data)]
    tables = [_of_meshes(data)] + ([_of_bearings(data)] if data.sizes["bearing"] else [])
    return Section("Load over the face", items, tuple(tables), tuple(figures))


def _of_meshes(data: xr.Dataset) -> Table:
    columns: tuple[str, ...] = (
        "mesh",
        "force [kN]",
        "mean [N/mm]",
        "K_Hβ",
        "method B",
        "closed form",
        "misalignment [µm]",
    )
    of_planets = bool(np.isfinite(data["K_gamma"]).any())
    columns += ("K_γ",) * of_planets
    rows = []
    for label in data["mesh"].values:
        row = data.sel(mesh=label)
        force, width = float(row["mesh_force"]), float(row["width"])
        factors = [f"{float(row[name]):.3f}" for name in ("K_H_beta", "K_H_beta_B", "K_H_beta_C")]
        misaligned = f"{float(row['F_beta_y']) / um:.1f}"
        shared = (f"{sharing:.3f}" if np.isfinite(sharing := float(row["K_gamma"])) else "",) * of_planets
        rows.append((str(label), f"{force / 1e3:.3f}", f"{force / width * mm:.1f}", *factors, misaligned, *shared))
    caption = "Face load factors; misalignment over the face width, > 0 opens along z."
    sharing_words = " K_γ: mesh force over the mean of the planets at the same gear." * of_planets
    return Table(caption + sharing_words, columns, tuple(rows))


def _of_bearings(data: xr.Dataset) -> Table:
    columns = ("bearing", "x [N]", "y [N]", "z [N]", "radial displacement [µm]", "tilt [mrad]")
    rows = []
    for label in data["bearing"].values:
        row = data.sel(bearing=label)
        forces = [f"{x:.0f}" for x in row["bearing_force"].values + 0.0]
        moved, tilt = np.hypot(*row["bearing_displacement"].values[:2]), np.hypot(*row["bearing_tilt"].values)
        rows.append((str(label), *forces, f"{moved / um:.2f}", f"{tilt * 1e3:.3f}"))
    return Table("Forces of the bearings on their shafts, and how the shafts move in them.", columns, tuple(rows))
