"""Models against closed forms, against the command, and against SciPy."""

import json
import pickle
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

import lamc
from lamc import _command
from models import INERTIA, PENDULUM, ROOT

def test_the_report_is_that_of_the_command(sixbar: lamc.Model) -> None:
    said = _command.run(["check", str(ROOT / "examples/sixbar.yaml")]).decode()
    assert sixbar.check() == said and said.startswith("sixbar\n\nmobility 3: 6 joints")


def test_names_and_numbers(pendulum: lamc.Model, sixbar: lamc.Model) -> None:
    assert pendulum.joints == ["hinge"] and pendulum.inputs == ["motor"]
    assert pendulum.parameters == {"k": 0.0, "b": 0.0}
    assert sixbar.mobility == 3 and len(sixbar.joints) == 6 and len(sixbar.loops) == 1


def test_a_torque_turns_a_body_by_its_inertia(pendulum: lamc.Model) -> None:
    torques = np.array([[0.0], [1e-4], [-3e-4]])
    rates = pendulum.acceleration(np.zeros((3, 1)), inputs=torques)
    assert_allclose(rates, torques / INERTIA, rtol=1e-12)
    # By name, for one state, and for one input of several states.
    assert_allclose(pendulum.acceleration([0.0], inputs={"motor": 1e-4}), [1e-4 / INERTIA], rtol=1e-12)
    assert_allclose(pendulum.acceleration([[0.0], [1.0]], inputs=[1e-4]).ravel(), 1e-4 / INERTIA, rtol=1e-12)


def test_a_spring_swings_at_its_frequency(pendulum: lamc.Model) -> None:
    k = 2e-4
    swinging = pendulum.with_(k=k)
    frequency = np.sqrt(k / INERTIA)
    assert_allclose(swinging.modes().frequency, [frequency / (2 * np.pi)], rtol=1e-9)
    motion = swinging.simulate(0.5, 200, initial={"hinge": 0.3}, tolerance=1e-11)
    assert_allclose(motion.q[:, 0], 0.3 * np.cos(frequency * motion.t), atol=1e-8)
    energy = motion.kinetic_energy + motion.potential_energy
    assert_allclose(energy, 0.5 * k * 0.3**2, rtol=1e-8)
    # The model itself has not changed.
    assert pendulum.parameters["k"] == 0.0


def test_sampled_inputs_are_held(pendulum: lamc.Model) -> None:
    rate, samples = 100, 51
    torques = 1e-4 * np.sin(np.arange(samples))
    motions = [
        pendulum.simulate(0.5, rate, inputs={"motor": torques}),
        pendulum.simulate(0.5, rate, inputs={"motor": lambda t, q, u: torques[round(t * rate)]}),
        pendulum.simulate(0.5, rate, inputs=lambda t, q, u: {"motor": torques[round(t * rate)]}),
        pendulum.simulate(0.5, rate, inputs=lambda t, q, u: torques[round(t * rate)]),
    ]
    # Constant between samples: speeds and angles add up exactly.
    speeds = np.concatenate([[0.0], np.cumsum(torques[:-1] / INERTIA / rate)])
    angles = np.concatenate([[0.0], np.cumsum(speeds[:-1] / rate + torques[:-1] / INERTIA / rate**2 / 2)])
    for motion in motions:
        assert_allclose(motion.u[:, 0], speeds, atol=1e-9 * np.abs(speeds).max())
        assert_allclose(motion.q[:, 0], angles, atol=1e-9 * np.abs(angles).max())
        assert_allclose(motion.inputs[:, 0], torques)
        assert_allclose(motion.acceleration[:, 0], torques / INERTIA, rtol=1e-12)


def test_a_formula_is_an_input_of_load() -> None:
    driven = lamc.load(PENDULUM, inputs={"motor": "1e-4*cos(10*t)"})
    motion = driven.simulate(0.5, 100, tolerance=1e-10)
    with pytest.raises(lamc.Error, match="follows the formula"):
        driven.simulate(0.5, inputs={"motor": 1.0})
    assert_allclose(motion.u[:, 0], 1e-4 / INERTIA * np.sin(10 * motion.t) / 10, atol=1e-7)


