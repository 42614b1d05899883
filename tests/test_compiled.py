"""Compiled functions on disk: found again as they are, and forgotten with all that they call."""

import importlib.util
import sys
from pathlib import Path

import numba

import fem.compiled
import fem.progress

SOURCE = """
from helper import doubled
from fem.compiled import kept

@kept
def entry(x):
    return doubled(x) + 1.0
"""
HELPER = """
from fem.compiled import compiled

@compiled
def doubled(x):
    return {factor} * x
"""


def entry_in(folder: Path, monkeypatch):
    """The module's function as a new process would import it, with its helper."""
    fem.compiled.stamp.cache_clear()
    for name in ("helper", "module"):
        spec = importlib.util.spec_from_file_location(name, folder / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, name, module)
        spec.loader.exec_module(module)
    return module.entry


def test_compiling_is_announced_as_long_as_all_of_it_takes(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    monkeypatch.setattr(fem.progress, "DELAY", 1e-9)
    monkeypatch.setattr(fem.progress, "TICK", 1e-3)
    (tmp_path / "module.py").write_text(SOURCE)
    (tmp_path / "helper.py").write_text(HELPER.format(factor=2.0))
    for told in (True, False):
        entry_in(tmp_path, monkeypatch)(1.0)
        assert ("compiling the contact, once after an installation: 0" in capsys.readouterr().err) == told
    (tmp_path / "helper.py").write_text(HELPER.format(factor=3.0))
    with fem.progress.shown(False):
        entry_in(tmp_path, monkeypatch)(1.0)
    assert capsys.readouterr().err == ""


def test_kept_functions_are_compiled_anew_when_one_that_they_call_changes(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    (tmp_path / "module.py").write_text(SOURCE)
    results = []
    for factor in (2.0, 2.0, 3.0):
        (tmp_path / "helper.py").write_text(HELPER.format(factor=factor))
        entry = entry_in(tmp_path, monkeypatch)
        results.append((entry(1.0), sum(entry.stats.cache_hits.values())))
    assert results == [(3.0, 0), (3.0, 1), (4.0, 0)]


def test_nothing_is_kept_where_numbas_cache_has_other_names(tmp_path, monkeypatch):
    """Compiled in every process: slow, never out of date."""
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    monkeypatch.setattr(fem.compiled, "njit", lambda function, cache=False: numba.njit(function))
    (tmp_path / "module.py").write_text(SOURCE)
    for factor in (2.0, 3.0):
        (tmp_path / "helper.py").write_text(HELPER.format(factor=factor))
        entry = entry_in(tmp_path, monkeypatch)
        assert entry(1.0) == factor + 1.0
        assert not entry.stats.cache_hits
    assert {path.name for path in tmp_path.iterdir()} == {"module.py", "helper.py"}
