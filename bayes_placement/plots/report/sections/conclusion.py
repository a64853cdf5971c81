"""Conclusion and recommendation in three sentences."""

from collections.abc import Iterator

import numpy as np

from .._saved import Saved
from ..content import Item, Text
from ..report import VERDICT
from .verdict import verdict


def items(saved: Saved) -> Iterator[Item]:
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
