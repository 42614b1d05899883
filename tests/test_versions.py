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
from halved_cases import taken

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


def test_both_halves_of_the_cases_together_are_all_and_hold_each_function():
    functions = ["one", "two", "two", "many", "many", "many", "two"]
    even, odd = taken(functions, 0), taken(functions, 1)
    assert all(in_even or in_odd for in_even, in_odd in zip(even, odd, strict=True))
    for half in (even, odd):
        assert {name for name, is_taken in zip(functions, half, strict=True) if is_taken} == set(functions)
    assert sum(even) + sum(odd) == len(functions) + 1


def test_ci_runs_both_halves_of_the_cases():
    run = (CI / "run").read_text(encoding="utf-8")
    assert re.findall(r"^ *timed everyday_tests \S+ \S+ (\w+)", run, re.M) == ["even", "odd"]