def test_a_controller_that_fails_raises_its_own_error(pendulum: lamc.Model) -> None:
    def broken(t: float, q: np.ndarray, u: np.ndarray) -> float:
        if t > 0.1:
            raise KeyError("sensor")
        return 0.0

    with pytest.raises(KeyError, match="sensor"):
        pendulum.simulate(0.5, inputs={"motor": broken})
    with pytest.raises(lamc.Error, match="gives 2 inputs, the model has 1"):
        pendulum.simulate(0.5, inputs=lambda t, q, u: [0.0] * (1 if t == 0 else 2))


def test_accelerations_are_those_of_the_command(sixbar: lamc.Model, tmp_path: Path) -> None:
    q, u = sixbar.assemble()
    states = [{"q": list(q), "u": list(u)}, {"q": list(q), "u": list(u + 0.0), "t": 0.1}]
    (tmp_path / "states.json").write_text(json.dumps({"states": states}))
    arguments = ["eval", str(ROOT / "examples/sixbar.yaml"), "--states", str(tmp_path / "states.json")]
    report = json.loads(_command.run(arguments))
    rates = sixbar.acceleration([q, q], [u, u], [0.0, 0.1])
    assert_allclose(rates, [state["acceleration"] for state in report["states"]], rtol=1e-12)
    reactions = sixbar.reactions(q, u)
    assert_allclose(reactions, report["states"][0]["reactions"], rtol=1e-10, atol=1e-12)


def test_equations_solve_for_the_acceleration(sixbar: lamc.Model) -> None:
    q, u = sixbar.assemble({"ground_west": 0.3})
    found = sixbar.equations(q, u)
    n, rows = len(q), len(found.gamma)
    kkt = np.block([[found.mass, -found.jacobian.T], [found.jacobian, np.zeros((rows, rows))]])
    solution = np.linalg.lstsq(kkt, np.concatenate([found.forcing, -found.gamma]), rcond=1e-10)[0]
    assert_allclose(sixbar.acceleration(q, u), solution[:n], rtol=1e-7)


def test_derivatives_against_differences(sixbar: lamc.Model) -> None:
    q, u = sixbar.assemble({"ground_west": 0.3})
    u = 0.1 * np.cos(np.arange(len(u)))
    q, u = sixbar.assemble(q, u)
    found = sixbar.jacobian(q, u)
    assert_allclose(found.acceleration, sixbar.acceleration(q, u), rtol=1e-9)
    step = 1e-6
    for k in range(len(u)):
        ahead, behind = u.copy(), u.copy()
        ahead[k] += step
        behind[k] -= step
        difference = (sixbar.acceleration(q, ahead) - sixbar.acceleration(q, behind)) / (2 * step)
        assert_allclose(found.du[:, k], difference, rtol=1e-4, atol=1e-4 * np.abs(found.du).max())


def test_places_and_closure(pendulum: lamc.Model, sixbar: lamc.Model) -> None:
    angles = np.linspace(-2, 2, 5)[:, None]
    tips = pendulum.positions(angles)[:, 0]
    assert_allclose(np.linalg.norm(tips, axis=1), 0.04)
    rotation, translation = pendulum.poses(angles)
    rod = pendulum.bodies.index("rod")
    assert_allclose(rotation[:, rod] @ [0, -0.04, 0] + translation[:, rod], tips, atol=1e-15)
    q, _ = sixbar.assemble()
    residual, jacobian = sixbar.closure(q)
    assert np.abs(residual).max() < 1e-12 and jacobian.shape == (9, 6)
    kinetic, potential = pendulum.with_(k=2e-4).energy([0.5], [3.0])
    assert_allclose([kinetic, potential], [INERTIA * 4.5, 1e-4 * 0.25], rtol=1e-12)


def test_motion_against_scipy(sixbar: lamc.Model) -> None:
    q, u = sixbar.assemble({"ground_west": 0.3})
    motion = sixbar.simulate(0.1, 100, state=(q, u), tolerance=1e-10)
    n = len(q)

    def rhs(t: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[n:], sixbar.acceleration(x[:n], x[n:], t)])

    solution = solve_ivp(rhs, (0, 0.1), np.concatenate([q, u]), t_eval=motion.t, rtol=1e-9, atol=1e-10)
    assert_allclose(motion.q, solution.y[:n].T, atol=1e-6)


