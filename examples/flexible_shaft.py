"""The paper's pair with a flexible pinion shaft: finite elements, Craig-Bampton modes and gear contact in one system.

    python examples/flexible_shaft.py results

The shaft (`shaft_modes.py`) is meshed by scikit-fem and reduced by Exudyn; `shaft_rig.py` puts it under the pinion. The
shaft bends by 47 um under the mesh force, as a Timoshenko beam does. At 1000 rpm its DTE swings by a third less than
that of a rigid shaft, because the mesh resonance moves.
"""

import time
from pathlib import Path

import exudyn as exu
import numpy as np
from command_line import command_line
from exudyn.FEM import FEMinterface
from korta_pair import paper_pair
from shaft_modes import beam_deflection, reduced, solid_shaft, torsion_frequency
from shaft_rig import TORQUE, Rig, build, flexible_shaft, spins

import exugear
import fem
from exugear import plots
from fem.units import rpm, um

SPEED, MESH_DAMPING, MESH_RESONANCE = 1000 * rpm, 2700.0, 2900.0


def equilibrium(rig: Rig) -> Rig:
    """Solve the static equilibrium under the torque; the first guess is the deflection of the mesh of rigid shafts."""
    system, initial = rig.mbs.systemData, exu.ConfigurationType.Initial
    q = np.zeros(system.ODE2Size())
    q[spins(rig)[0]] = rig.force.deflection_at(0.0, TORQUE / rig.pair.pinion.r_b) / rig.pair.pinion.r_b
    system.SetODE2Coordinates(q, initial)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.newton.relativeTolerance = 1e-8
    rig.mbs.SolveStatic(settings, updateInitialValues=True)
    return rig


def run(rig: Rig, duration: float = 0.06, tolerance: float = 1e-3) -> tuple[np.ndarray, float]:
    """Times (n,) [s] of the recorder's samples at constant speed, and the processor time of a step [s]."""
    system, initial = rig.mbs.systemData, exu.ConfigurationType.Initial
    wheel = -SPEED * rig.pair.pinion.z / rig.pair.wheel.z
    rig.mbs.SetObjectParameter(rig.drive, "offsetUserFunction", lambda mbs, t, item, offset: wheel * t)
    rig.mbs.SetObjectParameter(rig.drive, "offsetUserFunction_t", lambda mbs, t, item, offset: wheel)
    velocity = np.zeros(system.ODE2Size())
    driving, driven = spins(rig)
    velocity[driving], velocity[driven] = SPEED, wheel
    system.SetODE2Coordinates_t(velocity, initial)
    settings = exugear.integrator(rig.mbs, duration, MESH_RESONANCE, tolerance=tolerance)
    steps = int(settings.timeIntegration.numberOfSteps)
    rig.recorder.start(duration / steps, steps + 1)
    began = time.process_time()
    rig.mbs.SolveDynamic(settings)
    return np.linspace(0, duration, steps + 1), (time.process_time() - began) / steps


def free_frequencies(solid: FEMinterface) -> np.ndarray:
    """Eigenfrequencies [Hz] of the reduced shaft, free in Exudyn, without those of its six rigid motions."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    flexible_shaft(mbs, (0.0, 0.0), solid)
    mbs.Assemble()
    squares = np.array(mbs.ComputeODE2Eigenvalues()[0])
    return np.sqrt(np.sort(squares)[6:]) / (2 * np.pi)


def bending(rig: Rig) -> float:
    """Distance of the gear from the line between the bearings [m]."""
    gear, *supports = rig.positions()[:, :2]
    return float(np.linalg.norm(gear - np.mean(supports, axis=0)))


def last_cycles(times: np.ndarray, values: np.ndarray, cycles: int, teeth: int, n: int = 64) -> np.ndarray:
    """(cycles n,) values over the last mesh cycles at equal steps."""
    period = 2 * np.pi / (SPEED * teeth)
    return np.interp(times[-1] - period * np.arange(cycles * n, 0, -1) / n, times, values)


def draw(path: Path, curves: dict[str, np.ndarray], n: int = 64) -> None:
    """DTE over two mesh cycles, and the amplitudes of its harmonics, of each shaft."""
    figure = plots.figure(columns=2)
    left, right = figure.axes
    for i, (name, dte) in enumerate(curves.items()):
        cycles = dte.size // n
        left.plot(np.arange(2 * n) / n, dte[-2 * n :] / um, label=name)
        amplitude = 2 * abs(np.fft.rfft(dte))[cycles : 9 * cycles : cycles] / dte.size
        right.bar(np.arange(1, 9) + 0.4 * i - 0.2, amplitude / um, width=0.4, label=name)
    left.set(xlabel="mesh cycles", ylabel="dynamic transmission error [µm]", title=f"{SPEED / rpm:.0f} rpm")
    right.set(xlabel="mesh order", ylabel="amplitude of the DTE [µm]", title=f"{SPEED / rpm:.0f} rpm")
    left.set_ylim(2, None)
    left.legend(frameon=False, ncols=2, loc="lower left")
    right.legend(frameon=False)
    figure.savefig(path, dpi=100)


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    exu.config.printToConsole = False
    pair, curves = paper_pair(), {}
    ste = fem.static_transmission_error(pair, (0, 5, 50, 150, 350, 700), 30, progress=False)
    force, mean = exugear.MeshForce.from_ste(ste, damping=MESH_DAMPING), TORQUE / pair.pinion.r_b
    solid = reduced(solid_shaft())
    free = free_frequencies(solid)
    torsion = free[abs(free - torsion_frequency()).argmin()]
    print(f"free shaft: bending {free[0]:.0f} Hz, torsion {torsion:.0f} Hz (rod: {torsion_frequency():.0f} Hz)")
    for name, shaft in (("rigid shaft", None), ("flexible shaft", solid)):
        rig = equilibrium(build(pair, force, shaft))
        print(f"{name}: bends by {bending(rig) / um:.2f} um (beam: {beam_deflection(mean) / um:.2f} um)", end=", ")
        times, cost = run(rig)
        dte, forces = (last_cycles(times, x, 20, pair.pinion.z) for x in (rig.recorder.deflection, rig.recorder.force))
        print(f"mesh force {forces.mean():.1f} N (T/r_b: {mean:.1f} N), DTE {np.ptp(dte) / um:.2f} um peak to peak")
        print(f"  {times.size - 1} steps of {times[1] / 1e-6:.2f} us, {cost / 1e-6:.0f} us of processor time each")
        curves[name] = dte
    draw(folder / "flexible_shaft.png", curves)


if __name__ == "__main__":
    main(**vars(command_line(__doc__).parse_args()))
