"""The checksum by which compiled code and cached solutions of changed sources are recognized."""

import importlib
import sys
from pathlib import Path

import pytest

from fem.support.cache import imported, source_stamp

TEXTS = {
    "solver/entry.py": "from a_package.law import force\nfrom a_package.law.force import gain\n",
    "law/force.py": "import a_package.numbers\ngain = a_package.numbers.FACTOR\n",
    "numbers.py": "FACTOR = 2.0\n",
    "beside.py": "UNUSED = 1.0\n",
}


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Folder of a package; `stamp()` imports it anew."""
    for name, text in TEXTS.items():
        file = tmp_path / "a_package" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    yield tmp_path / "a_package"
    for module in [module for module in sys.modules if module.split(".")[0] == "a_package"]:
        del sys.modules[module]


def stamp() -> int:
    importlib.import_module("a_package.beside")
    return source_stamp(importlib.import_module("a_package.solver.entry").__name__)


@pytest.mark.parametrize("name", ["solver/entry.py", "law/force.py", "numbers.py"])
def test_the_checksum_changes_with_every_imported_source(package: Path, name):
    before = stamp()
    assert stamp() == before
    file = package / name
    file.write_text(file.read_text() + "# changed\n")
    assert stamp() != before


def test_the_checksum_does_not_change_with_sources_that_are_not_imported(package: Path):
    before = stamp()
    (package / "beside.py").write_text("UNUSED = 2.0\n")
    assert stamp() == before


def test_imports_of_all_forms_are_seen():
    source = b'''"""A text with a definition:

def nothing(): import numpy
"""
import a.b as c, d
from e import (
    f,  # from g import h
    i as j,
)
if True:
    from k.m import *


def function():
    return 1
'''
    assert set(imported(source)) >= {"a.b", "d", "e", "e.f", "e.i", "k.m"}
    assert not {"g", "c", "j"} & set(imported(source))
