"""Load sharing of a planetary set under a rising load, the pin of a planet displaced.

    python examples/planetary_load_sharing.py results

A pin ahead takes load off its planet, a pin behind adds load: a force that does not grow with the load, so that shares
even out as it rises, and by a floating sun at any load. Masses, stiffnesses: Lin & Parker, J. Vib. Acoust. 121 (1999).
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, rpm, um

GEAR = fem.Gear(z=30, m_n=3 * mm, alpha_n=24.6 * deg, b=25 * mm, d_bore=30 * mm)
PAIR, RING_PAIR = fem.GearPair(GEAR, GEAR, a=90 * mm), exugear.RingPair(GEAR, z=-90, a=-90 * mm)
LAW = exugear.MeshForce([0.0], np.array([0, 1 * mm]), np.array([[0, 5e8 * mm]]), damping=1500.0)
BEARING, LOADS = exugear.Bearing(radial=1e8, axial=1e8, tilt=1e6, damping_time=2e-5), (500.0, 2500.0)


def shaft(name: str, mass: float, inertia_over_r2: float, r: float, *parts) -> exugear.Shaft:
    return exugear.Shaft(name, {0.0: [*parts]}, mass=mass, inertia=inertia_over_r2 * r**2)


def gearbox(planets: int = 3, sun: exugear.Bearing = BEARING, pin_errors=None) -> exugear.Gearbox:
    """The set; the sun drives the carrier, the ring stands on an elastic torque support."""
    arm = exugear.TorqueSupport(1e9 * (3 * GEAR.r_b) ** 2)
    ring = shaft("ring", 2.35, 3.0, 3 * GEAR.r_b, RING_PAIR.wheel, BEARING, arm)
    carrier = shaft("carrier", 5.43, 6.29, PAIR.a, BEARING)
    members = {"sun": shaft("sun", 0.4, 0.39, GEAR.r_b, GEAR, sun), "ring": ring, "carrier": carrier}
    meshes = {"sun_mesh": LAW, "sun_pair": PAIR, "ring_mesh": LAW, "ring_pair": RING_PAIR}
    on_pins = {"planet": shaft("planet", 0.66, 0.61, GEAR.r_b, GEAR), "pin": BEARING, "pin_errors": pin_errors}
    return exugear.Gearbox([exugear.Planetary(**members, **meshes, **on_pins, planets=planets)])


def main(folder: Path, errors=(-20 * um, -10 * um, 0.0, 10 * um, 20 * um), duration: float = 0.5) -> dict:
    """Runs by displacement of the first planet's pin [m], the last one with a floating sun."""
    folder.mkdir(parents=True, exist_ok=True)
    boxes = {f"{x / um:+g} µm": gearbox(pin_errors=(x, 0, 0)) for x in errors}
    boxes["floating sun"] = gearbox(sun=replace(BEARING, radial=1e6), pin_errors=(min(errors), 0, 0))
    runs = {x: exugear.run_up(exugear.build(boxes[x]), speed=1000 * rpm, load=LOADS, duration=duration) for x in boxes}
    ax = plots.figure(columns=1).axes[0]
    for name, run in runs.items():
        shares = exugear.planet_shares(run)["share"].values
        faces = exugear.load_distribution(boxes[name], max(LOADS), mesh_stiffness=5e8 / GEAR.b)
        in_run, in_statics = (np.round(100 * x, 1) for x in (shares[:, -1], faces["K_gamma"][::2].values / 3))
        print(f"planet 1 {name}: shares {in_run} %, in statics {in_statics} %, K_Hbeta {faces['K_H_beta'].max():.3f}")
        ax.plot(run.data["time"], 100 * shares[0], "k--" if name == "floating sun" else "-", label=name)
    ax.set(title="pin of planet 1 ahead (+) or behind (-)", ylabel="share of planet 1 [%]", xlabel="time [s]")
    ax.legend(ncols=2).figure.savefig(folder / "planetary_load_sharing.png", dpi=100)
    return runs


if __name__ == "__main__":
    main(**vars(command_line(__doc__).parse_args()))
