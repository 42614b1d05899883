"""Print the lower bounds of pyproject.toml as constraints for pip: numpy>=2.2 and numpy>=2.2,<3 become numpy==2.2."""

import re
import tomllib
from itertools import chain
from pathlib import Path


def lower_bounds(project: dict) -> list[str]:
    """Of all requirements; ValueError for those without."""
    requirements = [*project["dependencies"], *chain(*project["optional-dependencies"].values())]
    strange = [text for text in requirements if not re.fullmatch(r"[\w-]+>=[\d.]+(,<[\d.]+)?", text)]
    if strange:
        raise ValueError(f"requirements must have a lower bound, as numpy>=2.2 or numpy>=2.2,<3, got {strange}")
    return [text.split(",")[0].replace(">=", "==") for text in requirements]


if __name__ == "__main__":
    file = Path(__file__).parents[1] / "pyproject.toml"
    print("\n".join(lower_bounds(tomllib.loads(file.read_text(encoding="utf-8"))["project"])))
