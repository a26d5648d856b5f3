"""What is returned about a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from ._model import Model

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Equations:
    """M du/dt = f + J^T lambda with J du/dt = -gamma; lambda are the closure forces. The torques of motors at driven joints
    come on the right-hand side, too (:meth:`Model.motor_torques`). A leading axis is that of the states, if there were
    several."""

    mass: Array
    """M (NU, NU), kg m^2; of free bodies kg m and kg, too."""
    forcing: Array
    """f (NU), N m; of free bodies N, too."""
    jacobian: Array
    """J (C, NU)."""
    gamma: Array
    """gamma (C)."""


@dataclass(frozen=True)
class Jacobian:
    """Derivatives of a = du/dt, valid along directions in which the loops stay closed. Of redundant loops, other directions mean
    nothing. A leading axis is that of the states, if there were several."""

    acceleration: Array
    """a (NU), rad/s^2; of free bodies m/s^2, too."""
    dq: Array
    """da/dq (NU, NU), 1/s^2."""
    du: Array
    """da/du (NU, NU), 1/s."""
    dt: Array
    """da/dt (NU), rad/s^3."""
    dinputs: Array
    """da/di (NU, inputs): rad/s^2 per unit of each input, SI. Prescribed angles that depend on an input are kept."""


@dataclass(frozen=True)
class Control:
    """What controllers do when they sample. A leading axis is that of the states, if there were several."""

    commands: Array
    """The inputs :attr:`Model.commanded` (K), SI. Of an input that is switched (``pwm``), its mean."""
    memory: Array
    """What they remember then, in the order of :attr:`Model.memory`."""


@dataclass(frozen=True)
class Equilibrium:
    """A state of rest."""

    q: Array
    """q (NQ)."""
    stable: bool
    """Whether it is both statically and dynamically stable."""
    statically_stable: bool
    """Whether every small displacement is opposed."""
    dynamically_stable: bool
    """Whether no small motion grows."""
    neutral: bool
    """Whether some small displacements are not opposed and none grows: a robot that stands on the ground can be pushed along
    it."""
    force: float
    """The largest remaining generalised force along the closure, N m; a force on a free body counts with the mechanism's
    size as its arm."""
    potential_energy: float
    """J."""
    iterations: int
    """Steps that were taken."""


@dataclass(frozen=True)
class Modes:
    """Small motions about a state of rest: dx/dt = A x + B i with x = (z, dz/dt) and q = q0 + T z;
    of free bodies, T z are steps along their speeds.

    z are the d directions in which the loops let the joints move there: as many as the mobility, more in a singular state,
    fewer where joints are driven. T is scaled so that the mass matrix of z is the identity.
    """

    equilibrium: Equilibrium
    """The state of rest."""
    frequency: Array
    """Undamped frequencies (modes), Hz, ascending."""
    damping_ratio: Array
    """Damping ratios (modes)."""
    eigenvalue: NDArray[np.complex128]
    """Eigenvalues of A (modes), 1/s; of a pair the upper one."""
    shape: NDArray[np.complex128]
    """The part of each speed in each mode (modes, NU), the largest made 1."""
    a: Array
    """A (2 d, 2 d)."""
    b: Array
    """B (2 d, inputs)."""
    basis: Array
    """T (NU, d)."""
    neutral_directions: Array
    """Directions in which no force opposes a displacement (directions, NU)."""


@dataclass(frozen=True)
class Fit:
    """Parameters that were identified from a measured motion."""

    model: Model
    """The model with these parameters."""
    parameters: dict[str, float]
    """The identified parameters, SI."""
    standard_error: dict[str, float]
    """Their standard errors, SI."""
    correlation: Array
    """Correlations of the estimates, in the order of ``parameters``."""
    rms: float
    """Root mean square of the residuals, rad; displacements of free bodies are divided by the size of the mechanism."""
    q: Array
    """The fitted motion at the measured times (S, NQ)."""
    kept: list[str]
    """Speeds of free bodies that started as the model says, like their coordinates, because those were not measured."""
