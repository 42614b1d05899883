"""Every other test, for runs of the tests on further versions of what exugear needs."""

import pytest

#: Number of the first test of a half.
FIRST = {"even": 0, "odd": 1}


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--half", choices=tuple(FIRST), help="every other test only; both halves together are all tests")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the other half, after marks have left out theirs."""
    half = config.getoption("half")
    if half:
        first = FIRST[half]
        config.hook.pytest_deselected(items=items[1 - first :: 2])
        items[:] = items[first::2]
