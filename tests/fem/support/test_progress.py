"""Bars with the time left: where they are wanted, and by what they move."""

from functools import partial
from time import sleep

import pytest
from paper_gears import paper_pair
from tqdm import tqdm

import fem
from fem.support import progress
from fem.support.progress import announced, bar, shown


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    monkeypatch.setattr(progress, "DELAY", 1e-9)
    monkeypatch.setattr(progress, "TICK", 1e-3)
    monkeypatch.setattr(progress, "tqdm", partial(tqdm, mininterval=0))


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
    for what in ("compliance of the gear of 57 teeth", "finite elements", "estimating errors", "transmission error"):
        assert f"{what}" in told
    assert "transmission error: 240 states: " in told


def test_what_takes_long_is_announced_while_it_lasts(capsys):
    with shown(True), announced("factorizing", before=61.0):
        sleep(0.1)
    with announced("compiling", once=True):
        sleep(0.1)
    told = capsys.readouterr().err
    assert "factorizing: 01:01" in told and "compiling, once after an installation: 00:00" in told


def test_short_work_and_unwanted_words_are_left_out(monkeypatch, capsys):
    with shown(False), announced("compiling", once=True):
        sleep(0.1)
    with announced("factorizing"):
        sleep(0.1)
    monkeypatch.setattr(progress, "DELAY", 10.0)
    with shown(True), announced("factorizing"):
        sleep(0.1)
    assert capsys.readouterr().err == ""


def test_a_map_without_progress_is_silent(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path))
    quick = fem.Slices()
    fem.static_transmission_error(paper_pair(), [50], 4, resolution=quick, progress=False)
    assert capsys.readouterr().err == ""
