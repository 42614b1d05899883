"""Planets in phase and in sequence: what the torque loses, the orbit of the floating sun gains.

    python examples/planet_phasing.py results

The set of Shweiki et al. (ISMA 2016, no. 0785), its carrier run up to 30 rpm at 129.85 kN m. In sequence mesh harmonics
nearly vanish from the torque, as the paper says. The torque is of helical gears, orbits are of spur gears on pins.
"""

from pathlib import Path

import numpy as np
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, rpm

ANGLES = {"in phase": (0.0, 120 * deg, 240 * deg), "in sequence": (0.0, 126 * deg, 252 * deg)}
TORQUES, LOAD, ORDERS = np.array([0, 500, 2000, 5000, 1e4, 2e4]), 129.85e3 * 21 / 120, 99 * np.arange(1, 5)
COARSE = fem.Slices(fem.Density().scaled(0.5))


def members(beta: float, **options) -> dict:
    """Shafts and maps: helical gears spin; of spur gears the sun floats, and planets stand on elastic pins."""
    size = {"m_n": 10 * mm, "b": 220 * mm}
    sun, planet = fem.Gear(z=21, beta=beta, d_bore=90 * mm, **size), fem.Gear(z=39, beta=-beta, d_bore=160 * mm, **size)
    ring = fem.Gear(z=-99, beta=-beta, d_a=(12 - 990 / np.cos(beta)) * mm, d_rim=1150 * mm, **size)
    pairs = {"sun_mesh": fem.GearPair(sun, planet), "ring_mesh": fem.GearPair(planet, ring)}
    maps = {x: fem.static_transmission_error(p, TORQUES * p.pinion.z / 21, **options) for x, p in pairs.items()}
    soft, pin = (exugear.Bearing(radial=k, axial=1e9, tilt=1e7, damping_time=5e-5) for k in (2e7, 2e9))
    shafts = [exugear.Shaft("sun", {0.0: sun if beta else [sun, soft]}), exugear.Shaft("ring", {0.0: ring})]
    shafts.append(exugear.Shaft("carrier", {}, inertia=100.0, mass=1000.0))
    return {shaft.name: shaft for shaft in shafts} | maps | {"damping_ratio": 0.05, "pin": None if beta else pin}


def main(folder: Path, quick: bool = False) -> dict[str, np.ndarray]:
    """Sums of mesh harmonics, in sequence over in phase: by the rule and in the torque; radii of the orbits [m]."""
    folder.mkdir(parents=True, exist_ok=True)
    options = {"phases": 12, "resolution": COARSE} if quick else {"phases": 24}
    kinds, figure, cuts, radii = [members(b, **options) for b in (7.5 * deg, 0)], plots.figure(2, 2), [], {}
    ramp = {"speed": (2 * rpm, 30 * rpm), "load": LOAD, "duration": 4.5 if quick else 12.0, "sample": 4e-4}
    for (name, angles), colour, ax in zip(ANGLES.items(), plots.DISTINCT, figure.axes[:2], strict=False):
        sets = [exugear.Planetary(**parts, angles=angles) for parts in kinds]
        boxes = [exugear.Gearbox([x], held="ring", driving="carrier", driven="sun") for x in sets]
        spinning, floating = (exugear.run_up(exugear.build(x), displacement=True, **ramp) for x in boxes)
        torque, orbit = exugear.signal(spinning, "drive_torque"), exugear.member_orbit(floating, "sun")
        radii[name], spectra = orbit["radius"].values, exugear.waterfall(torque, resolution=4.0)
        plots.plot_spectrogram(spectra, ax, top=600, vmin=-20, vmax=20).set(title=f"torque, planets {name}")
        plots.plot_orbit(orbit, figure.axes[3], color=colour).get_legend().remove()
        figure.axes[3].set(title="orbit of the sun (in phase: a point)")
        cuts.append(exugear.order_cut(torque, ORDERS)["amplitude"].values)
    rule, torque = sets[0].mesh_phases(4), np.median(cuts[1] / cuts[0], axis=1)
    plots.plot_phase_sums(rule, figure.axes[2]).plot(ORDERS / 99, torque, "k_", ms=20)
    figure.savefig(folder / "planet_phasing.png", dpi=100)
    sums = {"rule": rule["torque_sum"].values, "torque": torque}
    print(*(f"{name} {x.round(4)} = {(20 * np.log10(x)).round(1)} dB" for name, x in sums.items()), radii, sep="\n")
    return sums | radii


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
