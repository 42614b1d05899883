"""A wind turbine's planetary stage followed by a parallel helical stage, run from the torque of the rotor.

    python examples/wind_turbine.py results

Published (KISSsoft, NREL 5 MW): planet and ring of stage 2, teeth and blanks of stage 3. All else is assumed. Members
spin. The ring hears equal planets at multiples of 3 carrier orders alone; a pin 10 um behind fills the orders between.
"""

from pathlib import Path

import numpy as np
from command_line import command_line

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, rpm, um

SUN = fem.Gear(z=18, m_n=21 * mm, x=0.389, b=550 * mm, d_bore=150 * mm)
PLANET = fem.Gear(z=36, m_n=21 * mm, x=0.5039, b=550 * mm, d_a=815.663 * mm, d_f=724.663 * mm, d_bore=450 * mm)
RING = fem.Gear(z=-93, m_n=21 * mm, x=0.1171, b=550 * mm, d_a=-1906.081 * mm, d_f=-2000.581 * mm, d_rim=2300 * mm)
STAGE_3, SIZES = {"m_n": 14 * mm, "b": 360 * mm}, {"d_a": 1395.376 * mm, "d_f": 1334.252 * mm, "d_bore": 1193.3 * mm}
SLOW = fem.Gear(z=95, x=0.6691, beta=10 * deg, **STAGE_3, **SIZES)
FAST = fem.Gear(z=24, x=0.48, beta=-10 * deg, d_a=380.747 * mm, d_f=319.623 * mm, d_bore=179.1 * mm, **STAGE_3)
PAIRS = [fem.GearPair(*x, a=a * mm) for *x, a in ((SUN, PLANET, 584), (PLANET, RING, -584), (SLOW, FAST, 861))]
#: Torques as shares of the largest one of each map, on its pinion; torque [N m] and speed behind stage 1.
TORQUES, LARGEST, ROTOR, SPEED = np.array([0, 0.02, 0.1, 0.3, 0.6, 1]), (120e3, 240e3, 350e3), 1.06e6, 47.8 * rpm
COARSE = fem.Slices(fem.Density().scaled(0.5))


def gearbox(maps: list, error: float) -> exugear.Gearbox:
    sun = exugear.Shaft("sun", {0 * mm: SUN, 800 * mm: SLOW})
    carrier, ring = exugear.Shaft("carrier", {}, inertia=3e3, mass=5e3), exugear.Shaft("ring", {0 * mm: RING})
    meshes = {"sun_mesh": maps[0], "ring_mesh": maps[1], "damping_ratio": 0.06, "pin_errors": [-error, 0, 0]}
    low = exugear.Planetary(sun=sun, ring=ring, carrier=carrier, **meshes)
    out = exugear.Shaft("generator", {800 * mm: FAST}, inertia=60.0)
    return exugear.Gearbox([low, exugear.Stage(sun, out, maps[2], damping_ratio=0.06)], held="ring", driving="carrier")


def main(folder: Path, quick: bool = False) -> dict:
    """Side bands at the ring, of equal planets and with a displaced pin."""
    folder.mkdir(parents=True, exist_ok=True)
    options = {"phases": 10, "resolution": COARSE} if quick else {"phases": 24}
    figure, lines = plots.figure(columns=3), {}
    torques = [TORQUES * top for top in LARGEST]
    maps = [fem.static_transmission_error(p, x, **options) for p, x in zip(PAIRS, torques, strict=True)]
    for ax, (name, error) in zip(figure.axes[1:], {"equal planets": 0.0, "a pin behind": 10 * um}.items(), strict=True):
        model = exugear.build(gearbox(maps, error))
        loads = {"generator": ROTOR / abs(model.gearbox.ratios["generator"])}
        run = exugear.run(model, drives={"carrier": exugear.Torque(ROTOR)}, loads=loads, start_speed=SPEED, duration=9)
        heard = exugear.force_seen_from_ring(run, reach=60 * deg).sel(time=slice(0.5, None))
        lines[name] = exugear.side_bands(heard, model.gearbox.sets[0], harmonics=1)
        print(f"{name}:\n{lines[name][['mean_amplitude', 'cause']].to_dataframe().drop(columns='share').to_string()}")
        factor = f"K_gamma {exugear.planet_shares(run)['K_gamma'].item():.3f}"
        plots.plot_side_bands(lines[name], ax).set_xlabel(f"order, {name}, {factor}")
    exugear.draw(model)
    figure.axes[0].imshow(exugear.picture(model, size=(600, 600), zoom=1.05)).axes.set_axis_off()
    figure.savefig(folder / "wind_turbine.png", dpi=75)
    return lines


if __name__ == "__main__":
    main(**vars(command_line(__doc__, "quick").parse_args()))
