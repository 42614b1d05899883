"""What an import costs: nothing that the scene does not use."""

import pydoc
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

SPINNING = """
import sys
import numpy as np
import exugear, fem
gear = fem.Gear(z=57, m_n=2.6e-3, b=23e-3, d_bore=60e-3)
pair = fem.GearPair(gear, gear, a=149e-3)
ste = fem.ste_map(pair, [0, 100, 400], np.arange(4) / 4, 1e-6 * np.outer([0, 5, 18], [1, 1.1, 1.2, 1.1]))
shafts = [exugear.Shaft(name, {0.0: gear}) for name in "ab"]
model = exugear.build(exugear.Gearbox([exugear.Stage(*shafts, ste, damping=2000.0)]))
exugear.run_up(model, speed=100.0, duration=0.01, load=50.0, progress=False)
"""


@pytest.mark.parametrize(
    ("script", "absent"),
    [
        ("import sys, fem", {"skfem", "scipy", "xarray", "numba"}),
        ("import sys, exugear", {"skfem", "matplotlib", "scipy.optimize", "scipy.signal"}),
        (SPINNING, {"skfem", "matplotlib"}),
    ],
)
def test_nothing_is_imported_that_is_not_used(script, absent):
    told = subprocess.run(
        [sys.executable, "-c", f"{script}\nprint(*sys.modules)"], capture_output=True, text=True, check=True
    )
    assert not absent & set(told.stdout.split())


def test_public_names_are_there():
    import exugear
    import fem

    for package in (fem, exugear):
        assert all(hasattr(package, name) for name in package.__all__)
        assert set(package.__all__) <= set(dir(package))
    assert exugear.plots.__name__ == "exugear.post.plots"
    with pytest.raises(AttributeError, match="nothing"):
        _ = fem.nothing


def test_help_lists_what_there_is():
    """As somebody meets it who types help(exugear) or presses the tabulator."""
    import exugear
    import fem

    told = pydoc.plaintext.document(exugear)
    for name in ("class Gearbox", "class Stage", "build(", "run_up(", "resonances(", "CreateGearContact"):
        assert name in told
    assert {"Gear", "GearPair", "static_transmission_error", "map_cost", "units"} <= set(dir(fem))


def test_one_version():
    import exugear
    import fem

    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    assert fem.__version__ == exugear.__version__ == project["version"]
