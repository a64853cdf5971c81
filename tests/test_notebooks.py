"""Notebooks: each runs from top to bottom with small settings, and is stored with its output."""

import re
import warnings
from pathlib import Path

import nbformat
import numpy as np
import pytest

FOLDER = Path(__file__).parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
TIMEOUT = 300  # [s] for a cell, on a busy machine


def read(path):
    return nbformat.read(path, as_version=4)


def code(notebook):
    return [cell for cell in notebook.cells if cell.cell_type == "code"]


def executed(paths, folder):
    """Run notebooks as if they had been started in this folder.

    They share a kernel, which imports and compiles once; names are deleted after each, so that none
    can use those of an earlier notebook: `%reset` would look for garbage twice as well.
    """
    notebooks = {path.stem: read(path) for path in paths}
    cells = [
        cell
        for notebook in notebooks.values()
        for cell in [*notebook.cells, nbformat.v4.new_code_cell("%reset_selective -f .")]
    ]
    for number, cell in enumerate(cells):
        cell.id = f"cell-{number}"  # they are unique in each notebook only
    run(cells, folder)
    return notebooks


def run(cells, folder):
    """Run cells, which keep their outputs, in a kernel of their own."""
    together = nbformat.v4.new_notebook(cells=cells)
    with warnings.catch_warnings():
        # Warnings of the Jupyter packages about each other's interfaces and about sockets.
        for module in ("jupyter_client", "nbclient", "zmq", "jupyter_core", "tornado"):
            warnings.filterwarnings("ignore", module=module)
        from nbclient import NotebookClient

        NotebookClient(
            together,
            timeout=TIMEOUT,
            kernel_name="python3",
            resources={"metadata": {"path": str(folder)}},
        ).execute()


def printed(notebook):
    outputs = [output for cell in code(notebook) for output in cell.outputs]
    return "".join(output.text for output in outputs if output.output_type == "stream")


def figures(notebook):
    outputs = [output for cell in code(notebook) for output in cell.outputs]
    return [output.data["image/png"] for output in outputs if "image/png" in output.get("data", {})]


def test_there_are_notebooks():
    expected = {"bar_damping", "hidden_effect", "structure_in_space", "where_to_measure"}
    expected |= {"real_measurement"}
    assert {path.stem for path in NOTEBOOKS} >= expected


SLOW_BARS = """
import time, ipywidgets
from bayes_placement._shared.progress import shown

def slowly(widget, wait=False):
    time.sleep(0.25)  # longer than a notebook keeps what was printed

ipywidgets.Output.clear_output = slowly
for name in "ab":
    print(name)
    with shown(None, "task") as report:
        report(0.5)
"""


@pytest.mark.long
def test_what_was_printed_before_a_bar_stays(tmp_path):
    cell = nbformat.v4.new_code_cell(SLOW_BARS)
    run([cell], tmp_path)
    assert printed(nbformat.v4.new_notebook(cells=[cell])).split() == ["a", "b"]


LARGEST = 400_000
"""Bytes of a notebook with its figures, of which the repository keeps every version."""


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_stored_as_it_ran_from_top_to_bottom(path):
    notebook = read(path)
    nbformat.validate(notebook)
    counts = [cell.execution_count for cell in code(notebook)]
    assert counts == [*range(1, len(counts) + 1)]
    outputs = [output for cell in code(notebook) for output in cell.outputs]
    assert outputs
    assert not [o for o in outputs if o.output_type == "error" or o.get("name") == "stderr"]
    bars = [o for o in outputs if o.output_type == "display_data" and "image/png" not in o.data]
    assert not bars
    assert "widgets" not in notebook.metadata
    assert path.stat().st_size < LARGEST


