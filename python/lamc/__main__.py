"""``python -m lamc`` is the command ``lamc``."""

from ._command import main

main()
