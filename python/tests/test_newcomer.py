"""What people try in their first hour."""

import _thread
import pickle
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import lamc
from models import INERTIA, PENDULUM, ROOT


def test_derivatives_by_inputs(pendulum: lamc.Model) -> None:
    found = pendulum.jacobian([[0.1], [0.2], [0.3]])
    assert found.dinputs.shape == (3, 1, 1)
    assert_allclose(found.dinputs, 1 / INERTIA, rtol=1e-12)
    # Two motors at a closed loop, against differences. Du/dt is affine in them.
    text = (ROOT / "examples/fourbar.yaml").read_text(encoding="utf-8")
    joints = lamc.load(text).joints
    model = lamc.load("inputs: [left, right]\n" + _with_torques(text, joints[0], joints[1]))
    q, u = model.assemble()
    u = model.assemble(q, np.full(len(joints), 0.3))[1]
    held = np.array([1e-3, -2e-3])
    found = model.jacobian(q, u, inputs=held)
    assert found.dinputs.shape == (len(joints), 2)
    assert_allclose(found.acceleration, model.acceleration(q, u, inputs=held), rtol=1e-9)
    for k in range(2):
        step = np.zeros(2)
        step[k] = 0.1
        ahead, behind = (model.acceleration(q, u, inputs=held + sign * step) for sign in (1, -1))
        assert_allclose(found.dinputs[:, k], (ahead - behind) / 0.2, rtol=1e-8)
    # At rest it is the B of the modes: both move z = T^T M q.
    rest = model.equilibrium()
    modes, at_rest = model.modes(), model.jacobian(rest.q)
    assert_allclose(modes.basis @ modes.b[modes.basis.shape[1] :], at_rest.dinputs, rtol=1e-6)


def _with_torques(text: str, first: str, second: str) -> str:
    for joint, motor in ((first, "left"), (second, "right")):
        at = text.index("bodies: [", text.index(f"  {joint}:"))
        text = text[:at] + f"torque: {motor}, " + text[at:]
    return text


def test_hinge_lines_lie_on_both_bodies(sixbar: lamc.Model) -> None:
    # Numbers of the file.
    k = sixbar.joints.index("ground_west")
    origin, end = np.array([9.3319, -29.3065]) * 1e-3, np.array([-40.1656, 20.191]) * 1e-3
    assert_allclose(sixbar.hinge_origins[k], [*origin, 3.075e-3], atol=1e-7)
    assert_allclose(sixbar.hinge_axes[k], [*((end - origin) / np.hypot(*(end - origin))), 0], atol=1e-5)
    assert sixbar.joint_bodies[k] == ("ground", "west")
    q, _ = sixbar.assemble({"ground_west": 0.3})
    rotation, translation = sixbar.poses(q)
    for joint, (first, second) in enumerate(sixbar.joint_bodies):
        a, b = sixbar.bodies.index(first), sixbar.bodies.index(second)
        origin, axis = sixbar.hinge_origins[joint], sixbar.hinge_axes[joint]
        assert_allclose(rotation[a] @ axis, rotation[b] @ axis, atol=1e-12)
        assert_allclose(rotation[a] @ origin + translation[a], rotation[b] @ origin + translation[b], atol=1e-12)
        # The angle between both bodies about this line, by the right hand.
        turn = rotation[a].T @ rotation[b]
        skew = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        assert_allclose(skew, np.sin(q[joint]) * axis, atol=1e-12)


def test_states_of_a_time() -> None:
    model = {**PENDULUM, "inputs": [], "joints": {"hinge": {"bodies": ["base", "rod"], "axis": [[0, 0], [1, 0]]}}}
    driven = lamc.load({**model, "joints": {"hinge": {**model["joints"]["hinge"], "drive": "0.5*sin(10*t)"}}})
    q, u = driven.assemble(t=0.3)
    assert_allclose([q[0], u[0]], [0.5 * np.sin(3.0), 5 * np.cos(3.0)], rtol=1e-12)
    # A spring against a torque that grows: rest at torque / k.
    grows = {"hinge": {**model["joints"]["hinge"], "stiffness": "2e-4", "torque": "1e-4*t"}}
    pushed = lamc.load({**model, "joints": grows})
    assert_allclose(pushed.equilibrium(t=0.8).q, [0.4], rtol=1e-9)
    assert_allclose(pushed.modes(t=0.8).equilibrium.potential_energy, 0.5 * 2e-4 * 0.4**2, rtol=1e-9)
    assert_allclose(pushed.equilibrium().q, [0.0], atol=1e-12)


