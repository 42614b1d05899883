"""The source distribution is whole; the wheel made of it holds all modules and all that they read."""

import os
import subprocess
import sys
import tarfile
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: What the packages read or show, beside their modules.
READ = ("fem/py.typed", "exugear/py.typed", "fem/__init__.pyi", "exugear/reporting/page.html.jinja", "exugear/docs")
#: Imports every module below two packages and says how many; their public names are looked up too.
SCRIPT = """
import importlib, pkgutil, exugear, fem
for package in (fem, exugear):
    modules = [name for _, name, _ in pkgutil.walk_packages(package.__path__, package.__name__ + ".")]
    for name in modules:
        importlib.import_module(name)
    [getattr(package, name) for name in package.__all__]
    print(package.__file__, len(modules))
"""


def run(*command, **options) -> str:
    return subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True, **options).stdout


@pytest.mark.slow
def test_a_wheel_of_the_source_distribution_imports_everything(tmp_path):
    """Dependencies are those of this environment, the packages those of the wheel alone."""
    tools, built, environment = tmp_path / "tools", tmp_path / "built", tmp_path / "environment"
    run(sys.executable, "-m", "pip", "install", "-q", "--target", tools, "hatchling>=1.27")
    surroundings = os.environ | {"PYTHONPATH": str(tools)}
    run(sys.executable, "-m", "hatchling", "build", "-t", "sdist", "-d", built, cwd=ROOT, env=surroundings)
    (packed,) = built.glob("*.tar.gz")
    with tarfile.open(packed) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert set(run("git", "ls-files", cwd=ROOT).splitlines()) <= names
    run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", built, packed)
    venv.create(environment, with_pip=False)
    python = environment / ("Scripts" if os.name == "nt" else "bin") / "python"
    run(sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", *built.glob("*.whl"))
    (site,) = environment.rglob("site-packages")
    (site / "dependencies.pth").write_text(str(Path(pytest.__file__).parents[1]))
    surroundings = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    assert all((site / name).exists() for name in READ)
    lines = run(python, "-P", "-c", SCRIPT, cwd=tmp_path, env=surroundings).split()
    for package, file, number in zip(("fem", "exugear"), lines[::2], lines[1::2], strict=True):
        assert Path(file) == site / package / "__init__.py"
        assert int(number) == sum(1 for path in (ROOT / package).rglob("*.py")) - 1
