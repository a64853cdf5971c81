"""What the data do not tell apart, and where to measure next so that it is decided."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from ...._shared.files import Json
from ..._colours import AFTER, DATA
from .._saved import Saved
from .._style import drawing, legend, panels
from ..content import Item, Table, Text
from ..report import NEXT

TAGS = ("next measurement",)


def items(saved: Saved) -> Iterator[Item]:
    """Say what is confounded, name the alternatives, and draw the expected gain."""
    yield from _placements(saved)
    if not saved.ledger and "confounded" not in saved.about:
        return
    if saved.ledger or "alternatives" in saved.about:
        yield Item(NEXT, "What these data do not tell apart", Text(_confounded(saved)), tags=TAGS)
    alternatives = (
        [(str(name), float(share)) for name, share in saved.about["alternatives"]]
        if ("alternatives" in saved.about)
        else []
    )
    if len(alternatives) > 1:
        total = sum(share for _, share in alternatives)
        rows = tuple((name, share / total) for name, share in alternatives)
        table = Table(("explanation", "probability among these [1]"), rows)
        words = "Explanations that the next measurement should distinguish, by their odds."
        yield Item(NEXT, "Explanations that are left", table, words, TAGS)
    search = saved.about.get("next")
    if search is None and "alternatives" in saved.about:
        words = (
            "Where to measure next was not searched for: run the command with --report, or "
            "bayes-placement place MODEL --estimator separation."
        )
        yield Item(NEXT, "The next measurement", Text((words,)), tags=TAGS)
    if search is not None:
        yield Item(NEXT, "The next measurement", Text((str(search["sentence"]),)), tags=TAGS)
        if search["rows"]:
            yield _gain(search)


def _placements(saved: Saved) -> Iterator[Item]:
    """Draw the gain at placements that `place` tried, of one or two instruments on a line."""
    table = saved.table("placements.csv")
    if table is None:
        return
    moved = list(table.columns[: list(table.columns).index("information_gain")])
    axes = [f"{name} [m]" for name in moved]
    shown = table[[*moved, "information_gain", "information_gain_se"]]
    named = shown.set_axis([*axes, "expected gain [nat]", "its error [nat]"], axis="columns")
    named = named[np.isfinite(named["expected gain [nat]"])]  # supports do not move
    if len(moved) == 1:
        words = "Information gain at each place that was tried; bars are two standard errors."
        rows = named.to_numpy(float).tolist()
        yield _gain({"columns": list(named), "rows": rows, "caption": words})
    elif len(moved) == 2 and not any("." in name for name in moved):
        yield _map(named)


def _map(table: pd.DataFrame) -> Item:
    """Draw the gain at pairs of places as the size of a mark."""
    figure, axes = panels(1, 1, 3.4)
    panel = axes[0, 0]
    across, up, gain = table.to_numpy(float)[:, :3].T
    share = np.clip((gain - gain.min()) / max(float(np.ptp(gain)), 1e-12), 0.0, 1.0)
    panel.scatter(across, up, s=4 + 90 * share, color=AFTER, alpha=0.7, linewidths=0)
    label = f"best: {gain[0]:.3g} nat"
    panel.plot(across[0], up[0], "*", color=DATA, markersize=12, label=label)
    panel.set_xlabel(table.columns[0])
    panel.set_ylabel(table.columns[1])
    legend(figure, axes)
    words = f"Information gain at pairs of places, from {gain.min():.3g} to {gain.max():.3g} nat."
    return Item(NEXT, "Expected gain", drawing(figure, Table.of(table)), words, TAGS)


def _confounded(saved: Saved) -> tuple[str, ...]:
    pairs = saved.ledger.get("confounded", saved.about.get("confounded", []))
    if not pairs:
        return ("No two of the effects that were tried explain these data equally well.",)
    return tuple(
        f"These data do not distinguish {first} from {second}: either of them explains the data."
        for first, second in pairs
    )


def _gain(search: Json) -> Item:
    """Draw the gain along a line, or list the best places in space."""
    columns = tuple(str(column) for column in search["columns"])
    rows = tuple(tuple(row) for row in search["rows"])
    table = Table(columns, rows)
    if len(columns) != 3:
        return Item(NEXT, "Expected gain", table, str(search["caption"]), TAGS)
    numbers = np.array(sorted(rows), float)
    figure, axes = panels(1, 1, 2.4)
    panel = axes[0, 0]
    at, gain, error = numbers.T
    panel.errorbar(at, gain, 2 * error, fmt="o-", color=AFTER, markersize=3, linewidth=1)
    best = int(np.argmax(gain))
    panel.plot(at[best], gain[best], "*", color=DATA, markersize=11, label="best place")
    panel.set_xlabel(columns[0])
    panel.set_ylabel("expected gain [nat]")
    panel.set_ylim(bottom=min(0.0, float((gain - 2 * error).min())))
    legend(figure, axes)
    return Item(NEXT, "Expected gain", drawing(figure, table), str(search["caption"]), TAGS)
