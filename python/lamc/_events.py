"""Events: times at which a function of the state changes its sign."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._arguments import number, whole
from ._lamc import Error

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Event:
    """A function whose changes of sign are looked for in :meth:`Model.simulate`."""

    function: str | Callable[[float, Array, Array], Any]
    """A function of (t, q, u), or a formula such as ``"q.knee - 0.5"`` of t, ``q.<joint>``, ``u.<joint>``, parameters and
    inputs, SI and radians. Formulas need no GIL."""
    terminal: bool | int = False
    """Whether the motion ends there; or after how many changes it does."""
    direction: float = 0.0
    """Positive: changes from negative to positive count; negative: from positive to negative; 0: both."""


@dataclass(frozen=True)
class Crossings:
    """The C times at which the function of an event changed its sign, and the states just after."""

    t: Array
    """Times (C), s."""
    q: Array
    """Angles (C, N), rad."""
    u: Array
    """Speeds (C, N), rad/s."""

    def __len__(self) -> int:
        return len(self.t)


EventLike = str | Callable[[float, Array, Array], Any] | Event


def requests(events: EventLike | Iterable[EventLike] | None) -> list[dict[str, Any]]:
    """Events as the native half takes them."""
    if events is None:
        return []
    if isinstance(events, (str, Event)) or callable(events):
        return [_request(events)]
    try:
        return [_request(event) for event in events]
    except TypeError:
        raise Error(f"`events` must be functions, formulas or lamc.Event, not {events!r}") from None


def _request(event: EventLike) -> dict[str, Any]:
    if isinstance(event, str):
        event = Event(event)
    elif not isinstance(event, Event):
        # As functions say it to SciPy.
        event = Event(event, getattr(event, "terminal", False), getattr(event, "direction", 0.0))
    function = event.function
    if not isinstance(function, str):
        if not callable(function):
            raise Error(f"an event must be a function of (t, q, u) or a formula, not {function!r}")
        function = _evaluated(function)
    return {
        "function": function,
        "terminal": whole("terminal", event.terminal),
        "direction": number("direction", event.direction),
    }


def _evaluated(function: Callable[[float, Array, Array], Any]) -> Callable[[float, Array, Array], float]:
    def call(t: float, q: Array, u: Array) -> float:
        return number("an event", function(t, q, u))

    return call
