"""The command ``lamc`` that the wheel carries."""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import sys
import threading
from pathlib import Path
from typing import IO

from ._lamc import Error


def path() -> Path:
    """Returns the executable file."""
    name = "lamc.exe" if os.name == "nt" else "lamc"
    return Path(__file__).parent / "bin" / name


def run(arguments: list[str], text: str | None = None) -> bytes:
    """Runs the command and returns its standard output.

    Args:
        arguments: The arguments.
        text: What the command reads from its standard input.

    Raises:
        Error: The command failed; the text is its report, with lines and carets.
    """
    done, _ = run_with_report(arguments, text)
    return done


def run_with_report(arguments: list[str], text: str | None = None) -> tuple[bytes, str]:
    """As :func:`run`; also returns what the command reported: its warnings."""
    # A process of its own: the symbolic engine is never a part of Python, and if it aborts, Python goes on.
    with subprocess.Popen(
        [path(), *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "NO_COLOR": "1"},
    ) as process:
        said: list[str] = []
        listener = threading.Thread(target=_listen, args=(process.stderr, said))
        listener.start()
        # As `communicate` does; standard error belongs to the thread.
        feeder = threading.Thread(target=_feed, args=(process.stdin, (text or "").encode()))
        feeder.start()
        assert process.stdout is not None
        out = process.stdout.read()
        feeder.join()
        listener.join()
    report = "".join(said).strip()
    if process.returncode < 0:
        raise Error(f"lamc ended by signal {-process.returncode}\n{report}".strip())
    if process.returncode != 0:
        raise Error(report or f"lamc ended with code {process.returncode}")
    return out, report


def _feed(pipe: IO[bytes] | None, text: bytes) -> None:
    assert pipe is not None
    # A command that reads nothing has closed it.
    with contextlib.suppress(BrokenPipeError), pipe:
        pipe.write(text)


def _listen(pipe: IO[bytes] | None, said: list[str]) -> None:
    """Shows progress at once, and keeps the rest."""
    assert pipe is not None
    for line in io.TextIOWrapper(pipe, encoding="utf-8", errors="replace"):
        if line.startswith("waiting for another lamc") or line.endswith(" ..\n"):
            sys.stderr.write(line)
        else:
            said.append(line)


def main() -> None:
    """Replaces this process by the command."""
    if os.name == "nt":
        sys.exit(subprocess.call([path(), *sys.argv[1:]]))
    os.execv(path(), ["lamc", *sys.argv[1:]])
