"""Natural frequencies of a planetary set beside published ones.

    python examples/planetary.py results

The set is built by hand (`planetary_set.py`): rigid planar bodies, `CreateGearContact` for every mesh, and Exudyn's
springs for the bearings. All coordinates are free, so that the lowest frequency is 0. Pairs of equal frequencies are
modes in which sun, ring and carrier translate; in single ones they rotate, or stand still while the planets move.
"""

from pathlib import Path

import exudyn as exu
import numpy as np
from command_line import command_line
from planetary_set import DEPTH, build, put_into_mesh

import exugear
from exugear import plots

#: Lin & Parker, J. Vib. Acoust. 121 (1999), three planets [Hz].
PUBLISHED = (0, 743.2, 743.2, 1102.4, 1102.4, 1475.7, 1896.0, 1896.0, 1930.3, 2276.4, 2276.4, 2658.3)


def natural_frequencies(planets: int = 3, depth: float = DEPTH) -> np.ndarray:
    """In rising order [Hz]: all coordinates free, all teeth in contact to a depth [m]."""
    gears = build(planets=planets)
    gears.mbs.Assemble()
    put_into_mesh(gears, depth)
    return exugear.modes(gears.mbs)["frequency"].values


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
    exu.config.printToConsole = False
    frequencies, number = natural_frequencies(), np.arange(1, len(PUBLISHED) + 1)
    draw(folder / "planetary.png", number, frequencies[: number.size])
    for i, f, published in zip(number, frequencies, PUBLISHED, strict=False):
        print(f"mode {i:2d}: {f:8.1f} Hz, published {published:8.1f} Hz")
    return frequencies


if __name__ == "__main__":
    main(**vars(command_line(__doc__).parse_args()))
