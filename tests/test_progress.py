"""Bars with the time left: where they are wanted, and by what they move."""

from time import sleep

import pytest
from conftest import paper_pair

import fem
from fem import progress
from fem.progress import bar, shown


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    monkeypatch.setattr(progress, "DELAY", 1e-9)


def test_a_bar_moves_by_costs(capsys):
    with shown(True):
        for _ in bar("abc", "work", [1, 3, 4]):
            sleep(0.2)
    told = capsys.readouterr().err
    assert "work:  12%" in told and "work:  50%" in told


def test_no_bar_where_none_is_wanted_even_after_a_failure(capsys):
    with pytest.raises(RuntimeError), shown(True):
        raise RuntimeError
    list(bar("ab", "work", [1, 3]))
    assert capsys.readouterr().err == ""


def test_choosing_an_accuracy_shows_what_takes_long(monkeypatch, tmp_path, capsys):
    """From gear data on, cold: finite elements, errors of the meshes that are tried, and the map itself."""
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path))
    fem.static_transmission_error(paper_pair(), [0, 20, 50, 150], 60, accuracy=0.01)
    told = capsys.readouterr().err
    for what in ("finite elements", "estimating errors", "transmission error"):
        assert f"{what}: " in told