def test_motions_are_pickled(sixbar: lamc.Model, tmp_path: Path) -> None:
    motion = sixbar.simulate(0.2, 50, initial={"ground_west": 0.3}, events="u.ground_west")
    same = pickle.loads(pickle.dumps(motion))
    for name in ("t", "q", "u", "acceleration", "points", "rotation", "translation", "closure", "kinetic_energy"):
        assert_array_equal(getattr(same, name), getattr(motion, name))
    assert repr(same) == repr(motion) and same.complete
    assert len(motion.events[0]) > 0
    for name in ("t", "q", "u"):
        assert_array_equal(getattr(same.events[0], name), getattr(motion.events[0], name))
    motion.write_csv(tmp_path / "a.csv")
    same.write_csv(tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_text() == (tmp_path / "b.csv").read_text()
    assert same.html() == motion.html()


def test_a_failed_simulation_is_pickled_with_its_motion(pendulum: lamc.Model) -> None:
    with pytest.raises(lamc.SimulationError) as raised:
        pendulum.simulate(0.5, events="sqrt(0.1 - t)")
    error = pickle.loads(pickle.dumps(raised.value))
    assert str(error) == str(raised.value)
    assert_array_equal(error.motion.t, raised.value.motion.t)


def test_words(pendulum: lamc.Model, sixbar: lamc.Model) -> None:
    assert repr(pendulum) == "<lamc.Model pendulum: 1 joint, 0 loops, mobility 1>"
    assert repr(sixbar) == "<lamc.Model sixbar: 6 joints, 1 loop, mobility 3>"


@pytest.fixture
def interrupts() -> Iterator[None]:
    # A shell lets programs that it starts in the background ignore Ctrl-C.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interrupts")
def test_an_interrupt_is_seen(pendulum: lamc.Model) -> None:
    motion, swinging, t = pendulum.simulate(0.5, 10), pendulum.with_(k=2e-4), np.linspace(0, 3000, 300_001)
    long: list[Callable[[], Any]] = [
        lambda: pendulum.step([0.1], [0.0], 1e-6, steps=10**8),
        lambda: swinging.simulate(1e5, 1e-3, initial={"hinge": 0.1}),
        # As `modes`: in a thread of its own.
        lambda: swinging.fit(t, np.cos(10 * t)[:, None], ["k"]),
        lambda: motion.animate("never.mp4", speed=1e-3, size=(1280, 720)),
    ]
    for call in long:
        ended = threading.Event()

        def interrupt(ended: threading.Event = ended) -> None:
            # Python drops an interrupt that comes while it destroys an object: a person presses Ctrl-C again.
            while not ended.wait(1.0):
                _thread.interrupt_main()

        threading.Thread(target=interrupt).start()
        begin = time.monotonic()
        try:
            with pytest.raises(KeyboardInterrupt):
                call()
        finally:
            ended.set()
        assert time.monotonic() - begin < 5.0
    assert not Path("never.mp4").exists()


@pytest.mark.parametrize(
    "mistake",
    [
        lambda model: lamc.load(3),
        lambda model: lamc.load({"name": object()}),
        lambda model: lamc.load(PENDULUM, lock={"hinge": "far"}),
        lambda model: model.with_(k="stiff"),
        lambda model: model.with_(k=[1.0, 2.0]),
        lambda model: model.acceleration("fast"),
        lambda model: model.acceleration([0.0], t="now"),
        lambda model: model.acceleration([0.0], inputs={"motor": "on"}),
        lambda model: model.assemble({"hinge": None}),
        lambda model: model.equilibrium(inputs=[[0.0], [1.0]]),
        lambda model: model.step([0.0], [0.0], "short"),
        lambda model: model.step([0.0], [0.0], 1e-3, steps="many"),
        lambda model: model.step([0.0], [0.0], 1e-3, steps=2**80),
        lambda model: model.simulate("long"),
        lambda model: model.simulate(rate=0),
        lambda model: model.simulate(method=3),
        lambda model: model.simulate(restitution=None),
        lambda model: model.simulate(state=[0.0]),
        lambda model: model.simulate(state=([0.0], [0.0]), initial={}),
        lambda model: model.simulate(inputs={"motor": "on"}),
        lambda model: model.simulate(inputs=lambda t, q, u: "on"),
        lambda model: model.fit("long", [[0.0]], ["k"]),
        lambda model: model.fit([0.0, 0.1, 0.2], {"hinge": [0.0]}, ["k"]),
        lambda model: model.fit([0.0, 0.1, 0.2], np.zeros((3, 1)), 3),
        lambda model: model.write_rust("x.rs", scalar=3),
        lambda model: model.write_fmu("x.fmu", version=4),
        lambda model: model.simulate(0.1).plot(joints=["knee"]),
        lambda model: model.simulate(0.1).animate("x.gif"),
        lambda model: model.simulate(0.1).animate("x.png", size=3),
        lambda model: model.simulate(0.1).animate("x.png", size=(-1, 10)),
    ],
)
def test_mistakes_are_errors_of_one_kind(pendulum: lamc.Model, mistake: Callable[[lamc.Model], Any]) -> None:
    with pytest.raises(lamc.Error) as raised:
        mistake(pendulum)
    assert isinstance(raised.value, ValueError) and len(str(raised.value)) > 10
