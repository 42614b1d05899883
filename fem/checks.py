"""Checks of input: ValueError with argument, value and remedy."""


def require(condition: bool, message: str) -> None:
    """Raise ValueError(message) unless condition holds; NaN never holds."""
    if not condition:
        raise ValueError(message)


def require_within(name: str, value: float, low: float, high: float, *, unit: float = 1.0, remedy: str) -> None:
    """Require low < value < high; bounds and value are shown in multiples of unit."""
    low_, high_, value_ = low / unit, high / unit, value / unit
    require(low < value < high, f"{name} must lie in ({low_:g}, {high_:g}) {remedy}, got {value_:g}")
