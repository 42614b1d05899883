"""Every other case of the parametrized tests, for runs of the same tests on further versions of what exugear needs."""

from collections import Counter
from collections.abc import Hashable, Sequence
from itertools import compress

import pytest

#: Number of the first case of a half.
FIRST = {"even": 0, "odd": 1}


def taken(functions: Sequence[Hashable], first: int) -> list[bool]:
    """Whether a run takes each of n cases, told by their functions: every other one from the first, 0 or 1, on.

    The only case of a function is always taken, so that each function runs in both halves, and each case in one.
    """
    total, number, chosen = Counter(functions), Counter[Hashable](), []
    for function in functions:
        chosen.append(total[function] == 1 or number[function] % 2 == first)
        number[function] += 1
    return chosen


def pytest_addoption(parser: pytest.Parser) -> None:
    text = "of each parametrized test every other case only; both halves together are all cases"
    parser.addoption("--cases", choices=tuple(FIRST), help=text)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the other half, after marks have left out theirs."""
    half = config.getoption("cases")
    if half:
        chosen = taken([item.nodeid.partition("[")[0] for item in items], FIRST[half])
        config.hook.pytest_deselected(
            items=[item for item, is_taken in zip(items, chosen, strict=True) if not is_taken]
        )
        items[:] = compress(items, chosen)
