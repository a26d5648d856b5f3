"""The code of the guide runs."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_the_code_of_the_guide_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (ROOT / "target").mkdir(exist_ok=True)
    text = (ROOT / "docs/PYTHON.md").read_text(encoding="utf-8")
    # What follows is about another module.
    guide = text[: text.index("## Without the package")]
    blocks = re.findall(r"^```python\n(.*?)^```", guide, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 7
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, "docs/PYTHON.md", "exec"), names)
    # What the page says of it.
    assert repr(names["model"]) == "<lamc.Model sixbar: 6 joints, 1 loop, mobility 3>"
    held, played = names["held"], names["played"]
    assert abs(held.q - played.q).max() < 1e-9  # type: ignore[attr-defined]
