"""Shuttling: a constant helical mesh force moves along the face width and shakes the bearings.

    python examples/shuttling.py results

The lines of contact cross the face from end to end, so that the force centroid moves to and fro in every mesh cycle,
and with it the share of each bearing. Slow gears show it alone. Where the driven shaft leans by a misalignment, the
centroid moves about another position. Gears and bearings are chosen here.
"""

from pathlib import Path

import numpy as np
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, rpm

LOAD, SPEED, SPAN, DAMPING = 200.0, 20 * rpm, 100 * mm, 3000.0
TORQUES = (0, 5, 20, 50, 100, 150, 300)
TILTS = np.array([-6, -3, 0, 3, 6]) * 1e-4
SIZES = {"m_n": 3 * mm, "b": 30 * mm}
GEARS = fem.Gear(z=30, beta=15 * deg, d_bore=40 * mm, **SIZES), fem.Gear(z=45, beta=-15 * deg, d_bore=60 * mm, **SIZES)
PAIR = fem.GearPair(*GEARS, a=fem.GearPair(*GEARS).a + 0.1 * mm)
COARSE = fem.Slices(fem.Density().scaled(0.5))


def ste_map(phases: int = 24):
    """STE and force centroid over torque, misalignment and phase."""
    offsets = fem.Offsets(misalignment=tuple(TILTS))
    return fem.static_transmission_error(PAIR, TORQUES, phases, offsets=offsets, resolution=COARSE)


def run(ste, tilt: float) -> exugear.Run:
    """Two mesh cycles of slow gears midway between stiff bearings, the driven shaft tilted about its gear [rad]."""
    ends = exugear.Bearing(radial=1e10, axial=5e9, damping_time=1e-5), exugear.Bearing(radial=1e10, damping_time=1e-5)
    parts = [{0.0: ends[0], SPAN / 2: gear, SPAN: ends[1]} for gear in GEARS]
    askew = exugear.Placement(y=-SPAN / 2 * tilt, tilt_x=-tilt)
    shafts = exugear.Shaft("driving", parts[0]), exugear.Shaft("driven", parts[1], offset=askew)
    model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, ste, damping=DAMPING)]))
    cycle = 2 * np.pi / (PAIR.pinion.z * SPEED)
    return exugear.run_up(model, speed=SPEED, duration=2 * cycle, load=LOAD, progress=False)


def bearing_forces(data) -> tuple[np.ndarray, np.ndarray]:
    """Varying forces (2, n) [N] of the driven shaft's bearings along the mesh force, in the run and by the centroid."""
    names = [f"driven at {axial / mm:g} mm" for axial in (0.0, SPAN)]
    radial = data["bearing_force"].sel(bearing=names, direction=["x", "y"])
    total = radial.sum("bearing").mean("time")
    along = (radial * total / np.hypot(*total.values)).sum("direction").transpose("bearing", "time").values
    shift = (data["mesh_force"] * data["centroid"]).values[0] / SPAN
    return along - along.mean(axis=1, keepdims=True), np.outer((-1, 1), shift - shift.mean())


def draw(path: Path, ste, data) -> None:
    """Force centroid over the phase for each misalignment; bearing forces of the aligned gears over time."""
    figure = plots.figure(columns=2)
    left, right = figure.axes
    phase = np.append(ste["phase"], 1.0)
    for tilt, row in zip(ste["misalignment"].values, ste["centroid"].sel(torque=150).values, strict=True):
        left.plot(phase, np.append(row, row[0]) / mm, label=f"{tilt / 1e-3:g} mrad")
    left.set(xlabel="phase of the mesh cycle [pitches]", ylabel="force centroid [mm]", title="by misalignment, 150 N m")
    left.legend(frameon=False, fontsize="small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    for row, expected, axial in zip(*bearing_forces(data), (0.0, SPAN), strict=True):
        right.plot(data["time"], row, label=f"bearing at {axial / mm:g} mm")
        right.plot(data["time"], expected, "k:")
    right.set(
        xlabel="time [s]", ylabel="varying bearing force [N]", title="dotted: mesh force times centroid over span"
    )
    right.set_ylim(-55, 80)
    right.locator_params(axis="x", nbins=5)
    right.legend(frameon=False, fontsize="small", loc="upper right", ncols=2)
    for ax in figure.axes:
        ax.grid(alpha=0.3)
    figure.savefig(path, dpi=100)


def main(folder: Path, quick: bool = False) -> dict[float, exugear.Run]:
    """Runs by tilt of the driven shaft [rad]."""
    folder.mkdir(parents=True, exist_ok=True)
    ste = ste_map(12 if quick else 24)
    runs = {tilt: run(ste, tilt) for tilt in (0.0, 3e-4)}
    for tilt, result in runs.items():
        centroid, force = result.data["centroid"].values[0] / mm, result.data["mesh_force"].values[0]
        print(
            f"tilt {tilt / 1e-3:g} mrad: centroid {centroid.mean():.2f} mm, moves by {np.ptp(centroid):.2f} mm;",
            end=" ",
        )
        print(f"mesh force {force.mean():.1f} N within {np.ptp(force):.2f} N, bearings within", end=" ")
        print(", ".join(f"{np.ptp(row):.1f} N" for row in bearing_forces(result.data)[0]))
    draw(folder / "shuttling.png", ste, runs[0.0].data)
    return runs


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
