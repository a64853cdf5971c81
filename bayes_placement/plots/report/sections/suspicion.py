"""How suspect each place of the structure is, for every kind of effect."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from ..._colours import AFTER, DATA
from .._saved import Saved
from .._style import Projection, draw_outline, drawing, legend, panels
from ..content import Drawing, Item, Table
from ..report import SUSPICION

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
    in_space = "z" in table and table["z"].notna().any()
    outline, places = saved.group("outline"), saved.group("places")
    fitted = _fitted(places)
    data = Table.of(table.drop(columns="size"))
    if in_space and outline is not None:
        content = _in_space(table, list(greatest["kind"]), outline, fitted, data)
    else:
        content = _on_a_line(table, greatest, fitted, data)
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
    table: pd.DataFrame, greatest: pd.DataFrame, fitted: dict[str, np.ndarray], data: Table
) -> Drawing:
    """One strip for each kind, the most suspect on top."""
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
            at = place[0], kinds.index(name) + 0.2
            panel.plot(*at, "*", color=DATA, markersize=9, label="place as fitted")
    panel.set_yticks(np.arange(len(kinds)) + 0.2, kinds)
    panel.set_ylim(-0.1, len(kinds) + 0.1)
    panel.set_xlabel("position along the structure [m]")
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
