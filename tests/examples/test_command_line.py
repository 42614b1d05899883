"""The command lines of the examples: options that each knows, and a folder that may be left out."""

import inspect
import runpy
import sys
from argparse import ArgumentParser
from pathlib import Path

import pytest

EXAMPLES = sorted(Path(__file__).parents[2].joinpath("examples").glob("*.py"))
RUN = [path.stem for path in EXAMPLES if "command_line(__doc__" in path.read_text(encoding="utf-8")]


class Parsed(Exception):
    """The command line is read; the example need not compute."""


@pytest.fixture
def arguments_of(monkeypatch):
    """Function (name of an example, *arguments) -> what the example makes of its command line."""
    parse = ArgumentParser.parse_args

    def parse_only(parser):
        raise Parsed(vars(parse(parser)))

    def arguments_of(name: str, *arguments: str) -> dict:
        path = EXAMPLES[0].parent / f"{name}.py"
        monkeypatch.setattr(sys, "argv", [str(path), *arguments])
        monkeypatch.setattr(ArgumentParser, "parse_args", parse_only)
        with pytest.raises(Parsed) as parsed:
            runpy.run_path(str(path), run_name="__main__")
        return parsed.value.args[0]

    return arguments_of


@pytest.mark.parametrize("name", RUN)
def test_an_example_writes_to_a_folder_and_takes_the_options_of_its_main(name, arguments_of):
    given = arguments_of(name)
    assert given.pop("folder") == Path("results") and not any(given.values())
    assert arguments_of(name, "here")["folder"] == Path("here")
    main = runpy.run_path(str(EXAMPLES[0].parent / f"{name}.py")).get("main")
    assert not main or set(given) <= set(inspect.signature(main).parameters)


def test_a_misspelled_option_is_refused_instead_of_taken_for_the_folder(arguments_of, capsys):
    with pytest.raises(SystemExit):
        arguments_of("tip_relief", "--quik")
    assert "unrecognized arguments: --quik" in capsys.readouterr().err
    assert arguments_of("tip_relief", "--quick")["quick"]
