"""The code of the guide runs."""

import re
from pathlib import Path
from typing import Any

import control
import gymnasium
import numpy as np
import pytest

from lamc import _command

ROOT = Path(__file__).parents[2]


def run(page: str, until: str | None, least: int) -> dict[str, Any]:
    """Runs the blocks of a page, and returns what they define."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text[: until and text.index(until)], re.MULTILINE | re.DOTALL)
    assert len(blocks) >= least
    names: dict[str, Any] = {}
    for block in blocks:
        exec(compile(block, f"docs/{page}", "exec"), names)
    return names


def test_the_code_of_the_guide_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (ROOT / "target").mkdir(exist_ok=True)
    # What follows is about another module.
    names = run("PYTHON.md", until="## Without the package", least=7)
    # What the page says of it.
    assert repr(names["model"]) == "<lamc.Model sixbar: 6 joints, 1 loop, mobility 3>"
    held, played = names["held"], names["played"]
    assert abs(held.q - played.q).max() < 1e-9
    check_events(names)
    check_plant(names)
    check_environments(names)
    check_swing_up(names)


def check_events(names: dict[str, Any]) -> None:
    """Turns of a damped swing are a period apart, and shrink as the exponential says."""
    turns = names["damped"].events[0]
    inertia, k, b = 3e-7 + 0.002 * 0.02**2, 2e-4, 2e-6
    decay = b / (2 * inertia)
    period = 2 * np.pi / np.sqrt(k / inertia - decay**2)
    np.testing.assert_allclose(np.diff(turns.t), period, rtol=1e-6)
    np.testing.assert_allclose(turns.q[:, 0], 0.5 * np.exp(-decay * turns.t), rtol=1e-5)


def check_swing_up(names: dict[str, Any]) -> None:
    """The rod comes to rest where it should, and the work of its torques is the height that it gains and what the damper takes."""
    torques = names["found"].x
    course = names["rod"].course(0.5, 100, state=([0.0], [0.0]), inputs=np.append(torques, 0)[:, None], steps=4)
    assert names["found"].success and abs(course.q[-1, 0] - 2.0) < 0.05 and abs(course.u[-1, 0]) < 1.0
    given = (torques * np.diff(course.q[:, 0])).sum()
    kinetic, potential = (names["rod"].energy(course.q[[0, -1]], course.u[[0, -1]])).T
    stored = kinetic[1] - kinetic[0] + potential[1] - potential[0]
    taken = 1e-6 * np.trapezoid(course.u[:, 0] ** 2, course.t)
    np.testing.assert_allclose(given, stored + taken, rtol=1e-2)


def check_plant(names: dict[str, Any]) -> None:
    """python-control finds the gain and the frequency of a torsional pendulum."""
    plant = names["plant"]
    assert isinstance(plant, control.StateSpace)
    np.testing.assert_allclose(plant.dcgain(), 1 / 2e-4, rtol=1e-9)
    frequencies, _, _ = control.damp(plant, doprint=False)
    np.testing.assert_allclose(frequencies, np.sqrt(2e-4 / (3e-7 + 0.002 * 0.02**2)), rtol=1e-9)
    assert (names["poles"].real < 0).all()


def check_environments(names: dict[str, Any]) -> None:
    """gymnasium's own wrapper counts episodes; the environments keep its rules."""
    environments = names["Legs"](names["leg"], num_envs=50)
    assert isinstance(environments, gymnasium.vector.VectorEnv)
    legs = gymnasium.wrappers.vector.RecordEpisodeStatistics(environments)
    first, _ = legs.reset(seed=3)
    again, _ = legs.reset(seed=3)
    assert (first == again).all() and legs.observation_space.contains(first)
    actions = 0.5 * legs.action_space.sample()
    for _ in range(environments.longest):
        seen, rewards, terminations, truncations, infos = legs.step(actions)
        assert legs.observation_space.contains(seen) and rewards.shape == (50,)
        assert not terminations.any()
    # All are as long as they may be, and begin again with the next step.
    assert truncations.all() and (infos["episode"]["l"] == environments.longest).all()
    seen, rewards, _, truncations, _ = legs.step(actions)
    assert not truncations.any() and (rewards == 0).all()
    assert (abs(seen[:, 0]) <= 0.1).all() and (seen[:, 1] == 0).all()
    # The controller of the page reaches 1 rad: in the last 50 of its 250 steps they swing for the second time.
    assert abs(names["observations"][:, 0] - 1.0).max() < 0.05


def test_the_code_about_sweeps_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (ROOT / "target").mkdir(exist_ok=True)
    for name in ("tolerances.parquet", "sweep.parquet"):
        (ROOT / "target" / name).unlink(missing_ok=True)
    model, plan = "examples/sixbar_markers.yaml", "examples/sweep/tolerances.yaml"
    _command.run(["sweep", model, plan, "--output=target/tolerances.parquet"])
    names = run("SWEEPS.md", until=None, least=2)
    rows = names["rows"]
    # Sobol's 64 points of a normal distribution with a deviation of 5 %.
    assert abs(rows.k.std() / (0.05 * 0.0114) - 1) < 0.1
