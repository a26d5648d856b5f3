"""Free bodies: a plate that falls, turns and rests."""

import pickle

import numpy as np
import pytest

import lamc

PLATE = {
    "name": "plate",
    "units": {"length": "mm"},
    "materials": {"card": {"density": 700, "thickness": 0.4}},
    "layup": ["card"],
    "bodies": {"hull": {"free": True, "outline": [[0, 0], [40, 0], [40, 20], [0, 20]]}},
    "points": {"corner": {"body": "hull", "at": [0, 0, 0]}},
}
MASS = 700 * 0.04 * 0.02 * 0.0004
STIFFNESS = 50.0
STANDING = PLATE | {
    "contacts": {
        "ground": {
            "plane": {"point": [0, 0, -20], "normal": [0, 0, 1]},
            "stiffness": f"{STIFFNESS} N/m",
            "friction": 0,
        }
    },
    "initial": {"bodies": {"hull": {"position": [0, 0, 5], "turn": [0, "20 deg", 0.5]}}},
}


@pytest.fixture(scope="module")
def plate() -> lamc.Model:
    return lamc.load(PLATE)


def test_names_and_shapes(plate: lamc.Model) -> None:
    assert (plate.joints, plate.free_bodies) == ([], ["hull"])
    assert plate.coordinates[0] == "hull.x" and plate.coordinates[3] == "hull.qw"
    assert plate.speeds == [f"hull.{part}" for part in ("vx", "vy", "vz", "wx", "wy", "wz")]
    q, u = plate.assemble()
    assert q.tolist() == [0, 0, 0, 1, 0, 0, 0] and u.shape == (6,)
    assert plate.equations(q, u).mass.shape == (6, 6)
    assert plate.jacobian(np.tile(q, (3, 1)), u).dq.shape == (3, 6, 6)
    assert "1 free body" in repr(plate)
    with pytest.raises(lamc.Error, match=r"`u` has the shape \(7,\), not \(6,\)"):
        plate.acceleration(q, np.zeros(7))


def test_a_thrown_plate(plate: lamc.Model) -> None:
    q, _ = plate.assemble()
    u = np.array([0.3, -0.2, 1.0, 4.0, -30.0, 7.0])
    motion = plate.simulate(0.5, state=(q, u), tolerance=1e-11)
    t = motion.t
    fallen = np.outer(t, u[:3])
    fallen[:, 2] -= 9.81 / 2 * t**2
    assert np.abs(motion.q[:, :3] - fallen).max() < 1e-9
    assert np.abs(np.linalg.norm(motion.q[:, 3:], axis=1) - 1).max() < 1e-12
    momentum = plate.momentum(motion.q, motion.u)
    assert np.abs(momentum[:, 1] - MASS * motion.u[:, :3]).max() < 1e-12
    turning = momentum[:, 2]
    assert np.abs(turning - turning[0]).max() < 1e-8 * np.linalg.norm(turning[0])
    # The corner lies where the quaternion turns it.
    w, vector = motion.q[-1, 3], motion.q[-1, 4:]
    middle = np.array([0.02, 0.01, 0.0002])
    arm = -middle
    turned = arm + 2 * np.cross(vector, np.cross(vector, arm) + w * arm)
    corner = motion.points[-1, 0] - motion.q[-1, :3]
    assert np.abs(corner - turned - middle).max() < 1e-12
    again = pickle.loads(pickle.dumps(motion))
    assert np.array_equal(again.q, motion.q) and np.array_equal(again.u, motion.u)
    stepped, _ = plate.step(q, u, 1e-4, steps=5000)
    assert np.abs(stepped - motion.q[-1]).max() < 1e-8
    assert list(motion.to_pandas().columns)[:1] == ["q.hull.x"]
    assert motion.to_xarray()["q"].dims == ("t", "coordinate")


def test_momentum_needs_a_free_body(pendulum: lamc.Model) -> None:
    with pytest.raises(lamc.Error, match="free body"):
        pendulum.momentum([0.0], [0.0])


def test_a_plate_that_stands() -> None:
    model = lamc.load(STANDING)
    modes = model.modes()
    rest = modes.equilibrium
    assert rest.neutral and not rest.stable and rest.dynamically_stable
    weight = MASS * 9.81
    # The lower face, which is drawn at z = 0, sinks in at four corners.
    assert rest.q[2] == pytest.approx(-0.02 - weight / (4 * STIFFNESS), abs=1e-9)
    turn = rest.q[3:]
    assert turn[1] == pytest.approx(0, abs=1e-9) and turn[2] == pytest.approx(0, abs=1e-9)
    heave = np.sqrt(4 * STIFFNESS / MASS)
    inertia = MASS * (np.array([0.02, 0.04]) ** 2 + 0.0004**2) / 12
    # The corners lie below the centre of mass: the weight makes the plate a little softer.
    stiffness = 4 * STIFFNESS * np.array([0.01, 0.02]) ** 2 - weight * 0.0002
    expected = np.sort([heave, *np.sqrt(stiffness / inertia)]) / (2 * np.pi)
    # That it slides and turns along the ground is no mode.
    assert np.sort(modes.frequency) == pytest.approx(expected, rel=1e-6)


def test_a_thrown_plate_gives_gravity() -> None:
    model = lamc.load(PLATE | {"parameters": {"g": 5.0}, "gravity": [0, 0, "-g"]})
    t = np.linspace(0.0, 0.3, 61)
    half = 0.4 + 3.5 * t
    # A plate that spins about its normal, in closed form; the sign of a quaternion is arbitrary.
    sign = np.where(t > 0.1, -1.0, 1.0)
    nothing = np.zeros_like(t)
    pose = {
        "hull.z": 2.0 * t - 9.81 / 2 * t**2,
        "hull.qw": sign * np.cos(half),
        "hull.qx": nothing,
        "hull.qy": nothing,
        "hull.qz": sign * np.sin(half),
    }
    fit = model.fit(t, pose, ["g"])
    assert fit.parameters["g"] == pytest.approx(9.81, rel=1e-9)
    assert fit.rms < 1e-9 and fit.q.shape == (61, 7)
    assert fit.kept == ["hull.vx", "hull.vy"]
    assert np.abs(fit.q[:, 2] - pose["hull.z"]).max() < 1e-9
    with pytest.raises(lamc.Error, match="no unit quaternion"):
        model.fit(t, pose | {"hull.qw": 2 * pose["hull.qw"]}, ["g"])
    with pytest.raises(lamc.Error, match=r"there is no coordinate 'hull.w'; there are hull.x"):
        model.fit(t, {"hull.w": nothing}, ["g"])


def test_a_sweep_of_throws(tmp_path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    model = lamc.load(PLATE | {"parameters": {"g": 9.81}, "gravity": [0, 0, "-g"]})
    plan = {"grid": {"g": {"from": 1.0, "to": 2.0, "count": 2}}, "duration": 0.5, "record": ["end"]}
    lamc.sweep(model, plan, tmp_path / "thrown.parquet")
    table = parquet.read_table(tmp_path / "thrown.parquet").to_pydict()
    assert table["q.hull.z"] == pytest.approx([-0.125, -0.25], abs=1e-9)
    assert table["u.hull.vz"] == pytest.approx([-0.5, -1.0], abs=1e-9)
