"""Side bands of the mesh harmonics of a planetary set with what excites each of them; the set as its ring hears it."""

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.planetary import Planetary
from exugear.gearbox.side_band_lines import SideBandLine, side_band_lines
from exugear.running.run_data import stage_data
from exugear.running.set_data import set_of_run
from exugear.signals.order_cut import order_cut
from exugear.signals.signal import MOST, angle_of_shaft
from exugear.signals.signal import signal as signal_of
from fem.support.arguments import Finite, checked
from fem.support.validation import require

#: Relative difference of mesh orders of the same turns: recorded speeds vibrate.
SAME_TURNS = 1e-3
#: Least ratio to the largest amplitude, so that the level of 0 is -200 dB.
FLOOR = 1e-10


@checked
def side_bands(
    signal: xr.DataArray,
    planetary: Planetary,
    *,
    harmonics: int = 3,
    carrier_orders: int = 6,
    members: Sequence[str] = (),
    mesh: str = "ring",
    revolutions: float | None = None,
    overlap: float = 0.75,
) -> xr.Dataset:
    """Lines about the mesh harmonics of a planetary set, their levels, and what excites each of them.

    signal          (..., time) whose orders count turns of the carrier against the ring: `exugear.signal`(run, ...,
                    turns_of="carrier", relative_to="ring"), or a `recorded_signal` of such turns
    planetary       the set: its teeth and the angles of its planets
    harmonics       number of mesh harmonics, the first at the order |z_ring|
    carrier_orders  largest distance of a line from its mesh harmonic, in orders of the carrier
    members         of "sun" and "planet": lines at their own turns too, |z_ring| / z orders of the carrier from a mesh
                    harmonic. These lie close to carrier orders, so that the signal must hold more turns
    mesh            "ring" or "sun": whose meshes; those of stepped planets with the sun have the order
                    |z_ring| z_1 / z_2 and lines of their own
    revolutions, overlap
                    of the windows, as in `exugear.order_cut`; without them 6 turns of the carrier are needed

    Returns the Dataset of `exugear.order_cut`, whose order_name is the cause of the line, with along order:

    mean_amplitude  over the signal
    level           20 lg of it over the largest of all lines [dB]
    harmonic        of the mesh about which the line stands
    offset          distance from it in orders; 0 of the harmonic itself
    share           of equal planets: what they add up to there, of their sum in phase. NaN of an error of one planet
    cause           in words: planets that pass, by the phasing rule offset = harmonic z_sun mod N; carrier, ring, sun
                    or planet once per turn

    Raises ValueError for signals whose orders count other turns, for numbers out of range, and as `exugear.order_cut`.
    """
    of_sun, of_ring = planetary.sun_pair, planetary.ring_pair
    z = of_sun.pinion.z, of_sun.wheel.z, of_ring.pinion.z, of_ring.wheel.z
    ring, at_sun = z[3], abs(z[3]) * z[1] / z[2]
    require(mesh in ("ring", "sun"), f'mesh must be "ring" or "sun", got {mesh!r}')
    check_numbers(harmonics, carrier_orders, members, ring)
    if "mesh_order" in signal.coords:
        order, wanted = float(signal["mesh_order"]), abs(ring)
        counted = f"signal must count turns of the carrier against the ring, {wanted} mesh cycles each, got {order:g}"
        remedy = f"turns_of={planetary.carrier.name!r}, relative_to={planetary.ring.name!r}"
        same = any(abs(order - x) < SAME_TURNS * x for x in (wanted, at_sun))
        require(same, f"{counted}; pass exugear.signal(run, ..., {remedy})")
    lines = side_band_lines(z, np.asarray(planetary.angles), harmonics, carrier_orders, members, mesh)
    return lines_of(signal, lines, revolutions=revolutions, overlap=overlap)


def check_numbers(harmonics: int, carrier_orders: int, members: Sequence[str], z_ring: int) -> None:
    """ValueError for lines that do not exist or overlap."""
    require(1 <= harmonics <= MOST, f"harmonics must lie in [1, {MOST}], got {harmonics}")
    most = (abs(z_ring) - 1) // 2
    between = f"carrier_orders must lie in [1, {most}], half way to the next mesh harmonic, got {carrier_orders}"
    require(1 <= carrier_orders <= most, between)
    known = set(members) <= {"sun", "planet"}
    others = "those of carrier and ring are among the carrier orders"
    require(known, f'members must be a list of "sun" and "planet", got {[*members]}; {others}')


def lines_of(signal: xr.DataArray, lines: Sequence[SideBandLine], **windows: Any) -> xr.Dataset:
    """`side_bands` at the lines of a set; windows: as of `exugear.order_cut`."""
    orders = np.array([line.order for line in lines])
    cut = order_cut(signal, orders, **windows)
    amplitude = cut["amplitude"].mean("time").assign_attrs(signal.attrs | {"long_name": "mean amplitude"})
    level = amplitude.copy(data=20 * np.log10(np.maximum(amplitude.values / (float(amplitude.max()) or 1.0), FLOOR)))
    causes = np.array([line.cause for line in lines])
    along = {
        "harmonic": ("order", [line.harmonic for line in lines], {"units": "1", "long_name": "mesh harmonic"}),
        "offset": ("order", [line.offset for line in lines], {"units": "1", "long_name": "distance from it"}),
        "share": ("order", [line.share for line in lines], {"units": "1", "long_name": "share of equal planets"}),
        "cause": ("order", causes, {"units": "", "long_name": "what excites the line"}),
    }
    level.attrs = {"units": "dB", "long_name": "level re the largest line"}
    return cut.assign(mean_amplitude=amplitude, level=level).assign_coords(along)


@checked
def force_seen_from_ring(run, angle: Finite = 0.0, *, ring: str | None = None, reach: float = pi) -> xr.DataArray:
    """Force of the meshes at the ring as a point of the ring hears it, loudest while a planet passes.

    run      an `exugear.Run` of a planetary set, or its data
    angle    of the point from x, in the frame of the ring [rad]
    ring     name of the ring, or of another member of its set; by default of the only set
    reach    angle between planet and point from which on the planet is not heard, in (0, pi]

    Returns a signal as of `exugear.signal` whose orders count the turns of the carrier against the ring: the sum over
    the planets of mesh force times the window (1 + cos(pi distance / reach)) / 2, 0 beyond the reach. The window stands
    for the path from mesh to sensor and is an assumption. Source: M. Inalpolat and A. Kahraman, J. Sound Vib. 323
    (2009). Raises ValueError for runs without a set, and for a reach out of range.
    """
    stage_data(run)
    data = run if isinstance(run, xr.Dataset) else run.data
    require(0 < reach <= pi, f"reach must lie in (0, pi] rad, got {reach:g}; pass radians: 60*deg")
    of_set = set_of_run(data, "ring", ring)
    heard = np.zeros(data.sizes["time"])
    turned = angle_of_shaft(data, "ring", of_set.carrier) - angle_of_shaft(data, "ring", of_set.ring)
    for label, at in zip(of_set.ring_stages, of_set.angles, strict=True):
        distance = np.abs((turned + at - angle + pi) % (2 * pi) - pi)
        weight = np.where(distance < reach, (1 + np.cos(pi * np.minimum(distance / reach, 1.0))) / 2, 0.0)
        heard += weight * data["mesh_force"].sel(stage=label).values
    turns = {"turns_of": of_set.carrier, "relative_to": of_set.ring}
    base = signal_of(data, "mesh_force", stage=of_set.ring_stages[0], **turns)
    return base.copy(data=heard).assign_attrs(units="N", long_name="mesh forces heard at the ring")
