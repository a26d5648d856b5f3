"""Gradients of motions against closed forms and differences."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import lamc
from models import INERTIA, PENDULUM, ROOT


def test_a_swing_has_the_derivatives_of_its_closed_form(pendulum: lamc.Model) -> None:
    k, start, duration = 2e-4, 0.3, 0.2
    swinging = pendulum.with_(k=k)
    course = swinging.course(duration, 100, initial={"hinge": start}, tolerance=1e-11)
    frequency = np.sqrt(k / INERTIA)
    assert_allclose(course.q[:, 0], start * np.cos(frequency * course.t), atol=1e-10)
    # L is the last angle.
    slope = np.zeros_like(course.q)
    slope[-1] = 1
    gradient = course.gradient(q=slope)
    phase = frequency * duration
    assert_allclose(gradient.q, [np.cos(phase)], rtol=1e-8)
    assert_allclose(gradient.u, [np.sin(phase) / frequency], rtol=1e-8)
    by_stiffness = -start * np.sin(phase) * duration * frequency / (2 * k)
    assert_allclose(gradient.parameters["k"], by_stiffness, rtol=1e-8)
    # A constant torque moves the angle of rest by its share of k.
    assert_allclose(gradient.inputs.sum(), (1 - np.cos(phase)) / k, rtol=1e-8)
    # L is the sum of the squares of the tip's heights.
    gradient = course.gradient(points=2 * course.points * [0, 0, 1])
    angles = start * np.cos(frequency * course.t)
    by_start = 2 * 0.04**2 * np.sin(angles) * np.cos(angles) * np.cos(frequency * course.t)
    assert_allclose(gradient.q, [by_start.sum()], rtol=1e-8)


@pytest.mark.parametrize("method", ["rk4", "euler", "rodas"])
def test_a_linkage_with_parameters_against_differences(method: str) -> None:
    model = lamc.load(ROOT / "examples/linkage.yaml")
    rng = np.random.default_rng(1)
    weights = rng.normal(size=(5, 4)), rng.normal(size=(5, 4)), rng.normal(size=(5, 1, 3)), rng.normal(size=(5, 2))

    def run(model: lamc.Model, drive: float = 1.0) -> lamc.Course:
        return model.course(0.02, 200, initial={"drive": drive}, method=method, steps=20)

    def number(course: lamc.Course) -> float:
        energies = course.model.energy(course.q, course.u)
        values = course.q, course.u, course.points, energies
        return float(sum((weight * value).sum() for weight, value in zip(weights, values)))

    course = run(model)
    gradient = course.gradient(*weights)
    for name, value in model.parameters.items():
        h = 1e-4 * value
        there, back = (number(run(model.with_(**{name: value + sign * h}))) for sign in (1, -1))
        assert_allclose(gradient.parameters[name], (there - back) / (2 * h), rtol=1e-5)
    h = 1e-4
    there, back = (number(run(model, 1.0 + sign * h)) for sign in (1, -1))
    assert_allclose(gradient.q[0], (there - back) / (2 * h), rtol=1e-5)


def test_what_has_no_gradient_is_refused(pendulum: lamc.Model) -> None:
    with pytest.raises(lamc.Error, match="not functions"):
        pendulum.course(0.1, inputs={"motor": lambda t, q, u: t})
    with pytest.raises(lamc.Error, match="not one of rk4, euler, rodas"):
        pendulum.course(0.1, method="auto")
    course = pendulum.course(0.1)
    with pytest.raises(lamc.Error, match=r"`q` has the shape \(1, 1\), not \(11, 1\)"):
        course.gradient(q=[[1.0]])
    hinge = {**PENDULUM["joints"]["hinge"], "limits": [-0.5, 0.5]}
    stopped = lamc.load({**PENDULUM, "joints": {"hinge": hinge}})
    with pytest.raises(lamc.Error, match="`hinge` comes to its stop at 0.0"):
        stopped.course(0.5, state=([0.0], [10.0]), steps=1)
