"""Every notebook runs from its first cell to its last."""

import sys
from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")

NOTEBOOKS = sorted((Path(__file__).parent.parent / "examples").glob("*.ipynb"))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path, monkeypatch):
    # As large as it stands there it takes minutes.
    monkeypatch.setenv("PENETRODE_SCENES", "100000")
    kernel = tmp_path / "kernels" / "python3"
    kernel.mkdir(parents=True)
    words = f'"{sys.executable}", "-m", "ipykernel_launcher", "-f", "{{connection_file}}"'
    (kernel / "kernel.json").write_text(f'{{"argv": [{words}], "display_name": "Python 3", "language": "python"}}')
    monkeypatch.setenv("JUPYTER_PATH", str(tmp_path))
    monkeypatch.setenv("JUPYTER_PREFER_ENV_PATH", "0")
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3", resources={"metadata": {"path": tmp_path}}).execute()


def test_there_are_five():
    assert len(NOTEBOOKS) == 5