def test_steps_of_many_states(pendulum: lamc.Model, sixbar: lamc.Model) -> None:
    k = 2e-4
    frequency = np.sqrt(k / INERTIA)
    angles = np.linspace(-1, 1, 7)[:, None]
    q, u = pendulum.with_(k=k).step(angles, np.zeros_like(angles), 1e-4, steps=500)
    assert_allclose(q, angles * np.cos(frequency * 0.05), atol=1e-9)
    assert_allclose(u, -frequency * angles * np.sin(frequency * 0.05), atol=1e-7)
    q, u = sixbar.assemble({"ground_west": 0.3})
    motion = sixbar.simulate(0.01, 100, state=(q, u), tolerance=1e-10)
    assert_allclose(sixbar.step(q, u, 1e-5, steps=1000)[0], motion.q[-1], atol=1e-8)


def test_equilibrium(sixbar: lamc.Model) -> None:
    rest = sixbar.equilibrium()
    command = json.loads(_command.run(["equilibrium", str(ROOT / "examples/sixbar.yaml"), "--json"]))
    assert_allclose(rest.q, command["q"], atol=1e-9)
    assert rest.stable is command["stable"]
    assert np.abs(sixbar.acceleration(rest.q)).max() < 1e-4
    modes = sixbar.modes()
    assert len(modes.frequency) > 0 and modes.basis.shape == (6, sixbar.mobility)
    values = np.linalg.eigvals(modes.a)
    for value in modes.eigenvalue:
        assert np.abs(values - value).min() < 1e-6 * np.abs(values).max()


def test_a_noisy_swing_gives_its_parameters(pendulum: lamc.Model) -> None:
    k, b, noise = 2e-4, 3e-6, 2e-3
    t = np.linspace(0.0, 1.0, 401)
    # A damped swing in closed form, released from rest.
    decay, frequency = b / (2 * INERTIA), np.sqrt(k / INERTIA - (b / (2 * INERTIA)) ** 2)
    swing = 0.4 * np.exp(-decay * t) * (np.cos(frequency * t) + decay / frequency * np.sin(frequency * t))
    seen = swing + noise * np.random.default_rng(3).standard_normal(len(t))
    fit = pendulum.with_(k=1e-4, b=1e-6).fit(t, {"hinge": seen}, ["k", "b"], from_rest=True)
    for name, value in (("k", k), ("b", b)):
        assert abs(fit.parameters[name] - value) < 4 * fit.standard_error[name]
        assert fit.standard_error[name] < 0.02 * value
    assert_allclose(fit.rms, noise, rtol=0.1)
    assert_allclose(fit.q[:, 0], swing, atol=1e-3)
    assert fit.model.parameters == fit.parameters
    with pytest.raises(lamc.Error, match="no parameter is called `mass`"):
        pendulum.fit(t, {"hinge": seen}, ["mass"])


def test_errors_show_the_line() -> None:
    wrong = json.loads(json.dumps(PENDULUM))
    wrong["joints"]["hinge"]["bodies"] = ["base", "rodd"]
    with pytest.raises(lamc.Error, match=r"(?s)rodd.*\^"):
        lamc.load(wrong)
    with pytest.raises(lamc.Error, match="no-such-file"):
        lamc.load("no-such-file.yaml")
    with pytest.raises(lamc.Error, match="no parameter or input is called `nosuch`"):
        lamc.load(PENDULUM).with_(nosuch=1.0)


