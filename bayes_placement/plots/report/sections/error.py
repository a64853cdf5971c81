"""The error that falls, and how probable each explanation is."""

from collections.abc import Iterator

import numpy as np

from ...._shared.files import Json
from ..._colours import AFTER, FLOOR, Style
from .._saved import Saved
from .._style import decade_labels, drawing, legend, panels
from ..content import Item, Table
from ..report import ERROR

SMALLEST = 1e-3
"""Probability below which a kind is not drawn."""

LEAST_MISFIT = 1e-3
"""Misfit below which a point stands at the lower end: data without noise can be fitted exactly."""


def items(saved: Saved) -> Iterator[Item]:
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
    misfit, quantity = _misfit(steps)
    figure, axes = panels(1, 1, 2.6)
    panel = axes[0, 0]
    drawn = np.maximum(misfit, LEAST_MISFIT)
    panel.plot(range(len(misfit)), drawn, "o-", color=AFTER, label="misfit of the best fit")
    for number, (value, height) in enumerate(zip(misfit, drawn, strict=True)):
        text = f"{value:.0f}" if value >= 100 else f"{value:.3g}"
        panel.annotate(text, (number, height), (8, 4), textcoords="offset points")
    panel.axhline(1.0, color=FLOOR, linestyle="--", label="noise floor of a correct model")
    panel.set_yscale("log")
    panel.set_ylim(0.5 * min(1.0, *drawn, 1.0), 3 * max(1.0, *drawn, 1.0))
    panel.set_xlim(-0.4, len(misfit) - 0.4)
    panel.set_xticks(range(len(names)), names)
    panel.set_ylabel(quantity.replace(" without", "\nwithout").replace(" over", "\nover"))
    decade_labels(panel)
    legend(figure, axes)
    rows = tuple(zip(names, misfit, strict=True))
    data = Table(("model", quantity), rows)
    caption = (
        f"The misfit falls from {misfit[0]:.4g} to {misfit[-1]:.4g}; 1 is the level of the noise."
        if len(misfit) > 1
        else f"The misfit of the model as given is {misfit[0]:.4g}; 1 is the level of the noise."
    )
    return Item(ERROR, "The error falls", drawing(figure, data), caption, ("error",))


def _misfit(steps: list[Json]) -> tuple[list[float], str]:
    """Misfit of each step that no error takes up, and what it is."""
    needed = [step["noise_needed"] or {} for step in steps]
    scatters = _numbers([noise.get("over_scatter") for noise in needed])
    if np.isfinite(scatters).all():
        return scatters, "residual over scatter of lines [1]"
    exact = _numbers([step["chi2_per_datum_when_exact"] for step in steps])
    if np.isfinite(exact).all():
        return exact, "reduced chi-square without model error [1]"
    return _numbers([step["chi2_per_datum"] for step in steps]), "reduced chi-square [1]"


def _numbers(values: list[float | int | None]) -> list[float]:
    return [np.nan if value is None else float(value) for value in values]


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
