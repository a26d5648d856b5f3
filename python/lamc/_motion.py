"""Recorded motions."""

from __future__ import annotations

import html
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _lamc
from ._arguments import count, names, number, whole
from ._events import Crossings

if TYPE_CHECKING:
    import pandas
    import xarray

    from matplotlib.axes import Axes

    from ._model import Model

Array = NDArray[np.float64]


class SimulationError(_lamc.Error):
    """A simulation ended early.

    Attributes:
        motion: What was recorded until then.
    """

    def __init__(self, reason: str, motion: Motion) -> None:
        super().__init__(reason)
        self.motion = motion

    def __reduce__(self) -> tuple[Any, ...]:
        return SimulationError, (str(self), self.motion)


class Motion:
    """A recorded motion: S samples of N joints.

    In a notebook it shows itself as a viewer in which it can be played and turned; the viewer needs no
    network. It can be pickled.
    """

    def __init__(self, native: _lamc.Motion, model: Model) -> None:
        self._native = native
        self.model = model
        """The model that moved."""

    @cached_property
    def _arrays(self) -> dict[str, Array]:
        return dict(self._native.arrays())

    def _shaped(self, name: str, *shape: int) -> Array:
        # NumPy finds no -1 where a part has no numbers.
        return self._arrays[name].reshape(len(self), *shape)

    def __len__(self) -> int:
        """The number of samples."""
        return len(self._arrays["t"])

    @property
    def t(self) -> Array:
        """Times (S), s."""
        return self._arrays["t"]

    @property
    def q(self) -> Array:
        """Coordinates (S, NQ): angles of the joints, rad, then those of free bodies (:class:`Model`)."""
        return self._shaped("q", len(self.model.coordinates))

    @property
    def u(self) -> Array:
        """Speeds (S, NU): of the joints, rad/s, then of free bodies."""
        return self._shaped("u", len(self.model.speeds))

    @property
    def acceleration(self) -> Array:
        """du/dt (S, NU)."""
        return self._shaped("acceleration", len(self.model.speeds))

    @property
    def kinetic_energy(self) -> Array:
        """Kinetic energy (S), J."""
        return self._arrays["kinetic"]

    @property
    def potential_energy(self) -> Array:
        """Potential energy of gravity and springs (S), J."""
        return self._arrays["potential"]

    @property
    def closure(self) -> Array:
        """The largest component by which a loop is open (S), m."""
        return self._arrays["closure"]

    @property
    def points(self) -> Array:
        """Named points in the base frame (S, points, 3), m."""
        return self._shaped("points", len(self.model.points), 3)

    @property
    def contacts(self) -> Array:
        """Contact points and the forces on their bodies in the base frame (S, K, 6), m and N."""
        return self._shaped("contacts", len(self.model.contact_points), 6)

    @property
    def tensions(self) -> Array:
        """Tensions of the springs between points, then of the tendons, in the order of the file (S, L), N."""
        tensions = self._arrays["tensions"]
        return tensions.reshape(len(self), len(tensions) // max(1, len(self)))

    @property
    def rotation(self) -> Array:
        """Rotation matrices of the bodies (S, bodies, 3, 3): a point drawn at x lies at R x + p."""
        poses = self._shaped("poses", len(self.model.bodies), 12)
        return poses[..., :9].reshape(len(self), len(self.model.bodies), 3, 3)

    @property
    def translation(self) -> Array:
        """Where the origin of the drawing lies on each body (S, bodies, 3), m."""
        return self._shaped("poses", len(self.model.bodies), 12)[..., 9:]

    @property
    def inputs(self) -> Array:
        """The inputs that were held from each sample on (S, inputs), SI."""
        return self._shaped("inputs", len(self.model.inputs))

    @property
    def complete(self) -> bool:
        """Whether the intended end was reached: the duration, or an event that ends the motion."""
        return self._native.complete

    @property
    def events(self) -> list[Crossings]:
        """For each of the ``events`` of :meth:`Model.simulate`, in their order, when its function changed its sign."""
        n, m = len(self.model.coordinates), len(self.model.speeds)
        return [
            Crossings(t, q.reshape(len(t), n), u.reshape(len(t), m)) for t, q, u in self._native.events()
        ]

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a table by time with the columns ``q.joint``, ``u.joint``, ``point.name.x``, ``input.name``,
        ``kinetic_energy`` and ``potential_energy``; of free bodies ``q.body.x`` and so on (:attr:`Model.coordinates`)."""
        import pandas

        model = self.model
        columns: dict[str, Array] = {f"q.{name}": self.q[:, k] for k, name in enumerate(model.coordinates)}
        columns.update({f"u.{name}": self.u[:, k] for k, name in enumerate(model.speeds)})
        for k, name in enumerate(self.model.points):
            columns.update(
                {f"point.{name}.{axis}": self.points[:, k, i] for i, axis in enumerate("xyz")}
            )
        columns.update({f"input.{name}": self.inputs[:, k] for k, name in enumerate(self.model.inputs)})
        columns["kinetic_energy"] = self.kinetic_energy
        columns["potential_energy"] = self.potential_energy
        return pandas.DataFrame(columns, index=pandas.Index(self.t, name="t"))

    def to_xarray(self) -> xarray.Dataset:
        """Returns a dataset with the dimensions ``t``, ``joint``, ``point``, ``body`` and ``input``. With free bodies, ``q``
        has the dimension ``coordinate``, and ``u`` and ``acceleration`` have ``speed``, in place of ``joint``."""
        import xarray

        model = self.model
        of_q, of_u = ("coordinate", "speed") if model.free_bodies else ("joint", "joint")
        # Free bodies have other units, too.
        angles = {} if model.free_bodies else {"units": "rad"}
        rates = {} if model.free_bodies else {"units": "rad/s"}
        seconds = {} if model.free_bodies else {"units": "rad/s^2"}
        return xarray.Dataset(
            {
                "q": (("t", of_q), self.q, angles),
                "u": (("t", of_u), self.u, rates),
                "acceleration": (("t", of_u), self.acceleration, seconds),
                "points": (("t", "point", "axis"), self.points, {"units": "m"}),
                "rotation": (("t", "body", "row", "column"), self.rotation),
                "translation": (("t", "body", "axis"), self.translation, {"units": "m"}),
                "inputs": (("t", "input"), self.inputs),
                "kinetic_energy": ("t", self.kinetic_energy, {"units": "J"}),
                "potential_energy": ("t", self.potential_energy, {"units": "J"}),
                "closure": ("t", self.closure, {"units": "m"}),
            },
            coords={
                "t": ("t", self.t, {"units": "s"}),
                of_q: model.coordinates,
                of_u: model.speeds,
                "point": model.points,
                "body": model.bodies,
                "input": model.inputs,
                "axis": ["x", "y", "z"],
            },
            attrs={"model": self.model.name},
        )

    def plot(self, joints: Sequence[str] | None = None) -> tuple[Axes, Axes, Axes]:
        """Draws angles, speeds and energies over time, with pyplot.

        Args:
            joints: Joints to draw. By default all.

        Returns:
            The three axes; ``axes[0].figure.savefig(..)`` writes them.
        """
        import matplotlib.pyplot as plt

        chosen = self.model._indices(self.model.joints if joints is None else names(joints))
        _, (angles, speeds, energies) = plt.subplots(
            3, sharex=True, figsize=(7, 7), layout="constrained"
        )
        for k in chosen:
            angles.plot(self.t, np.degrees(self.q[:, k]), label=self.model.joints[k])
            speeds.plot(self.t, np.degrees(self.u[:, k]))
        energies.plot(self.t, self.kinetic_energy, label="kinetic")
        energies.plot(self.t, self.potential_energy, label="potential")
        energies.plot(self.t, self.kinetic_energy + self.potential_energy, "k", lw=0.8, label="both")
        angles.set_ylabel("angle, deg")
        speeds.set_ylabel("speed, deg/s")
        energies.set_ylabel("energy, J")
        energies.set_xlabel("time, s")
        if len(chosen) <= 12:
            angles.legend(ncols=2)
        energies.legend()
        return angles, speeds, energies

    def html(self) -> str:
        """Returns the viewer as one HTML page that needs nothing else."""
        return self._native.html()

    def animate(self, path: str | Path, speed: float = 1.0, size: tuple[int, int] = (800, 600)) -> Path:
        """Writes the motion for people to see.

        Args:
            path: ``.mp4``: a video; ``.html``: the viewer; ``.png``: the end of the motion.
            speed: How fast the video plays; 1 is real time.
            size: Width and height of pictures, pixels; even for a video.

        Returns:
            The path.
        """
        path, speed = Path(path), number("speed", speed)
        match path.suffix.lower():
            case ".mp4":
                path.write_bytes(self._native.mp4(speed, _pixels(size)))
            case ".png":
                path.write_bytes(self._native.png(self.t[-1], _pixels(size)))
            case ".html":
                path.write_text(self.html(), encoding="utf-8")
            case other:
                raise _lamc.Error(f"`{other}` is not one of .mp4, .png, .html")
        return path

    def write_csv(self, path: str | Path) -> None:
        """Writes the table that ``lamc simulate --csv`` writes."""
        Path(path).write_text(self._native.csv(), encoding="utf-8")

    def write_npz(self, path: str | Path) -> None:
        """Writes the archive that ``lamc simulate --npz`` writes."""
        Path(path).write_bytes(self._native.npz())

    def __repr__(self) -> str:
        explicit, implicit = self._native.steps
        ended = "" if self.complete else ", ended early"
        last = self.t[-1] if len(self) else 0.0
        return (
            f"<lamc.Motion of {self.model.name}: {count(len(self), 'sample')} to {last:g} s, "
            f"{count(explicit + implicit, 'step')}{ended}>"
        )

    def _repr_html_(self) -> str:
        return frame(self.html())

    def __reduce__(self) -> tuple[Any, ...]:
        events = [list(zip(*(column.tolist() for column in (it.t, it.q, it.u)))) for it in self.events]
        return _restored, (self.model, self._arrays, self.complete, self._native.steps, events)


def _restored(
    model: Model,
    arrays: dict[str, Array],
    complete: bool,
    steps: list[int],
    events: list[list[tuple[float, list[float], list[float]]]],
) -> Motion:
    return Motion(_lamc.Motion(model._native, arrays, complete, steps, events), model)


def _pixels(size: Any) -> tuple[int, int]:
    try:
        width, height = (min(whole("size", pixels), 2**31) for pixels in size)
    except (TypeError, ValueError):
        raise _lamc.Error("`size` must be two numbers of pixels, each 16 to 4096") from None
    return width, height


def frame(page: str) -> str:
    """Returns a page as a part of another."""
    return (
        f'<iframe srcdoc="{html.escape(page)}" style="width: 100%; height: 30em; border: 0" '
        'sandbox="allow-scripts"></iframe>'
    )
