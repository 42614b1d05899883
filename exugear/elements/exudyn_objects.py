"""Objects of an Exudyn system by their numbers."""

from typing import Any, SupportsIndex

from fem.support.validation import require


def object_of(mbs, name: str, item: SupportsIndex, **options) -> dict[str, Any]:
    """What Exudyn knows of an object; ValueError, with the argument's name, for a number that it never gave."""
    known = mbs.systemData.NumberOfObjects()
    is_number = isinstance(item, SupportsIndex) and 0 <= int(item) < known
    require(is_number, f"{name} must be numbers of objects below {known}, as Exudyn gave them, got {str(item)[:80]}")
    return mbs.GetObject(item, **options)
