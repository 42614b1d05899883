"""Imports: no library that a scene does not use."""

import importlib
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
def test_no_library_is_imported_before_it_is_used(script, absent):
    printed = subprocess.run(
        [sys.executable, "-c", f"{script}\nprint(*sys.modules)"], capture_output=True, text=True, check=True
    )
    assert not absent & set(printed.stdout.split())


def test_public_names_are_there():
    import exugear
    import fem

    for package in (fem, exugear):
        assert all(hasattr(package, name) for name in package.__all__)
        assert set(package.__all__) <= set(dir(package))
    assert exugear.plots.__name__ == "exugear.plots"
    with pytest.raises(AttributeError, match="nothing"):
        _ = fem.nothing


def test_help_lists_the_public_names():
    """help(exugear) and completion by the tabulator."""
    import exugear
    import fem

    printed = pydoc.plaintext.document(exugear)
    for name in ("class Gearbox", "class Stage", "build(", "run_up(", "resonances(", "CreateGearContact"):
        assert name in printed
    assert {"Gear", "GearPair", "static_transmission_error", "map_cost", "units"} <= set(dir(fem))


def test_one_version():
    import exugear
    import fem

    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    assert fem.__version__ == exugear.__version__ == project["version"]


def test_importing_twice_is_harmless():
    importlib.reload(importlib.import_module("exugear.multibody.gear_contact"))


@pytest.mark.parametrize("name", ["iso6336", "nonlinear", "dynamic", "explicit", "stress", "units"])
def test_public_modules_show_public_names_only(name):
    import fem

    module = getattr(fem, name)
    units = {"mm", "um", "deg", "rpm", "MPa", "GPa"}
    assert {public for public in dir(module) if not public.startswith("_")} == set(getattr(module, "__all__", units))
