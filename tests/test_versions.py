"""The lower bounds of what exugear needs, and the environments that CI tries."""

import os
import re
import runpy
import stat
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
CI = ROOT / ".ci"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
SHIM = '#!/bin/sh\n[ "$PYENV_VERSION" = {version} ] || exit 127\nexec {python} "$@"\n'


def test_constraints_are_the_lower_bounds_of_the_project():
    command = [sys.executable, CI / "lower_bounds.py"]
    constraints = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    bounds = dict(line.split("==") for line in constraints)
    wanted = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["test"]]
    assert {f"{name}>={version}" for name, version in bounds.items()} == {text.split(",")[0] for text in wanted}
    assert {"numpy", "exudyn", "pytest"} <= set(bounds)


@pytest.mark.parametrize("requirement", ["numpy", "numpy>=2,!=2.1", "numpy<3", "numpy==2.2", "numpy[all]>=2"])
def test_requirements_without_a_lower_bound_are_refused(requirement):
    lower_bounds = runpy.run_path(str(CI / "lower_bounds.py"))["lower_bounds"]
    with pytest.raises(ValueError, match="requirements must have a lower bound"):
        lower_bounds({"dependencies": [requirement], "optional-dependencies": {}})


def chosen(folder: Path, *names: str) -> str:
    """Result of CI's search for a Python with the folder at the head of the PATH."""
    (search,) = re.findall(r"^first_python\(\) \{.*?^\}", (CI / "run").read_text(encoding="utf-8"), re.M | re.DOTALL)
    command = ["bash", "-euc", f"{search}\nfirst_python {' '.join(names)}"]
    surroundings = os.environ | {"PATH": f"{folder}:{os.environ['PATH']}"}
    return subprocess.run(command, env=surroundings, capture_output=True, text=True, check=True).stdout.strip()


@pytest.mark.skipif(os.name != "posix", reason="CI is a shell script")
def test_ci_takes_the_first_python_that_runs(tmp_path):
    """A name alone on the PATH is not enough: it may be a shim that has no such version."""
    for name, version in (("python3.98", "3.98"), ("python3.97", "never")):
        file = tmp_path / name
        file.write_text(SHIM.format(version=version, python=sys.executable))
        file.chmod(file.stat().st_mode | stat.S_IXUSR)
    assert Path(chosen(tmp_path, "python3.99", "python3.97", "python3.98")).samefile(sys.executable)
    assert chosen(tmp_path, "python3.99", "python3.97") == ""


def collected(*options: str) -> list[str]:
    """Names of the tests of this file that pytest takes."""
    command = [sys.executable, "-m", "pytest", "-q", "-n", "0", "--collect-only", *options, __file__]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return [line for line in run.stdout.splitlines() if "::" in line]


def test_both_halves_of_the_tests_together_are_all():
    even, odd = collected("--half", "even"), collected("--half", "odd")
    assert abs(len(even) - len(odd)) <= 1
    assert sorted(even + odd) == sorted(collected())


def test_ci_runs_both_halves_of_the_tests():
    run = (CI / "run").read_text(encoding="utf-8")
    assert re.findall(r"^ *timed everyday_tests \S+ \S+ (\w+)", run, re.M) == ["even", "odd"]
