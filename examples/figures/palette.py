"""Small PNG files for the documents: a palette of a few colours, less than 60 kB.

    python examples/figures/palette.py results

takes the figures that the examples wrote to a folder and writes those of the gallery beside this script.
"""

import sys
from io import BytesIO
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
#: Widths of a figure of the gallery [pixels]: the first that is small enough, and that largest size [bytes].
WIDTHS, LARGEST = (1040, 900, 830, 760), 60_000
GALLERY = (
    "bearings_misalignment",
    "benchmark",
    "class_6_gears",
    "coast_down",
    "e_axle_shaft",
    "ev_reducer",
    "flexible_shaft",
    "growing_crack",
    "hand_built_contact",
    "helical_and_spur",
    "korta_convergence",
    "korta_fields",
    "korta_run_up",
    "korta_static_dynamic",
    "korta_two_laws",
    "measured_table",
    "planet_phasing",
    "planetary",
    "planetary_load_sharing",
    "rexs_gearbox",
    "run_report",
    "shuttling",
    "steady_states",
    "tip_relief",
    "tip_relief_drawing",
    "two_stage_helical",
    "two_stage_helical_gears",
    "wind_turbine",
)
#: Files of the results that are not named after their example.
NAMES = {"korta_run_up": "run_up", "korta_fields": "fields"}


def small(image: Image.Image, path: Path, colours: int = 64) -> None:
    """Write an image with a palette that keeps rare colours."""
    image.convert("RGB").quantize(colours, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
        path, optimize=True
    )


def save_small(figure, path: Path, dpi: int = 110) -> None:
    """Write a matplotlib figure with a palette."""
    content = BytesIO()
    figure.savefig(content, dpi=dpi)
    small(Image.open(content), path)


def collect(results: Path) -> None:
    """Figures of the gallery out of what the examples wrote, if they wrote them."""
    for name in GALLERY:
        source, path = results / f"{NAMES.get(name, name)}.png", HERE / f"{name}.png"
        if not source.exists():
            continue
        image = Image.open(source).convert("RGB")
        for width in WIDTHS:
            size = min(width, image.width), round(image.height * min(width, image.width) / image.width)
            small(image if size == image.size else image.resize(size, Image.Resampling.LANCZOS), path)
            if path.stat().st_size < LARGEST:
                break


if __name__ == "__main__":
    collect(Path(sys.argv[1]))
