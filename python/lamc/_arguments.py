"""Arguments of users: numbers, or a :class:`lamc.Error` that says what they are not."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._lamc import Error


def numbers(name: str, values: Any) -> NDArray[np.float64]:
    """Returns an argument as an array."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError, OverflowError) as mistake:
        raise Error(f"`{name}` must be numbers: {mistake}") from None


def number(name: str, value: Any) -> float:
    """Returns an argument that is one number."""
    found = numbers(name, value)
    if found.size != 1:
        raise Error(f"`{name}` must be one number, not {found.size}")
    return found.item()


def positive(name: str, value: Any) -> float:
    """Returns an argument that is a positive number."""
    found = number(name, value)
    if not (np.isfinite(found) and found > 0):
        raise Error(f"`{name}` must be a positive number, not {found:g}")
    return found


def whole(name: str, value: Any, least: int = 0) -> int:
    """Returns an argument that is a whole number of at most 63 bits."""
    try:
        found = operator.index(int(value) if isinstance(value, float) and value.is_integer() else value)
    except TypeError:
        found = least - 1
    if not least <= found < 2**63:
        raise Error(f"`{name}` must be a whole number from {least} on, not {value!r}")
    return found


def names(values: Any) -> list[str]:
    """Returns names; a text is one name."""
    if isinstance(values, str):
        return [values]
    try:
        return [str(name) for name in values]
    except TypeError:
        raise Error(f"names are expected, not {values!r}") from None


def count(number: int, noun: str) -> str:
    """Returns such as "1 loop" or "2 loops"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
