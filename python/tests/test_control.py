"""Controllers as a firmware in Python would call them, against their formulas and against `simulate`."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import lamc

ARM = {
    "gravity": [0, 0, 0],
    "parameters": {"k": 2e-4},
    "inputs": ["push"],
    "bodies": {
        "base": {"fixed": True},
        "arm": {"mass": "1 g", "com": [0, 0, 0], "inertia": [[1e-6, 0, 0], [0, 1e-6, 0], [0, 0, 1e-6]]},
    },
    "joints": {"hip": {"bodies": ["base", "arm"], "axis": [[0, 0], [0, 1]], "torque": "push"}},
    "initial": {"q": {"hip": 0.4}},
    "controllers": {
        "pd": {
            "sample": "10 ms",
            "memory": {"last": {"initial": 0.4, "next": "q.hip"}},
            "inputs": {"push": "-k*q.hip - 1e-5*(q.hip - last)/Ts"},
        }
    },
}


def test_commands_are_the_formula() -> None:
    model = lamc.load(ARM)
    assert (model.commanded, model.memory) == (["push"], {"pd.last": 0.4})
    q, last = np.array([[0.3], [0.5]]), np.array([[0.1], [0.2]])
    found = model.control(q, memory=last)
    assert_allclose(found.commands, -2e-4 * q - 1e-3 * (q - last), rtol=1e-12)
    assert_allclose(found.memory, q)
    one = model.with_(k=1e-4).control([0.3])
    assert_allclose(one.commands, [-1e-4 * 0.3 - 1e-3 * (0.3 - 0.4)], rtol=1e-12)
    with pytest.raises(lamc.Error, match="`memory` has the shape"):
        model.control(q, memory=[1.0, 2.0])
    with pytest.raises(lamc.Error, match="has no controllers"):
        lamc.load({name: value for name, value in ARM.items() if name != "controllers"}).control([0.3])


def test_a_loop_in_python_is_the_simulation() -> None:
    model = lamc.load(ARM)
    q, u, memory = np.array([0.4]), np.array([0.0]), list(model.memory.values())
    for sample in range(50):
        found = model.control(q, u, 0.01 * sample, memory)
        memory = found.memory
        q, u = model.step(q, u, 1e-3, 0.01 * sample, found.commands, steps=10)
    motion = model.simulate(0.5, rate=100)
    assert_allclose([q[0], u[0]], [motion.q[-1, 0], motion.u[-1, 0]], rtol=0, atol=1e-9)
    assert np.abs(motion.q).max() > 0.1
