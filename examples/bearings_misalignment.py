"""The paper's pair on elastic bearings, the driven shaft mounted askew: what misalignment does at rest and in a run-up.

    python examples/bearings_misalignment.py results

One STE map over misalignment and centre distance serves all tilts. Its slice mode is fast: every slice of the face is a
line load, pressed as Hertz says. Tilt > 0: along z the driven shaft leans to where the teeth push it (f_sigma_beta).
Bearings and damping are chosen here. The mean forces of the run-up are 1 % above those at rest: it speeds up.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from korta_run_up import paper_pair
from tqdm import tqdm

import exugear
import fem
from exugear import plots
from fem.units import mm, rpm, um

LOAD, SPEED, DAMPING = 150.0, (500 * rpm, 4200 * rpm), 2700.0
GEAR, LENGTH, RADIAL = 30 * mm, 60 * mm, 1.5e8
TORQUES = (0, 5, 20, 50, 100, 150, 250, 400, 700)
TILTS = np.array([-0.6, -0.3, 0.0, 0.3, 0.6]) * 1e-3
MISALIGNMENT = np.array([-10, -6, -3.5, -2, -1, -0.5, 0, 0.5, 1, 2, 3.5, 6, 10]) * 1e-4
OPENING = np.array([-20, 40]) * um


def ste_map(quick: bool = False):
    """STE over torque, centre distance (unless quick), misalignment and phase."""
    pair = paper_pair()
    places = fem.Offsets(a=None if quick else tuple(pair.a + OPENING), misalignment=tuple(MISALIGNMENT))
    mode = fem.Slices()
    return fem.static_transmission_error(pair, TORQUES, 12 if quick else 24, offsets=places, resolution=mode)


def gearbox(law: exugear.MeshForce, tilt: float, radial: float = RADIAL) -> exugear.Gearbox:
    """Both shafts on two bearings, the driven one tilted about its gear [rad]."""
    pair = paper_pair()
    locating = exugear.Bearing(radial=radial, axial=1e8, damping=2e-5)
    floating = exugear.Bearing(radial=radial, damping=2e-5)
    fast, slow = ({0.0: locating, GEAR: gear, LENGTH: floating} for gear in (pair.pinion, pair.wheel))
    askew = exugear.Placement(y=-GEAR * tilt, tilt_x=-tilt)
    shafts = exugear.Shaft("driving", fast), exugear.Shaft("driven", slow, offset=askew)
    return exugear.Gearbox([exugear.Stage(*shafts, law, pair=pair)])


def sweep(law: exugear.MeshForce, tilts, duration: float, **changes) -> tuple[exugear.Plan, dict[float, exugear.Run]]:
    """The plan of the last tilt, and a run-up for each."""
    runs = {}
    for tilt in tqdm(tilts, desc="tilts", leave=False):
        model = exugear.build(gearbox(law, float(tilt), **changes))
        runs[float(tilt)] = exugear.run_up(model, speed=SPEED, duration=duration, load=LOAD, progress=False)
    return model.plan, runs


def outline(run: exugear.Run, windows: int = 150) -> exugear.spectrum.Envelope:
    """Envelope of the DTE over mesh frequency."""
    return exugear.dte_envelope(run, windows=windows)


def figures(ste, run: exugear.Run) -> dict[str, float]:
    """What a tilt does: misalignment at rest, means over the run-up, largest rms of the DTE, line load by the map."""
    data, found = run.data, outline(run)
    at_rest = float(data["misalignment"][0, 0])
    bearings = data["bearing_force"].mean("time")
    forces = {name: float(np.hypot(*bearings.sel(bearing=name).values[:2])) for name in data["bearing"].values}
    pressed = ste["line_load"].sel(torque=LOAD).interp(misalignment=at_rest)
    return {
        "misalignment [µrad]": at_rest / 1e-6,
        "centroid [mm]": float(data["centroid"].mean()) / mm,
        **{f"{name} [N]": force for name, force in forces.items()},
        "DTE rms [µm]": found.rms.max() / um,
        "resonance [Hz]": found.place[np.argmax(found.rms)],
        "line load [N/mm]": float(pressed.max("phase").mean()) / 1e3,
    }


def report(table: dict[float, dict[str, float]]) -> str:
    """One column per tilt."""
    lines = [f"{'tilt [mrad]':28s}" + "".join(f"{tilt * 1e3:10.2f}" for tilt in table)]
    for name in next(iter(table.values())):
        lines.append(f"{name:28s}" + "".join(f"{column[name]:10.2f}" for column in table.values()))
    return "\n".join(lines)


def draw(path: Path, table: dict[float, dict[str, float]], runs: dict[float, exugear.Run]) -> None:
    """Envelope of the DTE over mesh frequency; misalignment, centroid and bearing forces over the tilt."""
    figure = plots.figure(columns=3)
    left, middle, right = figure.axes
    for tilt, run in runs.items():
        if tilt >= 0:
            found = outline(run)
            left.plot(found.place, found.amplitude / um, label=f"{tilt * 1e3:g} mrad", linewidth=1)
    left.set(xlabel="mesh frequency [Hz]", ylabel="amplitude of the dynamic transmission error [µm]")
    tilts = np.array(list(table)) * 1e3
    column = lambda name: [row[name] for row in table.values()]  # noqa: E731
    middle.plot(tilts, tilts * 1e3 * np.cos(paper_pair().alpha_wt), "k:", label="rigid bearings")
    middle.plot(tilts, column("misalignment [µrad]"), "o-", label="misalignment under load")
    middle.set(xlabel="tilt of the driven shaft [mrad]", ylabel="misalignment in the plane of action [µrad]")
    beside = middle.twinx()
    beside.plot(tilts, column("centroid [mm]"), "s-", color=plots.MARK, label="centroid (right)")
    beside.set_ylabel("centroid of the mesh force [mm]", color=plots.MARK)
    beside.legend(frameon=False, loc="upper center")
    for axial in (0.0, LENGTH):
        name = f"driven at {axial / mm:g} mm"
        right.plot(tilts, column(f"{name} [N]"), "o-", label=name)
    right.set(xlabel="tilt of the driven shaft [mrad]", ylabel="mean radial bearing force [N]")
    for ax, place in zip((left, middle, right), ("upper right", "lower center", "best"), strict=True):
        ax.grid(alpha=0.3)
        ax.legend(frameon=False, loc=place)
    figure.savefig(path, dpi=110)


def main(arguments: list[str] | None = None) -> dict[float, exugear.Run]:
    """The runs by tilt [rad]."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="for the figure")
    parser.add_argument("--quick", action="store_true", help="a smaller map, fewer tilts, a shorter run-up")
    chosen, began = parser.parse_args(arguments), time.perf_counter()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    ste = ste_map(chosen.quick)
    print(f"map of {ste['te'].size} states: {time.perf_counter() - began:.1f} s", flush=True)
    law = exugear.MeshForce.from_ste(ste, damping=DAMPING)
    plan, runs = sweep(law, TILTS[::2] if chosen.quick else TILTS, 0.2 if chosen.quick else 2.0)
    table = {tilt: figures(ste, run) for tilt, run in runs.items()}
    draw(chosen.folder / "bearings_misalignment.png", table, runs)
    print(plan, report(table), f"all: {time.perf_counter() - began:.1f} s", sep="\n\n")
    return runs


if __name__ == "__main__":
    main()
