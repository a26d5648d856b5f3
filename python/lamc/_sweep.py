"""Sweeps: many runs of one model, on this machine, on Ray or on Dask."""

from __future__ import annotations

import json
import os
import pickle
import re
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any

from . import _lamc
from ._arguments import number, whole
from ._model import Model, plain

Part = tuple[bytes, int, list[tuple[int, str]]]
Parts = Iterator[tuple[int, Part]]

#: Parts for each worker that are computed or wait: enough that none is idle, few enough to hold their results.
AHEAD = 3


@dataclass(frozen=True)
class Sweep:
    """The results of a sweep."""

    path: Path | None
    """The Parquet file; None if it was not to be kept."""
    runs: int
    """Runs in the file."""
    failures: dict[str, int] = field(default_factory=dict)
    """Of the runs that were computed now: reasons of failures, and how often each occurred."""
    _table: Any = field(default=None, repr=False)

    def to_arrow(self) -> Any:
        """Returns the rows as a ``pyarrow.Table``."""
        if self._table is not None:
            return self._table
        return _module("pyarrow.parquet", "tables").read_table(self.path)

    def to_pandas(self) -> Any:
        """Returns the rows as a ``pandas.DataFrame``, by the number of the run."""
        return self.to_arrow().to_pandas().set_index("run")


def sweep(
    model: Model,
    plan: str | os.PathLike[str] | Mapping[str, Any],
    out: str | os.PathLike[str] | None = None,
    *,
    initial: Mapping[str, float] | None = None,
    inputs: Any = None,
    resume: bool = False,
    shard: tuple[int, int] = (1, 1),
    engine: str = "local",
    workers: int | None = None,
    progress: bool | None = None,
) -> Sweep:
    """Simulates a model many times, as the command ``lamc sweep`` does, and with the same results.

    Args:
        model: The model. Its parameters are the values about which a plan may vary.
        plan: The path of a plan, its text (with at least one line break), or the same as a dictionary. Initial angles
            without a unit are in radians in a dictionary, else in the unit of the model, as for the command.
        out: The Parquet file. Finished parts are kept in a folder beside it until all are there. By default the rows
            are kept in memory only.
        initial: Guesses of initial angles by joint, rad, which the plan does not change.
        inputs: Inputs that are held and that the plan does not change, SI, by name or in the order of ``model.inputs``.
        resume: Whether to continue a sweep that was interrupted.
        shard: Which of how many equal pieces, counted from 1: (3, 100). Together they have the rows of the whole.
        engine: ``local`` (threads of this process), ``ray`` or ``dask``: the cluster to which this process is connected,
            else one on this machine.
        workers: Threads, or parts that a cluster computes at the same time. By default as many as there are cores.
        progress: Whether to write the progress to standard error. By default if that is a terminal.

    Raises:
        Error: The plan has mistakes, which the text shows with lines and carets; or the file cannot be written.
    """
    engines = {"local": _local, "ray": _ray, "dask": _dask}
    if engine not in engines:
        raise _lamc.Error(f"`engine` is `{engine}`, but must be one of {', '.join(engines)}")
    if workers is not None:
        workers = whole("workers", workers, 1)
    guess = dict(initial or {})
    arguments = (
        model,
        [number("inputs", value) for value in model._held(inputs)],
        [(k, number(joint, guess[joint])) for k, joint in zip(model._indices(guess), guess)],
        _text(plan),
        shard,
    )
    if out is None:
        parquet = _module("pyarrow.parquet", "tables")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "sweep.parquet"
            found = _run(arguments, file, False, engines[engine], workers, progress)
            return Sweep(None, found.runs, found.failures, parquet.read_table(file))
    return _run(arguments, Path(out), resume, engines[engine], workers, progress)


def _run(
    arguments: tuple[Any, ...],
    file: Path,
    resume: bool,
    engine: Callable[[tuple[Any, ...], _lamc.Sweep, list[int], int | None], Parts],
    workers: int | None,
    progress: bool | None,
) -> Sweep:
    native = _native(*arguments)
    store = native.open(file, resume)
    failures: Counter[str] = Counter()
    if store is not None:
        missing = store.missing()
        tally = _Tally(len(missing), sys.stderr.isatty() if progress is None else progress)
        for part, (rows, runs, failed) in engine(arguments, native, missing, workers):
            store.keep(part, rows)
            failures.update(re.sub(r"-?\d[\w.+-]*", "..", reason) for _, reason in failed)
            tally.add(runs, len(failed))
        tally.finish()
        store.join()
    return Sweep(file, native.runs, dict(failures))


def _native(
    model: Model,
    inputs: list[float],
    guess: list[tuple[int, float]],
    plan: tuple[str, str, bool],
    shard: tuple[int, int],
) -> _lamc.Sweep:
    return _lamc.Sweep(model._native, inputs, guess, plan, shard)


