"""Events against closed forms and against SciPy's."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipk

import lamc
from models import INERTIA, PENDULUM

K, FREQUENCY = 2e-4, np.sqrt(2e-4 / INERTIA)


@pytest.fixture(scope="module")
def swinging(pendulum: lamc.Model) -> lamc.Model:
    return pendulum.with_(k=K)


def test_a_swing_has_its_angle_when_the_closed_form_has(swinging: lamc.Model) -> None:
    motion = swinging.simulate(
        2.0, 20, initial={"hinge": 0.4}, tolerance=1e-11, events=lambda t, q, u: q[0] - 0.2
    )
    [found] = motion.events
    # 0.4 cos(w t) = 0.2
    turns = np.arange(20)
    times = np.sort(np.concatenate([2 * np.pi * turns + np.pi / 3, 2 * np.pi * turns - np.pi / 3])) / FREQUENCY
    times = times[(times > 0) & (times < 2.0)]
    assert len(times) > 4
    assert_allclose(found.t, times, atol=1e-9)
    assert_allclose(found.q[:, 0], 0.2, atol=1e-9)
    assert_allclose(found.u[:, 0], -0.4 * FREQUENCY * np.sin(FREQUENCY * times), atol=1e-6)
    assert motion.complete and len(motion) == 41


def test_directions_ends_and_formulas(swinging: lamc.Model) -> None:
    def returns(t: float, q: np.ndarray, u: np.ndarray) -> float:
        return q[0]

    returns.direction = -1  # type: ignore[attr-defined]
    events = [returns, "q.hinge", lamc.Event("q.hinge + 0*k", direction=1, terminal=2), "u.hinge"]
    motion = swinging.simulate(5.0, 100, initial={"hinge": 0.4}, tolerance=1e-11, events=events)
    quarter = np.pi / 2 / FREQUENCY
    falls, all_, rises, turns = (found.t for found in motion.events)
    assert_allclose(falls, np.array([1, 5]) * quarter, atol=1e-9)
    assert_allclose(all_, np.array([1, 3, 5, 7]) * quarter, atol=1e-9)
    assert_allclose(rises, np.array([3, 7]) * quarter, atol=1e-9)
    # Not at the start, where it is zero.
    assert_allclose(turns, np.array([2, 4, 6]) * quarter, atol=1e-9)
    # The second return ends the motion, with a sample.
    assert motion.complete and motion.t[-1] == rises[-1]
    assert_allclose(motion.q[-1], 0.0, atol=1e-9)
    assert (np.diff(motion.t) > 0).all()


def test_a_falling_pendulum_against_scipy_and_the_elliptic_integral() -> None:
    weight = 0.002 * 0.02 * 9.81
    model = lamc.load({**PENDULUM, "gravity": [0, -9.81, 0]})
    start = 2.5
    motion = model.simulate(
        2.0,
        100,
        initial={"hinge": start},
        tolerance=1e-11,
        events=[lambda t, q, u: q[0], lambda t, q, u: u[0] - 10.0, "abs(q.hinge) - 1"],
    )

    def rates(t: float, x: np.ndarray) -> list[float]:
        return [x[1], -weight / INERTIA * np.sin(x[0])]

    events = [lambda t, x: x[0], lambda t, x: x[1] - 10.0, lambda t, x: abs(x[0]) - 1]
    scipy = solve_ivp(rates, (0, 2.0), [start, 0.0], events=events, rtol=1e-12, atol=1e-13, method="DOP853")
    for ours, times, states in zip(motion.events, scipy.t_events, scipy.y_events):
        assert len(times) > 3
        assert_allclose(ours.t, times, atol=1e-8)
        assert_allclose(ours.q[:, 0], states[:, 0], atol=1e-7)
    # A quarter of the period.
    quarter = np.sqrt(INERTIA / weight) * ellipk(np.sin(start / 2) ** 2)
    assert_allclose(motion.events[0].t, quarter * np.arange(1, 2 * len(motion.events[0]), 2), atol=1e-8)


def test_closed_loops_against_scipy(sixbar: lamc.Model) -> None:
    q, u = sixbar.assemble({"ground_west": 0.3})
    n, joint = len(q), sixbar.joints.index("ground_west")
    motion = sixbar.simulate(
        0.1, 100, state=(q, u), tolerance=1e-11, events=["u.ground_west", lambda t, q, u: q[0] - q[1]]
    )

    def rates(t: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[n:], sixbar.acceleration(x[:n], x[n:], t)])

    events = [lambda t, x: x[n + joint], lambda t, x: x[0] - x[1]]
    scipy = solve_ivp(rates, (0, 0.1), np.concatenate([q, u]), events=events, rtol=1e-10, atol=1e-11)
    for ours, times in zip(motion.events, scipy.t_events):
        # SciPy counts a speed that is zero at the start.
        times = times[times > 0]
        assert len(times) >= 1
        assert_allclose(ours.t, times, atol=1e-6)
        # Its states are closed.
        assert np.abs(sixbar.closure(ours.q)[0]).max() < 1e-10


def test_it_ends_when_it_has_settled(pendulum: lamc.Model) -> None:
    k, b, start, small = 2e-4, 1e-5, 0.5, 1e-9
    damped = pendulum.with_(k=k, b=b)
    settled = lamc.Event(lambda t, q, u: damped.energy(q, u, t).sum() - small, terminal=True)
    motion = damped.simulate(10.0, initial={"hinge": start}, tolerance=1e-10, events=settled)
    decay = b / (2 * INERTIA)
    frequency = np.sqrt(k / INERTIA - decay**2)

    def energy(t: float) -> float:
        q = start * np.exp(-decay * t) * (np.cos(frequency * t) + decay / frequency * np.sin(frequency * t))
        u = -start * np.exp(-decay * t) * (decay**2 / frequency + frequency) * np.sin(frequency * t)
        return 0.5 * (INERTIA * u**2 + k * q**2)

    # The energy only falls.
    end = brentq(lambda t: energy(t) - small, 0.0, 10.0, xtol=1e-14)
    assert_allclose(motion.t[-1], end, atol=1e-6)
    assert motion.complete and motion.t[-1] < 2.0


def test_events_within_held_inputs(pendulum: lamc.Model) -> None:
    rate, torque = 10, 1e-4
    torques = np.array([torque, -torque, -torque, torque, 0, 0])
    motion = pendulum.simulate(
        0.5, rate, inputs={"motor": torques}, tolerance=1e-11, events=["u.hinge", "motor", lamc.Event("t - 0.25", 1)]
    )
    # The speed rises for 0.1 s and then falls to zero in as long; the sign of the torque changes at a sample.
    assert_allclose(motion.events[0].t, [0.2], atol=1e-12)
    assert_allclose(motion.events[0].q[:, 0], [torque / INERTIA * 0.01], rtol=1e-9)
    assert_allclose(motion.events[1].t, [0.1], atol=1e-12)
    # It ends between samples; the inputs are those of the sample before.
    assert_allclose(motion.t, [0, 0.1, 0.2, 0.25], atol=1e-12)
    assert_allclose(motion.inputs[:, 0], [torque, -torque, -torque, -torque])


def test_mistakes_in_events(swinging: lamc.Model) -> None:
    def broken(t: float, q: np.ndarray, u: np.ndarray) -> float:
        if t > 0.1:
            raise KeyError("sensor")
        return 1.0

    with pytest.raises(KeyError, match="sensor"):
        swinging.simulate(0.5, events=broken)
    with pytest.raises(lamc.SimulationError, match="event 0 has no value at t = 0") as raised:
        swinging.simulate(0.5, events="sqrt(0.1 - t)")
    assert not raised.value.motion.complete and 0 < len(raised.value.motion) <= 11
    with pytest.raises(lamc.Error, match="`q.knee`: .*hinge"):
        swinging.simulate(0.5, events="q.knee")
    with pytest.raises(lamc.Error, match="must be one number, not 2"):
        swinging.simulate(0.5, events=lambda t, q, u: [0.0, 1.0])
    with pytest.raises(lamc.Error, match="`events` must be"):
        swinging.simulate(0.5, events=3)  # type: ignore[arg-type]
    with pytest.raises(lamc.Error, match="`terminal` must be a whole number"):
        swinging.simulate(0.5, events=lamc.Event("t", terminal=-1))


def test_looking_changes_nothing(sixbar: lamc.Model) -> None:
    state = sixbar.assemble({"ground_west": 0.3})
    plain = sixbar.simulate(0.2, 50, state=state)
    watched = sixbar.simulate(0.2, 50, state=state, events=["u.ground_west", lambda t, q, u: q[0] - q[1]])
    assert sum(map(len, watched.events)) > 2
    assert (plain.q == watched.q).all() and (plain.u == watched.u).all()


@pytest.mark.parametrize(
    ("function", "most"),
    # Bisection would halve a step of 0.1 s some fifty times.
    [(lambda t: t, 10), (lambda t: np.expm1(40 * t), 10), (np.sign, 52)],
    ids=["line", "curve", "jump"],
)
def test_few_evaluations_find_a_time(
    pendulum: lamc.Model, function: Callable[[float], float], most: int
) -> None:
    times: list[float] = []

    def event(t: float, q: np.ndarray, u: np.ndarray) -> float:
        times.append(t)
        return function(t - 0.1234)

    motion = pendulum.simulate(0.3, 10, initial={"hinge": 0.0}, events=event)
    assert_allclose(motion.events[0].t, [0.1234], rtol=1e-14)
    # The start, the end of each step, and both ends of the one in which it changes.
    assert len(times) <= 1 + sum(motion._native.steps) + 2 + most
