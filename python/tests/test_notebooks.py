"""The notebooks run; what they say is asserted in them."""

from pathlib import Path

import nbclient
import nbformat
import pytest

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples/notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path) -> None:
    notebook = nbformat.read(path, as_version=4)
    resources = {"metadata": {"path": str(path.parent)}}
    nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3", resources=resources).execute()
    # They are kept without outputs, so that changes can be read.
    assert not any(cell.get("outputs") for cell in nbformat.read(path, as_version=4).cells)


def test_there_are_notebooks() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["sixbar", "swing", "yield"]