def _text(plan: str | os.PathLike[str] | Mapping[str, Any]) -> tuple[str, str, bool]:
    """The name of a plan, for messages, its text, and whether its angles without a unit are radians."""
    if isinstance(plan, Mapping):
        # JSON is YAML.
        try:
            return "plan", json.dumps(plan, indent=2, default=plain), True
        except (TypeError, ValueError) as mistake:
            raise _lamc.Error(f"the dictionary is no plan: {mistake}") from None
    if isinstance(plan, str) and "\n" in plan:
        return "plan", plan, False
    try:
        return os.fspath(plan), Path(plan).read_text(encoding="utf-8"), False
    except OSError as reason:
        raise _lamc.Error(f"cannot read {os.fspath(plan)}: {reason.strerror}") from None


class _Tally:
    """Says how far it is and how long it takes yet."""

    def __init__(self, parts: int, is_told: bool) -> None:
        self.parts, self.is_told = parts, is_told
        self.done = self.runs = self.failed = 0
        self.begin = time.monotonic()

    def add(self, runs: int, failed: int) -> None:
        self.done, self.runs, self.failed = self.done + 1, self.runs + runs, self.failed + failed
        if self.is_told:
            left = (time.monotonic() - self.begin) / self.done * (self.parts - self.done)
            text = f"{self.runs} runs, {self.failed} failed, {self.done} of {self.parts} parts, {left:.0f} s left"
            print(f"\r{text:<78}", end="", file=sys.stderr, flush=True)

    def finish(self) -> None:
        if self.is_told:
            print(file=sys.stderr)


# -- engines: each computes parts, in any order, and holds few results at a time ---------------------------------------


def _local(
    _: tuple[Any, ...], native: _lamc.Sweep, parts: list[int], workers: int | None
) -> Parts:
    count = workers or _cores()
    waiting = iter(parts)
    with ThreadPoolExecutor(count) as pool:
        running = {pool.submit(native.part, part): part for part in islice(waiting, count * AHEAD)}
        try:
            while running:
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    part, result = running.pop(future), future.result()
                    if result is not None:
                        yield part, result
                    for following in islice(waiting, 1):
                        running[pool.submit(native.part, following)] = following
        except BaseException:
            # Else the pool waits for parts that nobody wants any more.
            native.interrupt()
            for future in running:
                future.cancel()
            raise


def _module(name: str, extra: str) -> Any:
    """A package that is loaded when it is needed."""
    try:
        return import_module(name)
    except ImportError:
        raise _lamc.Error(f"this needs the package `{name}`: pip install 'lamc[{extra}]'") from None


def _cores() -> int:
    """The cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _ray(
    arguments: tuple[Any, ...], _: _lamc.Sweep, parts: list[int], workers: int | None
) -> Parts:
    ray = _module("ray", "ray")
    if not ray.is_initialized():
        ray.init(num_cpus=workers, include_dashboard=False, log_to_driver=False)
    # Once into the object store; each process of Ray takes it from there and prepares the model once.
    shipped = ray.put(pickle.dumps(arguments))
    compute = ray.remote(num_cpus=1)(_part)
    ahead = AHEAD * (workers or int(ray.cluster_resources().get("CPU", 1)))
    waiting = iter(parts)
    running = {compute.remote(shipped, part): part for part in islice(waiting, ahead)}
    try:
        while running:
            [done], _rest = ray.wait(list(running), num_returns=1)
            yield running.pop(done), ray.get(done)
            for following in islice(waiting, 1):
                running[compute.remote(shipped, following)] = following
    finally:
        for task in running:
            ray.cancel(task)


def _dask(
    arguments: tuple[Any, ...], _: _lamc.Sweep, parts: list[int], workers: int | None
) -> Parts:
    distributed = _module("distributed", "dask")
    try:
        client, ours = distributed.get_client(), False
    except ValueError:
        client, ours = distributed.Client(n_workers=workers, threads_per_worker=1), True
    # The result of a task, which a cluster computes again if the worker that has it is lost.
    shipped = client.submit(bytes, pickle.dumps(arguments), pure=False)
    ahead = AHEAD * (workers or sum(client.nthreads().values()))
    waiting = iter(parts)

    def submit(part: int) -> Any:
        return client.submit(_part, shipped, part, key=f"lamc-{id(arguments)}-{part}", retries=3)

    running = {submit(part): part for part in islice(waiting, ahead)}
    try:
        completed = distributed.as_completed(list(running))
        for future in completed:
            yield running.pop(future), future.result()
            for following in islice(waiting, 1):
                task = submit(following)
                running[task] = following
                completed.add(task)
    finally:
        client.cancel(list(running))
        if ours:
            client.close()


def _part(shipped: bytes, part: int) -> Part:
    """Computes a part in a process of a cluster."""
    result = _shipped(shipped).part(part)
    assert result is not None, "nobody interrupts"
    return result


@lru_cache(maxsize=2)
def _shipped(shipped: bytes) -> _lamc.Sweep:
    return _native(*pickle.loads(shipped))
