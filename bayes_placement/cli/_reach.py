"""What `explain` and `improve` found, above all where it may act: words, tables, figures."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import xarray as xr
from matplotlib.figure import Figure

from ..criticism.missing._claims_in_words import claims_in_words
from ..criticism.missing.ledger import Ledger
from ..criticism.missing.ranking import Ranking
from ..criticism.reach.reach import Reach
from ..io.laws import SIDES
from ..plots import ledger as ledger_plots
from ..plots import reach as plots
from ..plots.report._style import look
from ..plots.report._svg import as_file, svg_of
from ._findings import FINDINGS, of_result, where_next
from ._inputs import Inputs
from ._run import Drawing, Run

HEADING = "What a single law at one place could do:"


def in_full(result: Ledger | Ranking, further: Sequence[str]) -> str:
    """Text of a file: the result, further sentences, and what acts where by which law."""
    lines = [str(result), *(f"- {sentence}" for sentence in further), *_lines_on_laws(result)]
    return "\n".join(lines)


def _lines_on_laws(result: Ledger | Ranking) -> list[str]:
    """Lines of a text file: where each claimed effect acts and its law, and what laws could do."""
    claimed = claims_in_words(result.effects)
    reached = [] if result.reach is None else result.reach.words()
    parts = {"Where it acts, and its law:": claimed, HEADING: reached}
    return [
        line
        for heading, sentences in parts.items()
        if sentences
        for line in ["", heading, *(f"- {sentence}" for sentence in sentences)]
    ]


def write_result(
    result: Ledger | Ranking,
    name: str,
    inputs: Inputs,
    run: Run,
    first: Sequence[Drawing] = (),
    further: Callable[[xr.DataTree], Sequence[Drawing]] = lambda kept: (),
) -> list[str]:
    """Write what was found under a name, and return where to measure next in words.

    Further figures are of what is kept for a report.
    """
    run.json(f"{name}.json", result.to_json())
    run.text(f"{name}.txt", in_full(result, ()))
    pictures = partial(_write_pictures, result, inputs, first, further)
    following = run.kept(pictures, result.to_json(), inputs.data_faults)
    run.text(f"{name}.txt", in_full(result, following))
    run.table("suspicion.csv", result.suspicion, index=False)
    return following


def _write_pictures(
    result: Ledger | Ranking,
    inputs: Inputs,
    first: Sequence[Drawing],
    further: Callable[[xr.DataTree], Sequence[Drawing]],
    run: Run,
) -> list[str]:
    """Write figures and what they are drawn from; return where to measure next in words."""
    draw_where(result, inputs, run)  # begun first: what follows takes as long as drawing it
    run.figures(*first, lambda: {"probabilities.png": ledger_plots.probabilities(result)})
    write_reach(result, run)
    measured = inputs.measurement, inputs.data_faults
    kept = of_result(result, inputs.experiment, *measured, with_next=run.with_report)
    run.tree(FINDINGS, kept)
    run.figures(*further(kept))
    return where_next(kept, result)


def show_reach(reach: Reach | None, inputs: Inputs) -> None:
    """Say which kind of port explains how much, whatever the law; nothing where none was read."""
    if reach is not None:
        inputs.screen.text(HEADING)
        inputs.screen.list(reach.words())


def write_reach(result: Ledger | Ranking, run: Run) -> None:
    """Write both curves and the law as measured.

    The law is that at the port of the claimed effect, or else at the most probable one.
    """
    reach = result.reach
    if reach is None:
        return
    law = reach.law_as_measured(result.port)
    run.table("reach.csv", reach.curves, index=False)
    run.table("law.csv", law, index=False)
    if law["unit"].iloc[0] in SIDES:  # a factor on channels is no law at a port
        run.law("law.unv", law)


def picture_of_where(result: Ledger | Ranking) -> str:
    """Name of the picture of where something may act: by any law, or else by each effect."""
    return "suspicion.png" if result.reach is None else "reach.png"


def draw_where(result: Ledger | Ranking, inputs: Inputs, run: Run) -> None:
    """Draw both curves and the law as measured, for a reader and for a report.

    Where no law was read, draw how strongly the data support each effect at each place.
    """
    reach, port, drawn = result.reach, result.port, inputs.experiment
    if reach is None:
        name = picture_of_where(result)
        run.figures(lambda: {name: ledger_plots.suspicion(result, experiment=drawn)})
        return
    drawings: dict[str, Callable[[], Figure]] = {
        "reach": lambda: plots.curves(reach, experiment=drawn),
        "law": lambda: plots.law(reach, acts_on=port),
    }
    for name, draw in drawings.items():
        run.figures(partial(_by_name, f"{name}.png", draw))
        run.attempt("A figure", partial(_begin_svg, run, f"{name}.svg", draw))


def _begin_svg(run: Run, name: str, draw: Callable[[], Figure]) -> None:
    with look():
        figure = draw()
    run.begin(name, partial(_write_svg, figure))


def _write_svg(figure: Figure, path: Path) -> None:
    with look():
        path.write_text(f"{as_file(svg_of(figure))}\n", encoding="utf-8")


def _by_name(name: str, draw: Callable[[], Figure]) -> dict[str, Figure]:
    return {name: draw()}