def test_arguments_that_do_not_fit(pendulum: lamc.Model) -> None:
    with pytest.raises(lamc.Error, match=r"`q` has the shape \(2,\)"):
        pendulum.acceleration([0.0, 1.0])
    with pytest.raises(lamc.Error, match="there is no input `engine`"):
        pendulum.simulate(0.1, inputs={"engine": 1.0})
    with pytest.raises(lamc.Error, match="a value for each sample"):
        pendulum.simulate(0.1, inputs={"motor": [1.0, 2.0]})
    with pytest.raises(lamc.Error, match="there is no joint 'knee'"):
        pendulum.assemble({"knee": 0.0})
    with pytest.raises(lamc.Error, match="state 1: "):
        pendulum.acceleration([[0.0], [np.nan]])
    with pytest.raises(lamc.Error, match="duration"):
        pendulum.simulate(-1.0)
    with pytest.raises(lamc.Error, match="the numbers of states differ: `q` 3, `t` 4"):
        pendulum.acceleration(np.zeros((3, 1)), t=np.zeros(4))
    with pytest.raises(lamc.Error, match="between 0 and 1"):
        pendulum.simulate(0.1, restitution=2.0)
    with pytest.raises(lamc.Error, match="whole number from 1 on"):
        pendulum.step([0.0], [0.0], 1e-3, steps=0)
    motion = pendulum.simulate(0.1)
    for size in ((2**62, 2), (8, 8)):
        with pytest.raises(lamc.Error, match="16 to 4096"):
            motion.animate("x.png", size=size)
    with pytest.raises(lamc.Error, match="samples are too many: lamc keeps at most"):
        pendulum.simulate(1.0, rate=1e9)
    for speed in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(lamc.Error, match="positive number"):
            motion.animate("x.mp4", speed=speed)


def test_numbers_that_no_robot_has(pendulum: lamc.Model) -> None:
    for number in (np.nan, np.inf, -np.inf):
        with pytest.raises(lamc.Error, match="not finite"):
            pendulum.acceleration([number])
        with pytest.raises(lamc.Error, match="not finite"):
            pendulum.step([0.0], [number], 1e-3)
    rest = pendulum.acceleration([0.0])
    assert pendulum.acceleration([5e-324]) == rest
    turns = 2 * np.pi * 1e8
    assert np.isfinite(pendulum.acceleration([turns])).all()
    for turned, straight in zip(pendulum.poses([turns]), pendulum.poses([0.0]), strict=True):
        assert np.allclose(turned, straight, atol=1e-7)


def test_samples_end_once(pendulum: lamc.Model) -> None:
    for duration, rate in ((0.07, 100), (0.55, 100), (0.14, 50), (0.3, 10), (0.105, 100)):
        t = pendulum.simulate(duration, rate, inputs={"motor": 0.0}).t
        assert (np.diff(t) > 1e-6).all() and t[-1] == duration


def test_no_states(pendulum: lamc.Model, sixbar: lamc.Model) -> None:
    none = np.zeros((0, 6))
    assert sixbar.acceleration(none).shape == (0, 6)
    found = sixbar.equations(none)
    rows = sixbar.equations(sixbar.assemble()[0]).gamma.shape[0]
    assert found.jacobian.shape == (0, rows, 6) and found.gamma.shape == (0, rows)


def test_a_motor_that_drives_a_joint() -> None:
    driven = json.loads(json.dumps(PENDULUM))
    driven["joints"]["hinge"] = {
        "bodies": ["base", "rod"],
        "axis": [[0, 0], [1, 0]],
        "drive": "0.5*sin(10*t)",
    }
    driven["inputs"], driven["parameters"] = [], {}
    model = lamc.load(driven)
    t = np.linspace(0, 1, 11)
    q, u = 0.5 * np.sin(10 * t)[:, None], 5 * np.cos(10 * t)[:, None]
    torque = model.motor_torques(q, u, t)
    assert model.driven == ["hinge"] and torque.shape == (11, 1)
    assert_allclose(torque, -INERTIA * 50 * np.sin(10 * t)[:, None], atol=1e-15)
    with pytest.raises(lamc.Error, match="is driven"):
        model.assemble({"hinge": 0.3})


