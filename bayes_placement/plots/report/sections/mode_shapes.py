"""Mode shapes that move, with the effect and without it beside each other."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from ...._shared.files import Json
from .._saved import Saved, name_of, placed_items
from ..content import Item, MovingShapes, Table
from ..report import SHAPES

TAGS = ("structure", "mode shapes")
UP = 2
"""Axis along which displacements of a line are drawn, z."""

WORDS = {1: "x", 2: "y", 3: "z"}


def items(saved: Saved) -> Iterator[Item]:
    """Show the shapes, and list the natural frequencies."""
    outline = saved.group("outline")
    shapes = {
        name: group
        for number, name in enumerate(saved.models)
        for group in [saved.group(f"shapes_{number}")]
        if group is not None
    }
    if outline is None or not any(group.sizes["mode"] for group in shapes.values()):
        return
    on_a_line = bool(outline.attrs["on_a_line"])
    models = [_model(name, group, on_a_line) for name, group in shapes.items()]
    content = MovingShapes(
        points=outline["point"].values.tolist(),
        lines=outline["line"].values.astype(int).tolist(),
        models=models,
        note=_note(next(iter(shapes.values())), on_a_line),
        marks=_marks(saved.group("places")),
    )
    caption = (
        "Undamped natural modes of both models, side by side and scaled to the same greatest "
        "displacement."
    )
    yield Item(SHAPES, "Mode shapes", content, caption, TAGS)
    yield Item(
        SHAPES,
        "Natural frequencies",
        _frequencies(shapes),
        "The first undamped natural frequencies, up to a little above the measured band.",
        TAGS,
    )


def _model(name: str, group: xr.Dataset, on_a_line: bool) -> Json:
    shape = group["shape"].values
    if on_a_line:
        across = np.zeros_like(shape)
        across[..., UP] = shape[..., _axis(group) - 1]
        shape = across
    return {
        "name": name,
        "frequencies": group["natural_frequency"].values.tolist(),
        "shapes": shape.tolist(),
    }


def _axis(group: xr.Dataset) -> int:
    """Axis along which a line moves."""
    return int(np.atleast_1d(group.attrs["axes"])[0])


def _note(group: xr.Dataset, on_a_line: bool) -> str:
    if on_a_line and _axis(group) == 1:
        return "The motion is along the structure (x); it is drawn across it."
    return "Displacements are enlarged."


def _marks(places: xr.Dataset | None) -> list[Json]:
    """Instruments and effects at their inferred places; at the recorded ones where not known."""
    marks = []
    for item in placed_items(places):
        inferred, recorded = item["posterior"].mean("draw").values, item["recorded"].values
        at = inferred if np.isfinite(inferred).all() else recorded
        if np.isfinite(at).all():
            kind = str(item["kind"].item())
            marks.append({"name": name_of(item), "at": at.tolist(), "kind": kind})
    return marks


def _frequencies(shapes: dict[str, xr.Dataset]) -> Table:
    lists = [group["natural_frequency"].values.tolist() for group in shapes.values()]
    count = max(map(len, lists))
    padded = [[*values, *[None] * (count - len(values))] for values in lists]
    columns = ("mode", *(f"{name} [Hz]" for name in shapes))
    return Table(columns, tuple(zip(range(1, count + 1), *padded, strict=True)))
