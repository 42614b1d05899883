"""Progress is shown on request: bars that move by the costs of the steps, in a log lines."""

import re
from functools import partial
from time import sleep

import pytest
from paper_gears import paper_pair
from tqdm import tqdm

import fem
from fem.support import progress


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    monkeypatch.setattr(progress, "on_terminal", lambda: True)
    monkeypatch.setattr(progress, "DELAY", 1e-9)
    monkeypatch.setattr(progress, "TICK", 1e-3)
    monkeypatch.setattr(progress, "tqdm", partial(tqdm, mininterval=0))


def test_a_bar_moves_by_costs(capsys):
    with progress.shown(True):
        for _ in progress.bar("abc", "work", [1, 3, 4]):
            sleep(0.2)
    output = capsys.readouterr().err
    assert "work:  12%" in output and "work:  50%" in output


def test_no_bar_without_request_even_after_a_failure(capsys):
    with pytest.raises(RuntimeError), progress.shown(True):
        raise RuntimeError
    list(progress.bar("ab", "work", [1, 3]))
    assert capsys.readouterr().err == ""


def test_choosing_an_accuracy_shows_its_stages(monkeypatch, tmp_path, capsys):
    """From gear data, with an empty cache: finite elements, errors of the meshes that are tried, the map itself."""
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path))
    fem.static_transmission_error(paper_pair(), [0, 20, 50, 150], 60, accuracy=0.01)
    output = capsys.readouterr().err
    for what in ("compliance of the gear of 57 teeth", "finite elements", "estimating errors", "transmission error"):
        assert what in output
    assert "transmission error: 240 states: " in output


def test_long_work_is_announced_while_it_lasts(capsys):
    with progress.shown(True), progress.announced("factorizing", before=61.0):
        sleep(0.1)
    with progress.announced("compiling", once=True):
        sleep(0.1)
    output = capsys.readouterr().err
    assert "factorizing: 01:01" in output and "compiling, once after an installation: 00:00" in output


def test_short_work_is_not_announced_nor_is_any_without_request(monkeypatch, capsys):
    with progress.shown(False), progress.announced("compiling", once=True):
        sleep(0.1)
    with progress.announced("factorizing"):
        sleep(0.1)
    monkeypatch.setattr(progress, "DELAY", 10.0)
    with progress.shown(True), progress.announced("factorizing"):
        sleep(0.1)
    assert capsys.readouterr().err == ""


def test_a_map_without_progress_is_silent(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path))
    quick = fem.Slices()
    fem.static_transmission_error(paper_pair(), [50], 4, resolution=quick, progress=False)
    assert capsys.readouterr().err == ""


def test_a_log_has_lines_instead_of_bars(monkeypatch, capsys):
    """At the begin, now and then, and at the end; after an error too."""
    monkeypatch.setattr(progress, "on_terminal", lambda: False)
    monkeypatch.setattr(progress, "LINES", (0.1, 0.3))
    with progress.shown(True):
        for _ in progress.bar("abcd", "work"):
            sleep(0.1)
        with pytest.raises(RuntimeError), progress.announced("factorizing", before=61.0):
            sleep(0.05)
            raise RuntimeError
    output = capsys.readouterr().err
    assert "\r" not in output
    lines = output.splitlines()
    assert [lines[0], *lines[-3:]] == [
        "work: begun",
        "work: done after 00:00",
        "factorizing: begun",
        "factorizing: ended early after 01:01",
    ]
    assert any(re.fullmatch(r"work: (25|50|75)%, 00:00 left, after 00:00", line) for line in lines[1:-3])


def test_a_log_is_silent_without_request_and_for_short_work(monkeypatch, capsys):
    monkeypatch.setattr(progress, "on_terminal", lambda: False)
    with progress.shown(False):
        list(progress.bar("abcd", "work"))
    monkeypatch.setattr(progress, "DELAY", 1.0)
    with progress.shown(True):
        list(progress.bar("abcd", "work"))
    assert capsys.readouterr().err == ""
