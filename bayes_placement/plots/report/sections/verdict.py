"""The conclusion, the verdict, the tables that it rests on, and how the error falls."""

import re
from collections.abc import Iterator

import numpy as np

from ...._shared.files import Json
from ....inference.units import readable
from ..._colours import AFTER, FLOOR, Style
from ..._falling import Falling, draw_falling, told_misfit
from .._saved import Saved
from .._style import decade_labels, drawing, legend, panels
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
        is_of_added = estimate["effect"] in step.get("names", filter(None, [step["added"]]))
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
            "--save NEW), and confirm it by an inspection of what is named."
        )
    if not saved.ledger:
        return ""
    if saved.ledger["steps"][-1]["chi2_per_datum_when_exact"] is not None:
        return (
            "Recommended: use the model together with the model error that it needs; nothing was "
            "found that would be better added to it."
        )
    return "Recommended: use the model as it is; these data show nothing that it lacks."


SMALLEST = 1e-3
"""Probability below which a kind is not drawn."""


def error(saved: Saved) -> Iterator[Item]:
    """Draw the error of each step, and the probabilities."""
    if not saved.ledger:
        return
    yield _falling(saved.ledger["steps"])
    shares = {
        str(kind): float(share)
        for kind, share in saved.ledger["probabilities"].items()
        if share is not None
    }
    if shares:
        yield _probabilities(shares)


def _falling(steps: list[Json]) -> Item:
    names = ["as given", *(f"+ {step['added']}" for step in steps[1:])]
    misfit = told_misfit(steps)
    figure, axes = panels(1, 1, 2.6)
    panel = axes[0, 0]
    draw_falling(panel, names, misfit, FLOOR, top=3.0, beside=0.4)
    panel.set_ylabel(misfit.quantity.replace(" without", "\nwithout").replace(", of", ",\nof"))
    decade_labels(panel)
    legend(figure, axes)
    rows = tuple(zip(names, misfit.values, strict=True))
    data = Table(("model", misfit.quantity), rows)
    return Item(ERROR, "The error falls", drawing(figure, data), _falls(misfit), ("error",))


def _falls(misfit: Falling) -> str:
    """Say how far the misfit falls, and that of the noise alone."""
    unit = " %" if misfit.quantity.endswith("[%]") else ""
    *values, floor = (f"{value:.4g}{unit}" for value in (*misfit.values, misfit.floor))
    ends = f"falls from {values[0]} to {values[-1]}"
    said = ends if len(values) > 1 else f"is {values[0]}"
    beside = f"; {floor} is the {misfit.floor_label}" if np.isfinite(misfit.floor) else ""
    return f"The {misfit.label} {said}{beside}."


def _probabilities(shares: dict[str, float]) -> Item:
    probable = {kind: share for kind, share in shares.items() if share >= SMALLEST}
    ordered = sorted(probable.items(), key=lambda pair: pair[1])
    figure, axes = panels(1, 1, 0.8 + 0.26 * len(ordered))
    panel = axes[0, 0]
    panel.barh(range(len(ordered)), [share for _, share in ordered], color=AFTER, height=0.5)
    for row, (_, share) in enumerate(ordered):
        near: Style = {"xytext": (4, 0), "textcoords": "offset points", "va": "center"}
        panel.annotate(f"{share:.3f}", (share, row), **near)
    panel.set_yticks(range(len(ordered)), [kind for kind, _ in ordered])
    margin = 0.5 if len(ordered) > 2 else 1.0
    panel.set_ylim(-margin, len(ordered) - 1 + margin)
    panel.set_xlim(0, 1.12)
    panel.set_xticks([0, 0.5, 1])
    panel.set_xlabel("posterior probability [1]")
    everything = sorted(shares.items(), key=lambda pair: -pair[1])
    data = Table(("explanation", "probability [1]"), tuple(everything))
    best, share = everything[0]
    others = len(shares) - len(probable)
    words = "1 other has" if others == 1 else f"{others} others have"
    rest = f"; {words} less than {SMALLEST:g}" if others else ""
    caption = (
        "Probability that each kind is among what is missing, alone or with others: the greatest "
        f"is that of {best}, {share:.3g}{rest}."
    )
    return Item(ERROR, "Probability of each kind", drawing(figure, data), caption, ("effect",))
