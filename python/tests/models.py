"""Models of the tests."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
PENDULUM = {
    "name": "pendulum",
    "gravity": [0, 0, 0],
    "parameters": {"k": 0.0, "b": 0.0},
    "inputs": ["motor"],
    "bodies": {
        "base": {"fixed": True},
        "rod": {
            "mass": 0.002,
            "com": [0, -0.02, 0],
            "inertia": [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]],
        },
    },
    "joints": {
        "hinge": {
            "bodies": ["base", "rod"],
            "axis": [[0, 0], [1, 0]],
            "stiffness": "k",
            "damping": "b",
            "torque": "motor",
        }
    },
    "points": {"tip": {"body": "rod", "at": [0, -0.04, 0]}},
    "units": {"length": "m"},
}
# About the hinge, kg m^2.
INERTIA = 3e-7 + 0.002 * 0.02**2
