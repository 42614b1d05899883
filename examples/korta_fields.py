"""Fields of the paper's pair where one and two pairs of teeth carry 150 N m, like its Figure 1; root stress beside.

    python examples/korta_fields.py results             (--full: also fields in space, root stress at 30 phases)

Writes fields.png (A, B: pairs in contact; C, D: deflection, exaggerated; E, F: stress under the contact), mesh.png, a
VTU file per phase, root_stress.png and root_stress.nc. The root stress is largest where a
single pair of teeth carries the load near the tip; sharp tip edges touch before the path of contact begins.
"""

from pathlib import Path

import numpy as np
from command_line import command_line
from korta_pair import paper_pair

import fem
from exugear import plots
from fem import stress
from fem.units import MPa, mm, um

TORQUE = 150.0
PHASES = {"one pair of teeth": 0.0, "two pairs of teeth": 0.5}
TORQUES = (50.0, 150.0, 350.0)
EXAGGERATION = 150


def contacts(field) -> list[np.ndarray]:
    """Points (2, n) of each contact [m], the contact of the lowest y first."""
    points = field.points[:, field.pressure > 0]
    points = points[:, np.argsort(points[1])]
    gaps = np.flatnonzero(np.hypot(*np.diff(points, axis=1)) > 1 * mm)
    return np.split(points, gaps + 1, axis=1)


def look_at(ax, centre, half_width: float, half_height: float) -> None:
    """Limit a panel to a rectangle about a point, all in metres."""
    x, y = np.asarray(centre) / mm
    w, h = half_width / mm, half_height / mm
    ax.set(xlim=(x - w, x + w), ylim=(y - h, y + h))


def draw_fields(fields_by_title, path: Path) -> None:
    """Three rows by two columns like the paper's Figure 1."""
    figure = plots.figure(rows=3, columns=2)
    figure.set_size_inches(10, 9)
    panels = figure.axes[:]
    deflection = max(np.hypot(*field.displacement).max() for fields in fields_by_title.values() for field in fields)
    peak = max(field.von_mises.max() for fields in fields_by_title.values() for field in fields)
    for column, (title, fields) in enumerate(fields_by_title.items()):
        above, middle, below = panels[column:6:2]
        touching = contacts(fields[0])
        meshes = [(field.points, field.cells) for field in fields]
        plots.plot_gears(meshes, touching, above, linewidth=0)  # elements are finer than the pixels of this view
        bent = [(f.deformed(EXAGGERATION), f.cells, np.hypot(*f.displacement) / um) for f in fields]
        plots.plot_field(bent, "displacement [µm]", middle, top=deflection / um)
        plots.plot_outlines([(f.deformed(0), f.cells) for f in fields], middle, colour="0.6", width=0.6)
        stressed = [(f.points, f.cells, f.von_mises / MPa) for f in fields]
        plots.plot_field(stressed, "von Mises stress [MPa]", below, top=peak / MPa, colours="inferno")
        above.set_title(f"{'AB'[column]}  {title} in contact")
        middle.set_title(f"{'CD'[column]}  deflection, drawn {EXAGGERATION} times")
        below.set_title(f"{'EF'[column]}  stress under the contact")
        look_at(above, (75 * mm, 0), 12 * mm, 7 * mm)
        look_at(middle, (75 * mm, 0), 12 * mm, 7 * mm)
        look_at(below, touching[0].mean(axis=1), 0.9 * mm, 0.525 * mm)
    figure.savefig(path, dpi=100)


def report(fields_by_title, cycle) -> str:
    """Largest values of the fields and of the mesh cycle."""
    lines = [f"{'150 N m':27s}displacement [um]  von Mises  pressure  root stress [MPa]"]
    for title, fields in fields_by_title.items():
        for name, f in zip(("pinion", "wheel"), fields, strict=True):
            numbers = f"{f.von_mises.max() / MPa:11.1f}{f.pressure.max() / MPa:10.1f}{f.root_stress / MPa:13.1f}"
            lines.append(f"{title:19s} {name:7s}{np.hypot(*f.displacement).max() / um:17.2f}{numbers}")
    for load in TORQUES:
        state = cycle.sel(torque=load)
        root, pressure = (float(state[name].max()) / MPa for name in ("root_stress", "hertz_pressure"))
        largest = f"largest over the mesh cycle: root {root:.1f} MPa, contact pressure {pressure:.0f} MPa (Hertz)"
        edge = float((state["tip_contact"] > 0).mean())
        lines.append(f"{load:g} N m, {largest}; the sharp edge of a tip touches in {edge:.0%} of the cycle")
    return "\n".join(lines)


def draw_mesh(gear: fem.Gear, path: Path) -> None:
    """Mesh of a gear for its compliance: in space and in transverse section."""
    density = fem.Resolution().density.paired()
    figure = plots.figure(columns=2, spatial=(0,))
    solid, plane = fem.hexahedra(gear, density), fem.section(gear, density)
    plots.plot_solid(solid.p, solid.facets[:, solid.boundary_facets()], figure.axes[0])
    plots.plot_section(plane.p, plane.t, figure.axes[1], height=12 * mm)
    figure.savefig(path, dpi=100)


def main(folder: Path, full: bool = False) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    pair = paper_pair()
    draw_mesh(pair.pinion, folder / "mesh.png")
    fields = {title: stress.plane_fields(pair, TORQUE, phase) for title, phase in PHASES.items()}
    for title, plane in fields.items():
        name = title.split()[0]
        stress.save_vtu(plane, folder / f"{name}_plane.vtu")
        if full:
            stress.save_vtu(stress.solid_fields(pair, TORQUE, PHASES[title]), folder / f"{name}_solid.vtu")
    draw_fields(fields, folder / "fields.png")
    cycle = fem.root_stress(pair, TORQUES, 30 if full else 10)
    cycle.to_netcdf(folder / "root_stress.nc", engine="h5netcdf")
    figure = plots.figure(columns=2)
    plots.plot_root_stress(cycle, figure.axes[0])
    plots.plot_pressure(cycle, figure.axes[1])
    figure.savefig(folder / "root_stress.png", dpi=100)
    print(report(fields, cycle))


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "full").parse_args()))
