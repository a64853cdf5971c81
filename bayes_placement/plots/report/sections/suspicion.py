"""How suspect each place is, what data do not tell apart, and where to measure next for that."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from ...._shared.files import Json
from ..._colours import AFTER, DATA
from ..._line import Line, line_through
from .._saved import Saved
from .._style import Projection, draw_outline, drawing, legend, panels
from ..content import Drawing, Item, Table, Text
from ..report import NEXT, SUSPICION

MOST_KINDS = 16
"""Kinds of effects that are drawn; those of the greatest score."""

MOST_MAPS = 4
"""Maps of a structure in space."""

MOST_MARKS = 250
"""Marks of a map; those of the greatest score."""

WITHOUT_PLACE = ("misplaced_sensor", "misplaced_actuator")
"""Kinds whose scores lie at shifts, not at places."""

LEAST = 5.0
"""Score [standard deviations] that fills a strip at least."""


def items(saved: Saved) -> Iterator[Item]:
    """Draw the scores on the structure, and list the greatest of each kind."""
    table = saved.table("suspicion.csv")
    if table is None or table.empty:
        return
    table = table.assign(size=table["score"].abs())
    greatest = table.loc[table.groupby("kind")["size"].idxmax()]
    greatest = greatest.sort_values("size", ascending=False)
    outline, places = saved.group("outline"), saved.group("places")
    fitted = _fitted(places)
    data = Table.of(table.drop(columns="size"))
    line: Line | None = Line()
    if outline is not None and "z" in table and table["z"].notna().any():
        line = line_through(outline["point"].values)
    if outline is not None and line is None:
        content = _in_space(table, list(greatest["kind"]), outline, fitted, data)
    else:
        content = _on_a_line(table, greatest, fitted, data, line or Line())
    first = greatest.iloc[0]
    caption = (
        f"The strongest trace in the model as given is that of {first['kind']}: "
        f"{first['size']:.3g} standard deviations; where a model fails badly, every effect leaves "
        "traces, and only the fits decide."
    )
    yield Item(SUSPICION, "Suspicion on the structure", content, caption, ("effect", "structure"))
    yield Item(
        SUSPICION,
        "Greatest score of each kind",
        _table(greatest),
        "Score of each kind where it is greatest; p is corrected for all places that were tested.",
        ("effect",),
    )


def _fitted(places: xr.Dataset | None) -> dict[str, np.ndarray]:
    """Mean place of each effect that was found, by name."""
    if places is None:
        return {}
    effects = places.isel(item=np.flatnonzero(places["kind"].values == "effect"))
    means = effects["posterior"].mean("draw").values
    return {
        str(name): mean
        for name, mean in zip(effects["item"].values, means, strict=True)
        if np.isfinite(mean).all()
    }


def _table(greatest: pd.DataFrame) -> Table:
    axes = ("x", "y", "z") if "x" in greatest else ("at",)
    columns = [word for word in ("kind", "setting", *axes) if word in greatest]
    known = greatest[columns].dropna(axis="columns", how="all")
    named = known.rename(columns={axis: f"{axis} [m]" for axis in ("at", "x", "y", "z")})
    named = named.assign(**{"score [1]": greatest["score"], "p": greatest["p_value"]})
    return Table.of(named.fillna({"setting": ""}) if "setting" in named else named)


def _on_a_line(
    table: pd.DataFrame,
    greatest: pd.DataFrame,
    fitted: dict[str, np.ndarray],
    data: Table,
    line: Line,
) -> Drawing:
    """One strip for each kind, the most suspect on top."""
    table = line.with_at(table)
    located = table[table["at"].notna() & ~table["kind"].isin(WITHOUT_PLACE)]
    has_places = located.groupby("kind")["at"].nunique() > 1
    drawn = [kind for kind in greatest["kind"] if has_places.get(kind, False)]
    kinds = drawn[:MOST_KINDS][::-1]
    scores = dict(zip(greatest["kind"], greatest["size"], strict=True))
    full = max(float(greatest["size"].iloc[0]), LEAST)
    figure, axes = panels(1, 1, 0.8 + 0.3 * len(kinds))
    panel = axes[0, 0]
    for row, kind in enumerate(kinds):
        along = located[located["kind"] == kind].groupby("at")["size"].max()
        top = row + 0.85 * along.to_numpy() / full
        panel.fill_between(along.index, row, top, color=AFTER, alpha=0.75, linewidth=0)
        panel.annotate(f"{scores[kind]:.3g}", (1.01, row + 0.1), xycoords=("axes fraction", "data"))
    for name, place in fitted.items():
        if name in kinds:
            at = line.at(place), kinds.index(name) + 0.2
            panel.plot(*at, "*", color=DATA, markersize=9, label="place as fitted")
    panel.set_yticks(np.arange(len(kinds)) + 0.2, kinds)
    panel.set_ylim(-0.1, len(kinds) + 0.1)
    panel.set_xlabel(line.label)
    panel.set_title("score along the structure [standard deviations]; at the right the greatest")
    legend(figure, axes)
    return drawing(figure, data)


def _in_space(
    table: pd.DataFrame,
    kinds: list[str],
    outline: xr.Dataset,
    fitted: dict[str, np.ndarray],
    data: Table,
) -> Drawing:
    """A map for each of the most suspect kinds; a score is the size of a mark."""
    located = table[table["z"].notna()]
    shown = [kind for kind in kinds if kind in set(located["kind"])][:MOST_MAPS]
    view = Projection.of(outline["point"].values)
    columns = min(2, len(shown))
    figure, axes = panels(-(-len(shown) // columns), columns, 3.0)
    for panel, kind in zip(axes.flat, shown, strict=False):
        draw_outline(panel, outline, view)
        rows = located[located["kind"] == kind].nlargest(MOST_MARKS, "size")
        share = rows["size"] / max(float(rows["size"].iloc[0]), LEAST)
        places = view.at(rows[["x", "y", "z"]].to_numpy())
        panel.scatter(*places, s=60 * share**2, color=AFTER, alpha=0.6, linewidths=0)
        if kind in fitted:
            at = view.at(fitted[kind][None])
            panel.plot(*at, "*", color=DATA, markersize=11, label="place as fitted")
        panel.set_title(f"{kind}, greatest {rows['size'].iloc[0]:.3g}")
    for panel in axes.flat[len(shown) :]:
        panel.set_axis_off()
    legend(figure, axes)
    return drawing(figure, data)


TAGS = ("next measurement",)


def next_measurement(saved: Saved) -> Iterator[Item]:
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
