"""The command ``lamc`` that the wheel carries."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

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
    done = subprocess.run(
        [path(), *arguments],
        input=(text or "").encode(),
        capture_output=True,
        env={**os.environ, "NO_COLOR": "1"},
        check=False,
    )
    report = done.stderr.decode(errors="replace").strip()
    if done.returncode < 0:
        raise Error(f"lamc ended by signal {-done.returncode}\n{report}".strip())
    if done.returncode != 0:
        raise Error(report or f"lamc ended with code {done.returncode}")
    return done.stdout, report


def main() -> None:
    """Replaces this process by the command."""
    if os.name == "nt":
        sys.exit(subprocess.call([path(), *sys.argv[1:]]))
    os.execv(path(), ["lamc", *sys.argv[1:]])