@pytest.fixture(scope="module")
def tiny(tmp_path_factory):
    """All notebooks, run with small settings."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("BAYES_PLACEMENT_FAST", "1")
        patch.setenv("IPYTHONDIR", str(tmp_path_factory.mktemp("ipython")))
        return executed(NOTEBOOKS, FOLDER)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
@pytest.mark.long
def test_a_notebook_runs_and_leaves_nothing_behind(path, tiny):
    assert all(cell.execution_count is not None for cell in code(tiny[path.stem]))
    assert {path.name for path in FOLDER.glob("*")} == {
        "docs",
        "index.md",
        *(path.name for path in NOTEBOOKS),
    }


@pytest.mark.long
def test_the_bar_finds_its_damping_near_the_truth(tiny):
    # Even a small population suffices: the first to 20 %, the second to 5 %.
    text = printed(tiny["bar_damping"])
    lines = re.findall(r"(damping\.ratio\.\d): mean ([\d.]+), sd .* true ([\d.]+)\n", text)
    (_, first, true_first), (_, second, true_second), (_, trusted, _), _ = lines
    assert float(first) == pytest.approx(float(true_first), rel=0.2)
    assert float(second) == pytest.approx(float(true_second), rel=0.05)
    # With trusted recorded positions, the first is far too high, as the text says.
    assert float(trusted) > 1.3 * float(true_first)


@pytest.mark.long
def test_the_bar_shows_priors_cross_check_and_that_the_file_came_back(tiny):
    text = printed(tiny["bar_damping"])
    for piece in (
        "Uniform(0.21, 0.29)",
        "16 averages",
        "KL of parameters",
        "KDE importance: The kernels of the density estimate",
        "latent SMC and KDE importance disagree",
        "the same draws: True",
    ):
        assert piece in text


@pytest.mark.long
def test_the_bar_draws_its_figures(tiny):
    assert len(figures(tiny["bar_damping"])) == 8


@pytest.mark.long
def test_the_hidden_effect_is_found_and_the_error_falls(tiny):
    text = printed(tiny["hidden_effect"])
    assert "The model fails: reduced chi-square is" in text
    assert "Missing is point_mass, 0." in text
    assert re.search(r"Missing: point_mass, .* reduced chi-square falls from \S+ to 1\b", text)
    ratios = [float(ratio) for ratio in re.findall(r"damping\.ratio ([\d.]+) ±", text)]
    assert ratios[-1] == pytest.approx(3.0, rel=0.01)  # percent
    assert abs(ratios[0] - 3.0) > 0.3  # compensates for the clamp, as the text says


@pytest.mark.long
def test_an_effect_of_the_user_is_compared_with_the_others(tiny):
    text = printed(tiny["hidden_effect"])
    assert "These data do not distinguish point_mass from cable" in text


@pytest.mark.long
def test_the_hidden_effect_draws_its_figures(tiny):
    assert len(figures(tiny["hidden_effect"])) == 6


@pytest.mark.long
def test_the_arm_finds_its_clamp_and_how_the_sensors_were_rolled(tiny):
    text = printed(tiny["structure_in_space"])
    assert re.search(
        r"Missing: point_mass, .* reduced chi-square falls from \S+ to (0\.\d|1\.[01])", text
    )
    number = r"(-?[\d.e+-]+)"
    pattern = rf"(\S+) +true {number} +without clamp {number} .* with clamp {number} ± {number}"
    lines = {name: list(map(float, values)) for name, *values in re.findall(pattern, text)}
    assert len(lines) == 14
    for true, _, after, error in lines.values():
        assert abs(after - true) < 5 * error
    # Without the clamp in the model, angles compensate for it, as the text says.
    angles = [values for name, values in lines.items() if "angles" in name]
    assert max(abs(before - true) / error for true, before, _, error in angles) > 50


@pytest.mark.long
def test_the_arm_draws_its_suspicion(tiny):
    assert len(figures(tiny["structure_in_space"])) == 1


@pytest.mark.long
def test_where_to_measure_finds_the_places_and_tells_explanations_apart(tiny):
    text = printed(tiny["where_to_measure"])
    assert re.search(r"Best of 49 placements: s1 at 0\.\d+ m, a1 at 0\.\d+ m", text)
    assert "0.25 times the tolerance: best s1 at" in text
    odds = dict(re.findall(r"(\w+): odds ([\d.]+)", text))
    assert set(odds) == {"point_mass", "local_stiffness_loss"}  # both explain what was measured
    gap = re.search(r"evidence for point_mass over the next explanation: ([\d.]+) nat", text)
    assert gap is not None and float(gap[1]) > -np.log(float(odds["local_stiffness_loss"])) + 1.0


@pytest.mark.long
def test_where_to_measure_draws_its_figures(tiny):
    assert len(figures(tiny["where_to_measure"])) == 4


@pytest.mark.long
def test_the_wrong_instrument_and_what_is_new_are_named(tiny):
    text = " ".join(printed(tiny["real_measurement"]).split())
    assert "Missing: reversed_sensor, sensor base_low" in text
    assert "Measured once: The exact model fails (reduced chi-square" in text
    assert "New since the baseline: point_mass" in text
    at, mass = re.search(r"at ([\d.]+) mm \(95 %: \S+ to \S+\), mass ([\d.]+) g", text).groups()
    assert float(at) == pytest.approx(620, abs=5)
    assert float(mass) == pytest.approx(4.0, rel=0.1)
