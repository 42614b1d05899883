"""A ring on bolts: its mesh is soft between them, and a sensor on its rim hears the planets pass.

    python examples/ring_that_bends.py results

Finite elements give the mesh stiffness around the ring and the modes of its rim, whose amplitudes are coordinates of
the run. Three equal planets are heard at every third order of the carrier; bending puts order 99 at 96 and 102.
"""

from pathlib import Path

import numpy as np
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, um

BOLTS, LOAD, ORDERS = fem.Bolts(number=9, radial=3e8, tangential=3e8, width=10 * mm), 900.0, np.arange(80, 120)
COARSE = fem.Slices(fem.Density().scaled(0.5))


def ring_and_model(quick: bool) -> tuple:
    """Map of the ring over the angle between its bolts, and the model of the set 21/39/-99, module 3 mm."""
    size, torques = {"m_n": 3 * mm, "b": 25 * mm}, np.array([0.0, 20, 100, 300, 600])
    sun, planet = (fem.Gear(z=z, d_bore=20 * mm, s_n=4.65 * mm, **size) for z in (21, 39))
    ring = fem.Gear(z=-99, d_a=292.2 * mm, d_rim=322.5 * mm, support=BOLTS, **size)
    pairs = [fem.GearPair(sun, planet, a=90 * mm), fem.GearPair(planet, ring, a=-90 * mm)]
    options, angles = ({"resolution": COARSE}, 6) if quick else ({"resolution": fem.Slices()}, None)
    of_sun = fem.static_transmission_error(pairs[0], torques * 21 / 39, 12, **options)
    of_ring = fem.static_transmission_error(pairs[1], torques, 12, ring_angles=angles, **options)
    shafts = {"sun": exugear.Shaft("sun", {0.0: sun}), "ring": exugear.Shaft("ring", {0.0: ring})}
    shafts["carrier"] = exugear.Shaft("carrier", {}, inertia=0.02, mass=5.0)
    maps = {"sun_mesh": of_sun, "ring_mesh": fem.over_pitches(of_ring), "damping_ratio": 0.05}
    maps |= {"ring_modes": fem.ring_modes(pairs[1], 10 if quick else 20, **options), "ring_damping_ratio": 0.02}
    return of_ring, exugear.build(exugear.Gearbox([exugear.Planetary(**shafts, **maps)], held="ring"))


def main(folder: Path, quick: bool = False) -> dict[int, float]:
    """Amplitudes of the acceleration of the rim [m/s^2] by order of the carrier."""
    folder.mkdir(parents=True, exist_ok=True)
    (of_ring, model), figure, turn = ring_and_model(quick), plots.figure(2, 2), 0.1 if quick else 0.25
    print(model.plan.sets["carrier"])
    run = exugear.run_up(model, speed=2 * np.pi / turn * 120 / 21, load=LOAD, duration=1.4 * turn, sample=turn * 1e-4)
    stiffness, displacement, acceleration, spectrum = figure.axes
    plots.plot_ring_stiffness(of_ring, stiffness).set(title="mesh stiffness between two bolts")
    drawn = {"displacement": (um, "µm", displacement), "acceleration": (1.0, "m/s²", acceleration)}
    for quantity, (unit, label, ax) in drawn.items():
        signal = exugear.RingSensor(30 * deg, quantity=quantity).signal(run)
        last = exugear.over_angle(signal, highest_order=320).isel(angle=slice(-800, -80))
        ax.plot((last["angle"] - last["angle"][0]) / deg, last / unit, lw=0.6)
        ax.set(xlabel="carrier [deg]", ylabel=f"{quantity} [{label}]", title="sensor on the rim")
    lines = 2 / 720 * np.abs(np.fft.rfft(last.values))[ORDERS]
    spectrum.bar(ORDERS, lines, color=["C3" if order % 3 == 0 else "C0" for order in ORDERS])
    spectrum.set(xlabel="order of the carrier", ylabel="acceleration [m/s²]", title="side bands of the mesh, order 99")
    figure.savefig(folder / "ring_that_bends.png", dpi=100)
    return dict(zip(ORDERS.tolist(), lines.tolist(), strict=True))


if __name__ == "__main__":
    print(main(**vars(command_line(__doc__, "quick").parse_args())))
