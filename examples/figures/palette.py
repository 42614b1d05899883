"""Small PNG files for the documents: at most 64 colours.

    python examples/figures/palette.py results

takes the figures that the examples wrote to a folder and writes those of the gallery beside this script.
"""

import sys
from io import BytesIO
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
#: Largest width of a figure of the gallery [pixels].
WIDTH = 1040
GALLERY = (
    "bearings_misalignment",
    "flexible_shaft",
    "korta_convergence",
    "korta_fields",
    "korta_run_up",
    "korta_static_dynamic",
    "korta_two_laws",
    "planetary",
    "planetary_load_sharing",
    "two_stage_helical",
    "two_stage_helical_gears",
)
#: Files of the results that are not named after their example.
NAMES = {"korta_run_up": "run_up", "korta_fields": "fields"}


def small(image: Image.Image, path: Path, colours: int = 64) -> None:
    """Write an image with a palette."""
    image.convert("RGB").quantize(colours, dither=Image.Dither.NONE).save(path, optimize=True)


def save_small(figure, path: Path, dpi: int = 110) -> None:
    """Write a matplotlib figure with a palette."""
    content = BytesIO()
    figure.savefig(content, dpi=dpi)
    small(Image.open(content), path)


def collect(results: Path) -> None:
    """Figures of the gallery out of what the examples wrote."""
    for name in GALLERY:
        image = Image.open(results / f"{NAMES.get(name, name)}.png").convert("RGB")
        if image.width > WIDTH:
            image = image.resize((WIDTH, round(image.height * WIDTH / image.width)), Image.Resampling.LANCZOS)
        small(image, HERE / f"{name}.png")


if __name__ == "__main__":
    collect(Path(sys.argv[1]))
