"""Run notebooks in full and store them with what they print and draw.

python notebooks/docs/run_notebooks.py [NAME ...]
"""

import base64
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from small_png import small

PNG = "image/png"

FOLDER = Path(__file__).parents[1]
TIMEOUT = 1800  # [s] for a cell


def is_kept(output):
    """Whether an output is a figure or a printed text, and no progress."""
    if output.output_type == "display_data":
        return PNG in output.data
    return output.get("name") != "stderr"


def stored(notebook):
    """Leave out bars of progress and what depends on the machine."""
    notebook.metadata.language_info = {"name": "python"}
    notebook.metadata.pop("widgets", None)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.metadata.pop("execution", None)
            cell.outputs = [output for output in cell.outputs if is_kept(output)]
            for output in cell.outputs:
                if PNG in output.get("data", {}):
                    figure = small(base64.b64decode(output.data[PNG]))
                    output.data[PNG] = base64.b64encode(figure).decode()
    return notebook


def main(names):
    """Run the notebooks of these names, all by default."""
    for name in names or sorted(path.stem for path in FOLDER.glob("*.ipynb")):
        path = FOLDER / f"{name}.ipynb"
        notebook = nbformat.read(path, as_version=4)
        resources = {"metadata": {"path": str(FOLDER)}}
        client = NotebookClient(
            notebook, timeout=TIMEOUT, kernel_name="python3", resources=resources
        )
        nbformat.write(stored(client.execute()), path)


if __name__ == "__main__":
    main(sys.argv[1:])
