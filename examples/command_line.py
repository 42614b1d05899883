"""Command line of an example: the folder of its results, and options."""

from argparse import ArgumentParser
from pathlib import Path

OPTIONS = {
    "quick": "coarser maps and shorter runs",
    "full": "the figures as the README of the examples shows them, with fine meshes and long runs",
    "fit-inertia": "one inertia of the gears, fitted to the paper's 1804 Hz",
}


def command_line(description: str, *options: str) -> ArgumentParser:
    """Parser of the folder, `results` by default, and of options named in `OPTIONS`.

    description   docstring of the example, whose first line the help shows
    """
    parser = ArgumentParser(description=description.partition("\n")[0])
    parser.add_argument("folder", type=Path, nargs="?", default=Path("results"), help="folder of the results")
    for name in options:
        parser.add_argument(f"--{name}", action="store_true", help=OPTIONS[name])
    return parser
