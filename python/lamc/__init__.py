"""Motion of laminate robots: models compiled to machine code, simulated from NumPy.

>>> import lamc
>>> model = lamc.load("examples/sixbar.yaml")
>>> motion = model.simulate(duration=0.5)
>>> motion.q.shape
(51, 6)

All numbers are in SI units and radians.
"""

from importlib.metadata import version

from ._lamc import Error
from ._model import Equilibrium, Equations, Fit, Jacobian, Model, Modes, load
from ._motion import Motion, SimulationError
from ._sweep import Sweep, sweep

__version__ = version("lamc")

__all__ = [
    "Equations",
    "Equilibrium",
    "Error",
    "Fit",
    "Jacobian",
    "Model",
    "Modes",
    "Motion",
    "SimulationError",
    "Sweep",
    "load",
    "sweep",
]
