"""Motions with derivatives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _lamc
from ._arguments import numbers

if TYPE_CHECKING:
    from ._model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gradient:
    """The derivatives of a number that depends on a motion."""

    parameters: dict[str, float]
    """By each parameter, per its unit in SI."""
    q: Array
    """By the initial coordinates (NQ) that were asked for, 1/rad: loops close again as they change."""
    u: Array
    """By the initial speeds (NU) that were asked for."""
    inputs: Array
    """By the inputs (S, inputs) that are held from each sample to the next; the last row is zero. Their sum over the samples is the
    derivative by a constant input."""


class Course:
    """A motion with fixed steps, S samples of N joints, that can be differentiated by everything at once."""

    def __init__(self, native: _lamc.Course, model: Model) -> None:
        self._native = native
        self.model = model
        """The model that moved."""
        t, q, u, points = native.samples()
        samples = len(t)
        self.t: Array = t
        """Times of the samples (S), s."""
        self.q: Array = q.reshape(samples, -1)
        """Coordinates (S, NQ)."""
        self.u: Array = u.reshape(samples, -1)
        """Speeds (S, NU)."""
        self.points: Array = points.reshape(samples, -1, 3)
        """Positions of the named points (S, points, 3), m."""

    def gradient(
        self,
        q: ArrayLike | None = None,
        u: ArrayLike | None = None,
        points: ArrayLike | None = None,
        energy: ArrayLike | None = None,
    ) -> Gradient:
        """Returns the derivatives of a number L by all parameters, the initial state and the inputs.

        One pass back over the motion computes all of them; it takes one or two times as long as the motion. They are exact to
        rounding for the steps that were taken.

        Args:
            q: dL/dq at each sample (S, NQ).
            u: dL/du at each sample (S, NU).
            points: dL/d(points) at each sample (S, points, 3).
            energy: dL/d(kinetic, potential) at each sample (S, 2).
        """
        samples = len(self.t)
        states = None
        if q is not None or u is not None:
            parts = [
                np.zeros(like.shape) if given is None else self._checked(name, given, like.shape)
                for name, given, like in (("q", q, self.q), ("u", u, self.u))
            ]
            states = np.ascontiguousarray(np.concatenate(parts, axis=1))
        by_points = None if points is None else self._checked("points", points, self.points.shape)
        by_energy = None if energy is None else self._checked("energy", energy, (samples, 2))
        found = self._native.gradient(
            states,
            None if by_points is None else np.ascontiguousarray(by_points.reshape(samples, -1)),
            by_energy,
        )
        inputs = np.zeros((samples, len(self.model.inputs)))
        inputs[:-1] = found["inputs"].reshape(samples - 1, -1) if inputs.size else inputs[:-1]
        return Gradient(
            dict(zip(self.model.parameters, found["parameters"].tolist())),
            found["q"],
            found["u"],
            inputs,
        )

    @staticmethod
    def _checked(name: str, values: ArrayLike, shape: tuple[int, ...]) -> Array:
        given = numbers(name, values)
        if given.shape != shape:
            raise _lamc.Error(f"`{name}` has the shape {given.shape}, not {shape}")
        return np.ascontiguousarray(given)

    def __repr__(self) -> str:
        return f"<Course of {self.model.name!r}: {len(self.t)} samples, {self.t[-1]:g} s>"
