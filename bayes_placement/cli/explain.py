"""`bayes-placement explain`: which physical effect a model lacks."""

from functools import partial

from ..criticism.missing.explain import explain
from ..criticism.missing.ranking import Ranking
from ..plots import ledger as plots
from ._findings import FINDINGS, of_result, where_next
from ._inputs import Inputs
from ._missing_effects import Request
from ._reach import draw_where, in_full, show_reach, write_reach
from ._run import Run


def run(request: Request) -> int:
    """Rank the effects that a model may lack, write tables and figures, return the exit code."""
    inputs = request.read("explain")
    ranking = request.search("explain", explain, inputs)
    verdict, *further = ranking.words()
    inputs.screen.verdict(verdict)
    show_reach(ranking.reach, inputs)
    inputs.screen.table(ranking.table(), "effect")
    inputs.screen.list(further)
    inputs.run.verdict(verdict)
    inputs.screen.list(_write(ranking, inputs, inputs.run))
    if ranking.claimed:
        inputs.screen.text(f"How far the error falls with it: {request.command('improve')}")
    else:
        inputs.screen.text(f"Where the misfit is: {request.command('check')}")
    return inputs.run.finish(inputs.screen, verdict, ranking.to_json())


def _write(ranking: Ranking, inputs: Inputs, run: Run) -> list[str]:
    """Write what was found, and return where to measure next in words."""
    run.json("explanation.json", ranking.to_json())
    run.text("explanation.txt", in_full(ranking, ()))
    pictures = partial(_write_pictures, ranking, inputs)
    following = run.kept(pictures, ranking.to_json(), inputs.data_faults)
    run.table("explanation.csv", ranking.table())
    run.text("explanation.txt", in_full(ranking, following))
    run.table("suspicion.csv", ranking.suspicion, index=False)
    return following


def _write_pictures(ranking: Ranking, inputs: Inputs, run: Run) -> list[str]:
    """Write figures and what they are drawn from; return where to measure next in words."""
    draw_where(ranking, inputs, run)  # begun first: what follows takes as long as drawing it
    run.figures(lambda: {"probabilities.png": plots.probabilities(ranking)})
    write_reach(ranking, run)
    measured = inputs.measurement, inputs.data_faults
    kept = of_result(ranking, inputs.experiment, *measured, with_next=run.with_report)
    run.tree(FINDINGS, kept)
    return where_next(kept, ranking)
