"""Motion of laminate robots: models compiled to machine code, simulated from NumPy.

>>> import lamc
>>> model = lamc.load("examples/sixbar.yaml")
>>> motion = model.simulate(duration=0.5)
>>> motion.q.shape
(51, 6)

All numbers are in SI units and radians.
"""

from importlib.metadata import version

from ._course import Course, Gradient
from ._events import Crossings, Event
from ._lamc import Error
from ._model import Model, load
from ._motion import Motion, SimulationError
from ._results import Control, Equations, Equilibrium, Fit, Jacobian, Modes
from ._sweep import Sweep, sweep

__version__ = version("lamc")

__all__ = [
    "Control",
    "Course",
    "Crossings",
    "Equations",
    "Equilibrium",
    "Error",
    "Event",
    "Fit",
    "Gradient",
    "Jacobian",
    "Model",
    "Modes",
    "Motion",
    "SimulationError",
    "Sweep",
    "load",
    "sweep",
]
