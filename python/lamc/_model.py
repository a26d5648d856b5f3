"""Models."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _command, _lamc
from ._arguments import count, names, number, numbers, positive, whole
from ._course import Course
from ._events import EventLike, requests
from ._motion import Motion, SimulationError, frame
from ._results import Control, Equations, Equilibrium, Fit, Jacobian, Modes

Array = NDArray[np.float64]
Controller = Callable[[float, Array, Array], "Sequence[float] | Mapping[str, float] | Array | float"]


def load(
    source: str | os.PathLike[str] | Mapping[str, Any],
    *,
    inputs: Mapping[str, str] | None = None,
    lock: Mapping[str, float] | None = None,
    cache: bool = True,
) -> Model:
    """Loads a model.

    The equations are derived in a process of their own, by the command ``lamc`` of this package. The second
    time they come from the cache on disk.

    Args:
        source: The path of a model (lamc's YAML or a popupCAD file), its text (with at least one line break), or
            the same as a dictionary. Drawings of a text or a dictionary are looked for in the current folder.
        inputs: Inputs to replace by formulas of t and the parameters, such as ``{"motor": "0.002*sin(20*t)"}``. What
            :attr:`Motion.inputs` says of them has no meaning.
        lock: Joints to hold at an angle, rad.
        cache: Whether the cache on disk may be used.

    Raises:
        Error: The model has errors; the text shows them with lines and carets.
    """
    if isinstance(source, Mapping):
        # JSON is YAML.
        try:
            text: str | None = json.dumps(source, indent=2, default=plain)
        except (TypeError, ValueError) as mistake:
            raise _lamc.Error(f"the dictionary is no model: {mistake}") from None
        path = "-"
    elif isinstance(source, str) and "\n" in source:
        text, path = source, "-"
    elif isinstance(source, str | os.PathLike):
        text, path = None, os.fspath(source)
    else:
        raise _lamc.Error(f"a model is a path, a text or a dictionary, not {source!r}")
    options = [f"--input={name}={formula}" for name, formula in (inputs or {}).items()]
    options += [f"--lock={joint}={number(joint, angle)!r}rad" for joint, angle in (lock or {}).items()]
    if not cache:
        options.append("--no-cache")
    derived, report = _command.run_with_report(["derive", path, "--output=-", *options], text)
    if report:
        warnings.warn(report, stacklevel=2)
    return Model(_lamc.Program(derived), {}, frozenset(inputs or ()))


class Model:
    """A compiled mechanism of N joints. It does not change, may be used from several threads at once, and can be
    pickled: whoever unpickles it needs neither the file nor the symbolic engine.

    States are arrays: q of one state is (NQ) and u (NU), of several (S, NQ) and (S, NU); results have the same leading axis.
    Without free bodies, NQ and NU are N, and q and u are angles, rad, and speeds, rad/s. Each free body adds to q
    the displacement of its centre of mass from where it is drawn, m, and its orientation, a unit quaternion w x y z; and to u the
    velocity of that centre in the base frame, m/s, and its angular velocity in its own frame, rad/s. Derivatives by q
    have a column for each speed: the body moves or turns as that speed would move it. ``t`` and ``inputs`` may be given once or for each
    state. Loops are closed by :meth:`assemble`.
    """

    def __init__(
        self, native: _lamc.Program, changed: Mapping[str, float], formulas: frozenset[str]
    ) -> None:
        self._native = native
        self._changed = dict(changed)
        self._formulas = formulas
        about = native.description()
        self.name: str = about["name"]
        """The model's name."""
        self.joints: list[str] = about["joints"]
        """Joints, in the order of q and u."""
        self.free_bodies: list[str] = about["free_bodies"]
        """Free bodies: q and u go on with theirs."""
        self.coordinates: list[str] = about["coordinates"]
        """The names of q (NQ): joints, then ``body.x``, ``.y``, ``.z``, ``.qw``, ``.qx``, ``.qy``, ``.qz`` of free bodies."""
        self.speeds: list[str] = about["speeds"]
        """The names of u (NU): joints, then ``body.vx``, ``.vy``, ``.vz``, ``.wx``, ``.wy``, ``.wz`` of free bodies."""
        self.joint_bodies: list[tuple[str, str]] = [(first, second) for first, second in about["joint_bodies"]]
        """The first and the second body of each joint."""
        self.hinge_origins: Array = np.array(about["hinge_origins"], dtype=float).reshape(-1, 3)
        """The first point of each hinge line (N, 3) in the flat sheet, m."""
        self.hinge_axes: Array = np.array(about["hinge_axes"], dtype=float).reshape(-1, 3)
        """The direction of each hinge line (N, 3) in the flat sheet, a unit vector: at a positive angle the second body is
        turned about it, relative to the first, by the right hand. On a body with the pose R, p
        (:meth:`poses`) the line passes through R origin + p along R axis."""
        self.bodies: list[str] = about["bodies"]
        """Bodies."""
        self.points: list[str] = about["points"]
        """Named points."""
        self.contact_points: list[str] = about["contacts"]
        """Contact points: the contact, then the point or the body and its corner."""
        self.inputs: list[str] = about["inputs"]
        """Inputs, in the order of input arrays."""
        self.commanded: list[str] = about["commanded"]
        """The inputs that controllers drive."""
        self.memory: dict[str, float] = dict(about["memory"])
        """What controllers remember, ``controller.name``, with the first values."""
        self.parameters: dict[str, float] = about["parameters"]
        """Parameters with their values, SI."""
        self.loops: list[str] = about["loops"]
        """For each loop its class, equations and rank."""
        self.mobility: int = about["mobility"]
        """Degrees of freedom."""
        self.limits: Array = np.array(about["limits"], dtype=float).reshape(-1, 2)
        """Allowed angles (N, 2), rad."""
        self.driven: list[str] = [n for n, driven in zip(self.joints, about["driven"]) if driven]
        """Joints that follow a prescribed angle."""
        self.size: float = about["size"]
        """Diagonal of the flat bounding box, m."""
        self._no_inputs = np.zeros((1, len(self.inputs)))
        self._rows: int = about["rows"]
        self._initial = about["initial_q"], about["initial_u"], about["pinned"]

    # -- parameters ---------------------------------------------------------------------------------------------

    def with_(self, **parameters: float) -> Model:
        """Returns the model with other values of some parameters, SI. Nothing is derived or compiled anew.

        Raises:
            Error: There is no such parameter, or the value is impossible.
        """
        values = {name: number(name, value) for name, value in parameters.items()}
        native, found = self._native.with_parameters(values)
        self._warn(found)
        return Model(native, {**self._changed, **values}, self._formulas)

    # -- report --------------------------------------------------------------------------------------------------

    def check(self) -> str:
        """Returns the report of ``lamc check``: mobility and loops, the method that was chosen for the acceleration, masses
        of the bodies, linear ranges of hinges, the longest stable step at rest, and operations. It is about the model as it
        was loaded, without the changes of :meth:`with_`."""
        report, found = self._native.check()
        self._warn(found)
        return report

    # -- what follows from states -------------------------------------------------------------------------------

    def acceleration(
        self, q: ArrayLike, u: ArrayLike | None = None, t: ArrayLike = 0.0, inputs: Any = None
    ) -> Array:
        """Returns du/dt (NU), rad/s^2.

        Next to a singular state, such as the flat one, the smallest opening of the loops changes it much; there it is that of
        the nearest closed state.

        Args:
            q: Coordinates (NQ).
            u: Speeds (NU). By default 0.
            t: Time, s.
            inputs: Inputs by name or as an array (inputs), SI. By default 0.
        """
        states, several = self._states(q, u, t, inputs)
        [rates] = self._native.acceleration(states)
        return _shaped(rates, states, several, len(self.speeds))

    def reactions(
        self, q: ArrayLike, u: ArrayLike | None = None, t: ArrayLike = 0.0, inputs: Any = None
    ) -> Array:
        """Returns what the first body of each joint exerts on the second (N, 6): the force, N, and the moment about the first
        point of the hinge line, N m, in a frame fixed to the second body: x along the hinge line, z normal to the flat
        sheet."""
        states, several = self._states(q, u, t, inputs)
        _, _, reactions = self._native.reactions(states)
        return _shaped(reactions, states, several, len(self.joints), 6)

    def motor_torques(
        self, q: ArrayLike, u: ArrayLike | None = None, t: ArrayLike = 0.0, inputs: Any = None
    ) -> Array:
        """Returns the torques that hold driven joints to their angles (driven), N m, in the order of :attr:`driven`."""
        states, several = self._states(q, u, t, inputs)
        _, forces, _ = self._native.reactions(states)
        forces = _shaped(forces, states, several, self._rows + len(self.driven))
        return forces[..., self._rows :]

    def equations(
        self, q: ArrayLike, u: ArrayLike | None = None, t: ArrayLike = 0.0, inputs: Any = None
    ) -> Equations:
        """Returns the matrices of Kane's equations and of the closure."""
        states, several = self._states(q, u, t, inputs)
        mass, forcing, jacobian, gamma = self._native.equations(states)
        n, rows = len(self.speeds), self._rows
        return Equations(
            _shaped(mass, states, several, n, n),
            _shaped(forcing, states, several, n),
            _shaped(jacobian, states, several, rows, n),
            _shaped(gamma, states, several, rows),
        )

    def closure(self, q: ArrayLike) -> tuple[Array, Array]:
        """Returns by how much the loops are open, nine numbers for each loop, m, and the derivatives by q: (9 L) and
        (9 L, NU)."""
        states, several = self._states(q, None, 0.0, None)
        residual, jacobian = self._native.closure(states)
        rows = 9 * len(self.loops)
        return (
            _shaped(residual, states, several, rows),
            _shaped(jacobian, states, several, rows, len(self.speeds)),
        )

    def jacobian(
        self, q: ArrayLike, u: ArrayLike | None = None, t: ArrayLike = 0.0, inputs: Any = None
    ) -> Jacobian:
        """Returns du/dt with its derivatives by q, u, t and the inputs, along closed directions (:class:`Jacobian`)."""
        states, several = self._states(q, u, t, inputs)
        acceleration, dq, du, dt = self._native.jacobian(states)
        n, width = len(self.speeds), len(self.inputs)
        # After du/dt itself.
        [by_inputs] = self._native.by_inputs(states) if width else [acceleration]
        by_inputs = _shaped(by_inputs, states, several, width + 1, n)[..., 1:, :]
        return Jacobian(
            _shaped(acceleration, states, several, n),
            _shaped(dq, states, several, n, n),
            _shaped(du, states, several, n, n),
            _shaped(dt, states, several, n),
            np.swapaxes(by_inputs, -1, -2),
        )

    def energy(
        self, q: ArrayLike, u: ArrayLike | None = None, t: ArrayLike = 0.0, inputs: Any = None
    ) -> Array:
        """Returns kinetic and potential energy (2), J."""
        states, several = self._states(q, u, t, inputs)
        return _shaped(self._native.energy(states)[0], states, several, 2)

    def control(
        self, q: ArrayLike, u: ArrayLike | None = None, t: ArrayLike = 0.0, memory: ArrayLike | None = None
    ) -> Control:
        """Returns what the controllers of the model command when they sample in these states, as the function ``control`` of
        modules does. Delays and different rates are up to the caller; :meth:`simulate` takes care of them.

        Args:
            memory: What they remember, in the order of :attr:`memory`, once or for each state; the first values if left out.

        Raises:
            Error: The model has no controllers.
        """
        if not self.commanded:
            raise _lamc.Error(f"`{self.name}` has no controllers")
        states, several = self._states(q, u, t, None)
        kept = numbers("memory", list(self.memory.values()) if memory is None else memory)
        shape = (len(states[0]), len(self.memory))
        try:
            rows = np.ascontiguousarray(np.broadcast_to(kept, shape))
        except ValueError:
            raise _lamc.Error(f"`memory` has the shape {kept.shape}, not ({shape[1]},) or {shape}") from None
        commands, after = self._native.control(states, rows)
        return Control(
            _shaped(commands, states, several, len(self.commanded)),
            _shaped(after, states, several, len(self.memory)),
        )

    def momentum(self, q: ArrayLike, u: ArrayLike) -> Array:
        """Returns the centre of mass of all moving bodies, m, their linear momentum, kg m/s, and their angular momentum about
        that centre, kg m^2/s, in the base frame (3, 3): a row each.

        Raises:
            Error: The mechanism has no free body.
        """
        if not self.free_bodies:
            raise _lamc.Error("momenta are computed for mechanisms with a free body")
        states, several = self._states(q, u, 0.0, None)
        return _shaped(self._native.momentum(states)[0], states, several, 3, 3)

    def poses(self, q: ArrayLike) -> tuple[Array, Array]:
        """Returns rotation matrices (bodies, 3, 3) and translations (bodies, 3), m: a point drawn at x lies at
        R x + p."""
        states, several = self._states(q, None, 0.0, None)
        poses = _shaped(self._native.places(states)[0], states, several, len(self.bodies), 12)
        return poses[..., :9].reshape(*poses.shape[:-1], 3, 3), poses[..., 9:]

    def positions(self, q: ArrayLike) -> Array:
        """Returns where the named points are (points, 3), m."""
        states, several = self._states(q, None, 0.0, None)
        return _shaped(self._native.places(states)[1], states, several, len(self.points), 3)

    def contacts(
        self, q: ArrayLike, u: ArrayLike | None = None, t: ArrayLike = 0.0, inputs: Any = None
    ) -> Array:
        """Returns where each contact point is, m, and the force on its body, N, in the base frame (K, 6), in the
        order of :attr:`contact_points`."""
        states, several = self._states(q, u, t, inputs)
        [contacts] = self._native.contacts(states)
        return _shaped(contacts, states, several, len(self.contact_points), 6)

    def step(
        self,
        q: ArrayLike,
        u: ArrayLike,
        dt: float,
        t: ArrayLike = 0.0,
        inputs: Any = None,
        *,
        steps: int = 1,
    ) -> tuple[Array, Array]:
        """Returns (q, u) after steps of the classical Runge-Kutta method, each with a projection onto the loops.

        For many states in one call, as in learning. Joints do not stop at their limits, and a step that is too long
        for a stiff mechanism fails or gives a wrong motion; :meth:`simulate` chooses its steps.

        Args:
            q: Coordinates (NQ).
            u: Speeds (NU).
            dt: Length of a step, s.
            t: Time at the start, s.
            inputs: Inputs, held during all steps, SI.
            steps: Number of steps, at least 1.
        """
        count, length = whole("steps", steps, least=1), number("dt", dt)
        states, several = self._states(q, u, t, inputs)
        moved, speeds = self._native.step(states, length, count)
        return (
            _shaped(moved, states, several, len(self.coordinates)),
            _shaped(speeds, states, several, len(self.speeds)),
        )

    # -- closed states, rest, motion ----------------------------------------------------------------------------

    def assemble(
        self,
        guess: Mapping[str, float] | ArrayLike | None = None,
        u: ArrayLike | None = None,
        t: float = 0.0,
    ) -> tuple[Array, Array]:
        """Returns the closed state (q, u) nearest to a guess.

        Args:
            guess: Angles by joint, which are kept if the loops close that way, while the others start from the model's
                initial values; or all coordinates (NQ), of which none is kept. By default the model's initial state.
            u: Speeds (NU), made consistent with the loops. By default those of the model.
            t: Time, s: joints that are driven have their angles of then.

        Raises:
            Error: No closed state was found.
        """
        q, rates, found = self._closed(guess, u, number("t", t))
        # Whoever gives speeds asks for the consistent ones.
        if u is None:
            self._warn(found)
        return q, rates

    def _closed(
        self, guess: Mapping[str, float] | ArrayLike | None, u: ArrayLike | None, t: float = 0.0
    ) -> tuple[Array, Array, list[str]]:
        """As :meth:`assemble`, with the warnings."""
        q, speeds, pinned = (list(values) for values in self._initial)
        if isinstance(guess, Mapping):
            pinned = [False] * len(self.joints)
            for k, given in zip(self._indices(guess), guess.values()):
                name, (least, greatest) = self.joints[k], self.limits[k]
                angle = number(name, given)
                if name in self.driven:
                    raise _lamc.Error(f"`{name}` is driven: its angle is prescribed")
                if not least <= angle <= greatest:
                    raise _lamc.Error(
                        f"{angle} rad is outside the limits of `{name}`: {least} .. {greatest} rad"
                    )
                q[k], pinned[k] = angle, True
        elif guess is not None:
            q, pinned = self._vector("guess", guess, self.coordinates), [False] * len(self.joints)
        if u is not None:
            speeds = self._vector("u", u, self.speeds)
        return self._native.assemble(t, q, speeds, pinned, guess is None)

    def _warn(self, found: Sequence[str]) -> None:
        """Warns the caller of the method that calls this."""
        for warning in found:
            warnings.warn(warning, stacklevel=3)

    def equilibrium(
        self,
        guess: Mapping[str, float] | ArrayLike | None = None,
        inputs: Any = None,
        t: float = 0.0,
    ) -> Equilibrium:
        """Returns the state of rest that is reached from the closed state nearest to a guess (:meth:`assemble`), with
        torques and driven joints as they are at t, s.

        Raises:
            Error: None was found.
        """
        return self.modes(guess, inputs, t).equilibrium

    def modes(
        self,
        guess: Mapping[str, float] | ArrayLike | None = None,
        inputs: Any = None,
        t: float = 0.0,
    ) -> Modes:
        """Returns natural frequencies, damping and mode shapes about the equilibrium at t, s, and the linear system.

        Raises:
            Error: There is no equilibrium.
        """
        time, held = number("t", t), self._held(inputs)
        if held.ndim != 1:
            raise _lamc.Error(f"`inputs` has the shape {held.shape}, not ({len(self.inputs)},)")
        q, _, moved = self._closed(guess, None, time)
        found = self._native.rest(time, list(q), list(held))
        self._warn([*moved, *found["warnings"]])
        n, modes = len(self.speeds), found["modes"]
        rest = Equilibrium(
            **{
                key: found[key]
                for key in (
                    "q",
                    "stable",
                    "statically_stable",
                    "dynamically_stable",
                    "neutral",
                    "force",
                    "potential_energy",
                    "iterations",
                )
            }
        )
        shapes = np.array([shape for *_, shape in modes], dtype=float).reshape(len(modes), n, 2)
        values = np.array([value for value, *_ in modes], dtype=float).reshape(len(modes), 2)
        size = len(found["a"])
        return Modes(
            equilibrium=rest,
            frequency=np.array([frequency for _, frequency, _, _ in modes], dtype=float),
            damping_ratio=np.array([ratio for _, _, ratio, _ in modes], dtype=float),
            eigenvalue=values[:, 0] + 1j * values[:, 1],
            shape=shapes[..., 0] + 1j * shapes[..., 1],
            a=np.array(found["a"], dtype=float).reshape(size, size),
            b=np.array(found["b"], dtype=float).reshape(size, len(self.inputs)),
            basis=np.array(found["basis"], dtype=float).reshape(n, size // 2),
            neutral_directions=np.array(found["neutral_directions"], dtype=float).reshape(-1, n),
        )

    def simulate(
        self,
        duration: float = 2.0,
        rate: float = 100.0,
        *,
        initial: Mapping[str, float] | None = None,
        state: tuple[ArrayLike, ArrayLike] | None = None,
        settle: bool = False,
        inputs: Mapping[str, Any] | Controller | Array | None = None,
        events: EventLike | Iterable[EventLike] | None = None,
        tolerance: float = 1e-8,
        method: str = "auto",
        restitution: float = 0.0,
    ) -> Motion:
        """Simulates the model.

        Args:
            duration: Seconds.
            rate: Samples per second.
            initial: Guesses of initial angles by joint, rad, as for :meth:`assemble`.
            state: (q, u) at the start instead; the loops are closed from there.
            settle: Begin at the state of rest near the start, with the inputs of the first sample (0 for functions).
            inputs: By name a number, an array with a value for each sample, or a function ``f(t, q, u)``; or one
                function that returns all inputs (by name, or in the order of :attr:`inputs`); or an array (S, inputs).
                Arrays and functions are sampled at ``rate`` and held between samples, as a digital controller does.
                Formulas are an argument of :func:`load`.
            events: Functions of (t, q, u) whose changes of sign are found between the samples (:attr:`Motion.events`), as
                those of SciPy's ``solve_ivp``: with the attributes ``terminal`` and ``direction``, or a
                :class:`lamc.Event`; or formulas such as ``"q.knee - 0.5"``. A function that is zero at the start
                does not change its sign there.
            tolerance: Error allowed per step, relative and absolute.
            method: ``auto``, ``dopri5`` (explicit) or ``rodas`` (implicit).
            restitution: Share of its speed with which a joint leaves a stop.

        Raises:
            SimulationError: It ended early; ``error.motion`` is what was recorded until then.
            Error: The model cannot be assembled, or an argument does not fit.
        """
        if state is not None and initial is not None:
            raise _lamc.Error("give either `state` or `initial`")
        times = self._native.sample_times(positive("duration", duration), positive("rate", rate))
        held, changing = self._schedule(inputs, len(times))
        if state is not None:
            q, u, found = self._closed(*_pair(state))
        else:
            q, u, found = self._closed(initial, None)
        self._warn(found)
        if settle:
            q = self._native.rest(0.0, list(q), held)["q"]
            u = np.zeros_like(u)
        native, failure, found = self._native.simulate(
            {
                "times": times.tolist(),
                "q": list(q),
                "u": list(u),
                "held": held,
                "inputs": changing,
                "events": requests(events),
                "method": str(method),
                "tolerance": positive("tolerance", tolerance),
                "restitution": number("restitution", restitution),
                "may_unfold": state is None and not settle,
            }
        )
        self._warn(found)
        motion = Motion(native, self)
        if failure is not None:
            raise SimulationError(failure, motion)
        return motion

    def course(
        self,
        duration: float = 2.0,
        rate: float = 100.0,
        *,
        initial: Mapping[str, float] | None = None,
        state: tuple[ArrayLike, ArrayLike] | None = None,
        inputs: Mapping[str, Any] | Array | None = None,
        method: str = "rk4",
        steps: int | None = None,
        tolerance: float = 1e-6,
    ) -> Course:
        """Simulates the model with fixed steps, so that numbers of the motion can be differentiated (:meth:`Course.gradient`).

        Args:
            duration: Seconds.
            rate: Samples per second.
            initial: Guesses of initial angles by joint, rad, as for :meth:`assemble`.
            state: (q, u) at the start instead; the loops are closed from there.
            inputs: By name a number or an array with a value for each sample; or an array (S, inputs). They are held between samples.
            method: ``rk4``, ``euler`` (semi-implicit) or ``rodas`` (implicit, for stiff hinges).
            steps: Equal steps from one sample to the next.
            tolerance: The error at the samples, rad and rad/s, if ``steps`` is not given: then it is doubled until the motion no
                longer changes.

        Raises:
            Error: The motion cannot be differentiated: it comes to a stop of a joint, passes a singular state such as the flat one,
                or has controllers. Or the model cannot be assembled, or an argument does not fit.
        """
        if state is not None and initial is not None:
            raise _lamc.Error("give either `state` or `initial`")
        if callable(inputs) or (isinstance(inputs, Mapping) and any(map(callable, inputs.values()))):
            raise _lamc.Error("inputs of a motion with derivatives are numbers or arrays, not functions")
        times = self._native.sample_times(positive("duration", duration), positive("rate", rate))
        held, changing = self._schedule(inputs, len(times))
        table = np.broadcast_to(held, (len(times), len(held))) if changing is None else changing
        if state is not None:
            q, u, found = self._closed(*_pair(state))
        else:
            q, u, found = self._closed(initial, None)
        self._warn(found)
        pinned = [False] * len(self.joints)
        if isinstance(initial, Mapping):
            pinned = [joint in initial for joint in self.joints]
        elif state is None:
            pinned = list(self._initial[2])
        native = self._native.course(
            {
                "times": times[1:].tolist(),
                "q": list(q),
                "u": list(u),
                "steps": None if steps is None else whole("steps", steps, 1),
                "tolerance": positive("tolerance", tolerance),
                "method": str(method),
                "inputs": np.ascontiguousarray(table[:-1]),
                "pinned": pinned,
            }
        )
        return Course(native, self)

    def fit(
        self,
        t: ArrayLike,
        q: ArrayLike | Mapping[str, ArrayLike],
        free: Sequence[str],
        *,
        initial: Mapping[str, float] | None = None,
        from_rest: bool = False,
    ) -> Fit:
        """Identifies parameters from measured angles and poses of free bodies, by least squares between the measured and
        the simulated motion.

        The parameters' values are the first guess. Unknown are also where the motion starts and, unless it starts from
        rest, how fast. A coordinate of a free body that was not measured starts as the model says, and so does its speed.

        Args:
            t: Times (S), s, ascending.
            q: Coordinates (S, NQ), NaN where none was measured; or by name (S), as in ``coordinates``, for those that were
                measured. Angles are in rad, displacements in m. An orientation is measured as a whole or not at all, and
                the sign of its quaternion does not matter.
            free: Parameters to identify. Those of hinges and plates are parameters if the model has ``tunable``.
            initial: Guesses of initial angles that were not measured, rad.
            from_rest: Whether the motion starts from rest.

        Raises:
            Error: The record does not determine the parameters, or no minimum was found.
        """
        times = np.atleast_1d(numbers("t", t))
        n = len(self.coordinates)
        if isinstance(q, Mapping):
            seen = np.full((len(times), n), np.nan)
            for k, column in zip(self._indices(q, self.coordinates), q.values()):
                measured = numbers(self.coordinates[k], column)
                if measured.shape != times.shape:
                    raise _lamc.Error(f"`{self.coordinates[k]}` has the shape {measured.shape}, not {times.shape}")
                seen[:, k] = measured
        else:
            seen = numbers("q", q)
        if times.ndim != 1 or seen.shape != (len(times), n):
            raise _lamc.Error(f"`q` has the shape {seen.shape}, not ({len(times)}, {n})")
        if len(times) < 3 or not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
            raise _lamc.Error("`t` must have at least three ascending times")
        guess = {} if initial is None else dict(initial)
        start = [(k, number(self.joints[k], angle)) for k, angle in zip(self._indices(guess), guess.values())]
        found = self._native.fit(times.tolist(), seen.tolist(), names(free), start, bool(from_rest))
        if not found["is_near"]:
            warnings.warn(
                "the model does not move as measured: the residuals are "
                f"{found['share']:.0%} of the motion",
                stacklevel=2,
            )
        parameters = dict(zip(found["names"], found["values"]))
        return Fit(
            model=self.with_(**parameters),
            parameters=parameters,
            standard_error=dict(zip(found["names"], found["errors"])),
            correlation=found["correlations"].reshape(len(parameters), len(parameters)),
            rms=found["rms"],
            q=np.array(found["q"], dtype=float).reshape(len(times), n),
            kept=found["kept"],
        )

    # -- files --------------------------------------------------------------------------------------------------

    def write_rust(
        self,
        path: str | os.PathLike[str],
        *,
        scalar: str = "generic",
        extern_c: bool = False,
        functions: Sequence[str] | None = None,
    ) -> None:
        """Writes the Rust module, as ``lamc MODEL -o PATH`` does.

        Args:
            path: The file.
            scalar: ``generic``, ``f64`` or ``f32``.
            extern_c: Whether the module exports the functions of the C header.
            functions: Functions besides those that every motion needs; by default all but ``jacobian``.
        """
        _write(path, self._native.rust(str(scalar), bool(extern_c), None if functions is None else names(functions)))

    def write_c(
        self,
        path: str | os.PathLike[str],
        *,
        header: str | os.PathLike[str] | None = None,
        scalar: str = "f64",
        functions: Sequence[str] | None = None,
    ) -> None:
        """Writes the C module and its header, by default beside it under the same name with ``.h``."""
        beside = Path(header) if header is not None else Path(path).with_suffix(".h")
        if beside == Path(path):
            raise _lamc.Error(f"the module and its header cannot both be `{beside}`")
        source, declarations = self._native.c(str(scalar), beside.name, None if functions is None else names(functions))
        _write(path, source)
        _write(beside, declarations)

    def write_fmu(self, path: str | os.PathLike[str], *, version: int = 2) -> None:
        """Writes a source FMU for Model Exchange and Co-Simulation.

        Args:
            path: The file.
            version: 2 for FMI 2.0, 3 for FMI 3.0.
        """
        Path(path).write_bytes(self._native.fmu(min(whole("version", version), 9)))

    # -- Python -------------------------------------------------------------------------------------------------

    def __reduce__(self) -> tuple[Any, ...]:
        return _read, (self._native.to_bytes(), self._changed, self._formulas)

    def __repr__(self) -> str:
        bodies = len(self.free_bodies)
        free = {0: "", 1: "1 free body, "}.get(bodies, f"{bodies} free bodies, ")
        return (
            f"<lamc.Model {self.name}: {free}{count(len(self.joints), 'joint')}, "
            f"{count(len(self.loops), 'loop')}, mobility {self.mobility}>"
        )

    def _repr_html_(self) -> str:
        q, u = self.assemble()
        request = {
            "times": [0.0],
            "q": list(q),
            "u": list(u),
            "held": [0.0] * len(self.inputs),
            "inputs": None,
            "events": [],
            "method": "auto",
            "tolerance": 1e-8,
            "restitution": 0.0,
            "may_unfold": False,
        }
        native, _, _ = self._native.simulate(request)
        return frame(native.html())

    # -- arguments ----------------------------------------------------------------------------------------------

    def _indices(self, given: Iterable[str], among: Sequence[str] | None = None) -> list[int]:
        """The indices of these joints, or of these names ``among`` others."""
        there = self.joints if among is None else among
        known = {name: k for k, name in enumerate(there)}
        try:
            return [known[name] for name in given]
        except KeyError as missing:
            what = "coordinate" if self.free_bodies and among is not None else "joint"
            raise _lamc.Error(f"there is no {what} {missing}; there are {', '.join(there)}") from None

    def _vector(self, name: str, values: ArrayLike, components: Sequence[str]) -> list[float]:
        vector = numbers(name, values)
        if vector.shape != (len(components),):
            raise _lamc.Error(f"`{name}` has the shape {vector.shape}, not ({len(components)},)")
        found: list[float] = vector.tolist()
        return found

    def _ordered(self, values: Mapping[str, Any]) -> list[Any]:
        """Values by name in the order of the inputs; 0 where there is none."""
        for name in values:
            if name not in self.inputs:
                there = ", ".join(self.inputs) or "none"
                raise _lamc.Error(f"there is no input `{name}`; there are: {there}")
            if name in self._formulas:
                raise _lamc.Error(f"input `{name}` follows the formula that was given to `load`")
        return [values.get(name, 0.0) for name in self.inputs]

    def _held(self, inputs: Any) -> Array:
        """Inputs of one state, or of several, as an array (.., inputs)."""
        if inputs is None:
            return np.zeros(len(self.inputs))
        if isinstance(inputs, Mapping):
            columns = [numbers("inputs", column) for column in self._ordered(inputs)]
            try:
                return np.stack(np.broadcast_arrays(*columns), axis=-1) if columns else np.zeros(0)
            except ValueError:
                shapes = ", ".join(str(column.shape) for column in columns)
                raise _lamc.Error(f"the shapes of `inputs` differ: {shapes}") from None
        values = numbers("inputs", inputs)
        if values.ndim == 0 or values.shape[-1] != len(self.inputs):
            raise _lamc.Error(f"`inputs` has the shape {values.shape}, not (.., {len(self.inputs)})")
        return values

    def _states(
        self, q: ArrayLike, u: ArrayLike | None, t: ArrayLike, inputs: Any
    ) -> tuple[_lamc.States, bool]:
        """The arguments as contiguous rows, and whether there was an axis of states."""
        n, m = len(self.coordinates), len(self.speeds)
        angles = numbers("q", q)
        if inputs is None and isinstance(u, np.ndarray) and isinstance(t, float):
            # One state, as an integrator asks for it: this is most of the time of such a call.
            if angles.shape == (n,) and u.shape == (m,) and u.dtype == angles.dtype:
                rows = np.array([t]), np.ascontiguousarray(angles)[None], np.ascontiguousarray(u)[None]
                return (*rows, self._no_inputs), False
        if angles.ndim not in (1, 2) or angles.shape[-1] != n:
            raise _lamc.Error(f"`q` has the shape {angles.shape}, not ({n},) or (S, {n})")
        held, times = self._held(inputs), numbers("t", t)
        speeds = np.zeros(m) if u is None else numbers("u", u)
        if speeds.ndim not in (1, 2) or speeds.shape[-1] != m:
            raise _lamc.Error(f"`u` has the shape {speeds.shape}, not ({m},) or (S, {m})")
        if times.ndim > 1:
            raise _lamc.Error(f"`t` has the shape {times.shape}, not () or (S,)")
        if held.ndim > 2:
            raise _lamc.Error(f"`inputs` has the shape {held.shape}, not ({len(self.inputs)},) or (S, ..)")
        leading = {
            "q": angles.shape[:-1],
            "u": speeds.shape[:-1],
            "t": times.shape,
            "inputs": held.shape[:-1],
        }
        counts = {shape[0] for shape in leading.values() if shape}
        if len(counts) > 1:
            there = ", ".join(f"`{name}` {shape[0]}" for name, shape in leading.items() if shape)
            raise _lamc.Error(f"the numbers of states differ: {there}")
        rows = counts.pop() if counts else 1
        return (
            np.ascontiguousarray(np.broadcast_to(times, (rows,))),
            np.ascontiguousarray(np.broadcast_to(angles, (rows, n))),
            np.ascontiguousarray(np.broadcast_to(speeds, (rows, m))),
            np.ascontiguousarray(np.broadcast_to(held, (rows, len(self.inputs)))),
        ), any(leading.values())

    def _schedule(self, inputs: Any, samples: int) -> tuple[list[float], Any]:
        """Inputs that are held throughout, and what changes them: an array (samples, inputs) or a function."""
        if callable(inputs):
            return [0.0] * len(self.inputs), self._control(inputs)
        if inputs is None:
            return [0.0] * len(self.inputs), None
        if not isinstance(inputs, Mapping):
            table = np.ascontiguousarray(numbers("inputs", inputs))
            if table.shape != (samples, len(self.inputs)):
                raise _lamc.Error(
                    f"`inputs` has the shape {table.shape}, not ({samples}, {len(self.inputs)}): a row for each sample"
                )
            return table[0].tolist(), table
        values = self._ordered(inputs)
        zero = np.zeros(())
        columns = [zero if callable(value) else numbers(name, value) for name, value in zip(self.inputs, values)]
        for name, column in zip(self.inputs, columns):
            if column.ndim and column.shape != (samples,):
                raise _lamc.Error(
                    f"input `{name}` has the shape {column.shape}, not ({samples},): a value for each sample"
                )
        if all(column.ndim == 0 for column in columns) and not any(map(callable, values)):
            return [float(column) for column in columns], None
        table = np.stack([np.broadcast_to(column, samples) for column in columns], axis=1)
        if not any(map(callable, values)):
            return table[0].tolist(), np.ascontiguousarray(table)

        def call(sample: int, t: float, q: Array, u: Array) -> list[float]:
            row = table[sample]
            return [
                number(self.inputs[k], value(t, q, u)) if callable(value) else float(row[k])
                for k, value in enumerate(values)
            ]

        return [0.0] * len(values), call

    def _control(self, controller: Controller) -> Callable[[int, float, Array, Array], list[float]]:
        def call(_: int, t: float, q: Array, u: Array) -> list[float]:
            chosen = controller(t, q, u)
            if isinstance(chosen, Mapping):
                return [number("inputs", value) for value in self._ordered(chosen)]
            values: list[float] = numbers("inputs", chosen).ravel().tolist()
            return values

        return call


def _read(derived: bytes, parameters: Mapping[str, float], formulas: frozenset[str]) -> Model:
    native = _lamc.Program(derived)
    return Model(native.with_parameters(dict(parameters))[0], parameters, formulas)


def _write(path: str | os.PathLike[str], text: str) -> None:
    Path(path).write_text(text, encoding="utf-8")


def plain(value: Any) -> Any:
    """A value of NumPy or a path, for JSON."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise _lamc.Error(f"a model cannot have {value!r}")


def _pair(state: Any) -> tuple[ArrayLike, ArrayLike]:
    try:
        q, u = state
    except (TypeError, ValueError):
        raise _lamc.Error("`state` must be a pair (q, u)") from None
    return q, u


def _shaped(numbers: Array, states: _lamc.States, several: bool, *shape: int) -> Array:
    leading = (len(states[0]),) if several else ()
    return numbers.reshape(*leading, *shape)
