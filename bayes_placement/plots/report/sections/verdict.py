"""The conclusion in three sentences, the verdict, and the tables that it rests on."""

import re
from collections.abc import Iterator

import numpy as np

from ...._shared.files import Json
from ....inference.units import readable
from .._saved import Saved
from ..content import Cell, Item, Table, Text, rounded
from ..report import ERROR, NEXT, SUSPICION, UNKNOWNS, VERDICT

_TABLES = {
    "states.csv": (
        VERDICT,
        "Effects in each state",
        "Every effect with its size in each state, and the misfit that is left.",
        ("verdict", "effect"),
    ),
    "explanation.csv": (
        VERDICT,
        "Candidates",
        "Every kind of effect with its probability and the misfit that it leaves.",
        ("effect",),
    ),
    "misfit.csv": (
        ERROR,
        "Misfit by group",
        "Misfit of all data and of every sensor, actuator and band: the reduced chi-square of a "
        "correct model is the expected one, within the spread.",
        ("error",),
    ),
    "compared.csv": (
        SUSPICION,
        "Hypotheses that were fitted",
        "Every combination of effects that was fitted; odds include how many variants a kind has.",
        ("effect",),
    ),
    "cross_check.csv": (
        UNKNOWNS,
        "Methods compared",
        "The result of each method, with the standard error of the computation.",
        ("unknowns",),
    ),
    "placements.csv": (
        NEXT,
        "Placements that were tried",
        "Positions with their expected information gain [nat], the best first.",
        ("next measurement",),
    ),
}
"""Tables of a run by the names of their files: section, title, caption, tags."""

_END = re.compile(r'(?<=[.!?])\s+(?=[A-Z"])')
"""End of a sentence that another one follows."""

MOST_ROWS = 25
"""Rows of a table of a run that are shown; the file has all."""


def verdict(saved: Saved) -> str:
    """Return the answer of a run in one sentence; empty where none was kept."""
    of_runs = [str(run["verdict"]) for run in saved.runs.values() if "verdict" in run]
    sentences = _END.split(str(saved.about.get("verdict", " ".join(of_runs))))
    return sentences[0]


def items(saved: Saved) -> Iterator[Item]:
    """Say what was found, and show the steps."""
    sentences = tuple(str(sentence) for sentence in saved.about.get("sentences", []))
    if sentences and sentences != (verdict(saved),):
        yield Item(VERDICT, "What was found", Text(sentences), tags=("verdict",))
    if saved.ledger:
        yield Item(
            VERDICT,
            "Steps",
            _steps(saved.ledger["steps"]),
            f"The model as given, then with one more effect each time: {_of_misfit(saved)}; held "
            "out is the mean log density [nat] of data that were not fitted.",
            ("verdict", "error"),
        )


def tables(saved: Saved) -> Iterator[Item]:
    """Show the tables that the run wrote."""
    for name, (section, title, caption, tags) in _TABLES.items():
        frame = saved.table(name)
        if frame is not None:
            frame.columns = frame.columns.str.replace("_", " ")
            table = Table.of(frame.head(MOST_ROWS))
            more = f" {len(frame) - MOST_ROWS} more rows are in {name}."
            words = caption + (more if len(frame) > MOST_ROWS else "")
            yield Item(section, title, table, words, tags)


def _of_misfit(saved: Saved) -> str:
    """Say what the misfit of each step is held against."""
    if _is_noise_known(saved.ledger["steps"]):
        return "the reduced chi-square of a correct model is 1"
    return (
        "the noise is not known and is inferred with the other unknowns; p is the probability that "
        "a correct model leaves residuals so far above the scatter of neighbouring lines"
    )


def _is_noise_known(steps: list[Json]) -> bool:
    return all(step["noise_needed"] is None for step in steps)


def _steps(steps: list[Json]) -> Table:
    misfit: tuple[str, ...] = ("reduced chi-square",)
    if not _is_noise_known(steps):
        misfit = ("noise needed [%]", "noise needed / scatter of lines")
    elif _are_exact_too(steps):
        misfit = (*misfit, "without model error")
    columns = ("added", *misfit, "p", "log evidence", "held out [nat]", "what it is")
    rows: list[tuple[Cell, ...]] = [
        (
            step["added"] or "as given",
            *_misfit(step, _are_exact_too(steps)),
            step["p_value"],
            step["log_evidence"],
            step["held_out"],
            ", ".join(filter(None, (step["setting"], *_parameters(step), step["remark"]))),
        )
        for step in steps
    ]
    return Table(columns, tuple(rows))


def _are_exact_too(steps: list[Json]) -> bool:
    """Whether each step was fitted without its model error as well."""
    return all(step["chi2_per_datum_when_exact"] is not None for step in steps)


def _misfit(step: Json, is_exact_too: bool) -> tuple[Cell, ...]:
    """Reduced chi-square; where the noise is not known, the noise that is needed."""
    noise = step["noise_needed"]
    if noise is None:
        exact = (step["chi2_per_datum_when_exact"],) if is_exact_too else ()
        return (step["chi2_per_datum"], *exact)
    share = noise["relative"]
    return None if share is None else 100 * share, noise["over_scatter"]


def _parameters(step: Json) -> Iterator[str]:
    """Say what is known of the effect that was added: each number with its deviation."""
    for estimate in step["parameters"].values():
        is_of_added = estimate["effect"] is not None and estimate["effect"] == step["added"]
        if is_of_added and estimate["mean"] is not None:
            scale = readable(str(estimate["unit"]), estimate["field"], abs(estimate["mean"]))
            spread = scale.factor * (estimate["standard_deviation"] or 0.0)
            mean = rounded(scale.factor * estimate["mean"], spread)
            yield f"{estimate['word']} {mean:.12g} ± {spread:.2g} {scale.name}".rstrip()


def conclusion(saved: Saved) -> Iterator[Item]:
    """Say what was found, how well the model then agrees, and what to do next."""
    sentences = filter(None, (verdict(saved), _agreement(saved), _recommendation(saved)))
    yield Item(VERDICT, "Conclusion and recommendation", Text(tuple(sentences)), tags=("verdict",))


def _agreement(saved: Saved) -> str:
    """How far computed FRFs agree, with the model as given and with what was found."""
    fits = saved.of_models("fit").values()
    means = [float(fit["frac"].mean()) for fit in fits if "frac" in fit]
    if not means or not np.isfinite(means).all():
        return ""
    before = "" if len(means) == 1 else f"; it is {means[0]:.3f} of the model as drawn"
    return (
        "The mean frequency response assurance criterion between measured and computed FRFs is "
        f"{means[-1]:.3f} (1: equal){before}."
    )


def _recommendation(saved: Saved) -> str:
    """What to do next."""
    search = saved.about.get("next")
    if saved.ledger.get("confounded", saved.about.get("confounded")):
        return (
            f"Recommended: measure once more, since these data leave several explanations. "
            f"{search['sentence'] if search else ''}"
        ).strip()
    if saved.ledger.get("unexplained"):
        return (
            "Recommended: look for what the model still lacks where the map of residuals is "
            "dark, before it is used."
        )
    if saved.ledger.get("verdict"):
        return (
            "Recommended: take what was found into the model (bayes-placement improve MODEL "
            "--save NEW), and confirm it by an inspection of that place."
        )
    if not saved.ledger:
        return ""
    if saved.ledger["steps"][-1]["chi2_per_datum_when_exact"] is not None:
        return (
            "Recommended: use the model together with the model error that it needs; nothing was "
            "found that would be better added to it."
        )
    return "Recommended: use the model as it is; these data show nothing that it lacks."
