"""Natural frequencies of a planetary set beside published ones.

    python examples/planetary.py results

The set is that of `planetary_load_sharing.py`: planets on elastic pins, sun, ring and carrier on bearings. The sun may
turn, so that the lowest frequency is 0. Pairs of equal frequencies are modes in which sun, ring and carrier translate;
in single ones they rotate, or stand still while the planets move.
"""

from pathlib import Path

import numpy as np
import xarray as xr
from command_line import command_line
from planetary_load_sharing import gearbox

import exugear
from exugear import plots

#: Lin & Parker, J. Vib. Acoust. 121 (1999), three planets [Hz].
PUBLISHED = (0, 743.2, 743.2, 1102.4, 1102.4, 1475.7, 1896.0, 1896.0, 1930.3, 2276.4, 2276.4, 2658.3)


def modes(planets: int = 3, load: float = 1.0) -> xr.Dataset:
    """Modes under a load on the carrier [N m], which presses all teeth."""
    return exugear.modes(exugear.build(gearbox(planets)), load=load, drive="free")


def draw(path: Path, number: np.ndarray, frequencies: np.ndarray) -> None:
    """Frequencies beside the published ones, and the deviation of each but that of the rigid motion."""
    figure = plots.figure(columns=2)
    both, apart = figure.axes
    both.bar(number - 0.2, frequencies, 0.4, label="exugear")
    both.bar(number + 0.2, PUBLISHED, 0.4, label="Lin & Parker (1999)")
    both.set(xlabel="mode", ylabel="natural frequency [Hz]", xticks=number)
    both.legend(frameon=False)
    published = np.array(PUBLISHED[1:])
    apart.bar(number[1:], 100 * (frequencies[1:] / published - 1), 0.5, color=plots.DISTINCT[0], label="exugear")
    rounding = 100 * 0.05 / published
    apart.plot(number[1:], rounding, "_", number[1:], -rounding, "_", color="k", markersize=14)
    apart.plot([], [], "_", color="k", markersize=14, label="rounding of the published frequency")
    apart.axhline(0, color="0.35", linewidth=0.8)
    apart.set(xlabel="mode", ylabel="deviation from the published [%]", xticks=number)
    apart.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, 1.2), ncols=2)
    figure.savefig(path, dpi=100)


def main(folder: Path) -> np.ndarray:
    """Natural frequencies [Hz]."""
    folder.mkdir(parents=True, exist_ok=True)
    data, number = modes(), np.arange(1, len(PUBLISHED) + 1)
    frequencies, kinds = data["frequency"].values, data["kind"].values
    draw(folder / "planetary.png", number, frequencies[: number.size])
    for i, f, published, kind in zip(number, frequencies, PUBLISHED, kinds, strict=False):
        print(f"mode {i:2d}: {f:8.1f} Hz, published {published:8.1f} Hz, {kind}")
    return frequencies


if __name__ == "__main__":
    main(**vars(command_line(__doc__).parse_args()))