def test_damaged_bytes_are_refused(pendulum: lamc.Model) -> None:
    derived = bytearray(pendulum._native.to_bytes())
    derived[len(derived) // 2] ^= 1
    with pytest.raises(lamc.Error, match="checksum"):
        lamc._lamc.Program(bytes(derived))


def test_a_pickled_model_needs_nothing_else(sixbar: lamc.Model, tmp_path: Path) -> None:
    k = next(iter(sixbar.parameters), None)
    changed = sixbar.with_(**{k: 2 * sixbar.parameters[k]}) if k else sixbar
    (tmp_path / "model").write_bytes(pickle.dumps(changed))
    # In a process that has neither a home, nor the command, nor the file.
    program = (
        "import pickle, pathlib, lamc._command as c; c.path = None; "
        f"m = pickle.loads(pathlib.Path({str(tmp_path / 'model')!r}).read_bytes()); "
        "print(m.acceleration(m.assemble()[0]).tolist(), m.parameters)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env={}, capture_output=True, text=True, check=True
    )
    expected = changed.acceleration(changed.assemble()[0]).tolist()
    assert done.stdout.strip() == f"{expected} {changed.parameters}"


def test_threads(sixbar: lamc.Model) -> None:
    q, u = sixbar.assemble()
    expected = sixbar.acceleration(np.tile(q, (2000, 1)))
    results: list[np.ndarray] = []
    threads = [
        threading.Thread(target=lambda: results.append(sixbar.acceleration(np.tile(q, (2000, 1)))))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 4 and all((result == expected).all() for result in results)


def test_tables_pictures_and_pages(pendulum: lamc.Model, tmp_path: Path) -> None:
    motion = pendulum.with_(k=2e-4).simulate(0.2, 50, initial={"hinge": 0.3})
    table = motion.to_pandas()
    assert_allclose(table["q.hinge"], motion.q[:, 0])
    assert_allclose(table["point.tip.y"], motion.points[:, 0, 1])
    dataset = motion.to_xarray()
    assert_allclose(dataset.q.sel(joint="hinge"), motion.q[:, 0])
    assert len(motion.plot()) == 3
    for shown in (motion._repr_html_(), pendulum._repr_html_()):
        assert shown.startswith("<iframe srcdoc=") and "http://" not in shown.split("srcdoc")[0]
    assert motion.animate(tmp_path / "m.mp4", size=(64, 48)).read_bytes()[4:8] == b"ftyp"
    assert motion.animate(tmp_path / "m.png", size=(64, 48)).read_bytes().startswith(b"\x89PNG")
    assert "<canvas" in motion.animate(tmp_path / "m.html").read_text()
    motion.write_csv(tmp_path / "m.csv")
    rows = np.genfromtxt(tmp_path / "m.csv", delimiter=",", names=True)
    assert len(rows) == len(motion)
    motion.write_npz(tmp_path / "m.npz")
    assert_allclose(np.load(tmp_path / "m.npz")["q"], motion.q)


def test_files_are_those_of_the_command(sixbar: lamc.Model, tmp_path: Path) -> None:
    sixbar.write_rust(tmp_path / "a.rs")
    sixbar.write_c(tmp_path / "a.c")
    sixbar.write_fmu(tmp_path / "a.fmu", version=3)
    b = tmp_path / "b"
    b.mkdir()
    model = str(ROOT / "examples/sixbar.yaml")
    _command.run([model, "-o", str(b / "a.rs"), "--c", str(b / "a.c"), "--header", str(b / "a.h")])
    _command.run([model, "--fmu", str(b / "a.fmu"), "--fmi", "3"])
    for name in ("a.rs", "a.c", "a.h", "a.fmu"):
        assert (tmp_path / name).read_bytes() == (b / name).read_bytes(), name


def test_a_simulation_that_ends_early_keeps_what_it_has() -> None:
    falling = json.loads(json.dumps(PENDULUM))
    # Its torque becomes infinite at t = 0.1 s.
    falling["joints"]["hinge"]["torque"] = "1e-6/(t - 0.1)"
    falling["inputs"] = []
    model = lamc.load(falling)
    with pytest.raises(lamc.SimulationError) as raised:
        model.simulate(0.5)
    motion = raised.value.motion
    assert not motion.complete and 0 < len(motion) <= 11


def test_the_extension_has_no_symbolic_engine() -> None:
    native = Path(lamc._lamc.__file__).read_bytes()
    assert b"symbolica" not in native
    assert b"symbolica" in _command.path().read_bytes()
