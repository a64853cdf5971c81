"""All channels on a page within the page: to zoom, to switch, with matrix, structure and modes."""

from collections.abc import Iterator, Mapping

import numpy as np
import xarray as xr

from ...._shared.files import Json
from ...._shared.labels import FORCE_LEVEL
from ....page.frames import packed
from ....page.standalone import kept_frames
from .._saved import Saved, name_of, placed_items
from ..content import Interactive, Item
from ..report import RESPONSES
from .responses import flat

MOST_NUMBERS = 400_000
"""Numbers that are kept, so that the page stays small: of more channels those of largest error."""

BANDS = 32
"""Most frequency bands of the map of the error."""

DEGREES = np.pi / 180

NAMES = {1: ("now",), 2: ("fitted as given", "now")}
"""Names of curves by the number of models, those of the page."""


def items(saved: Saved) -> Iterator[Item]:
    """Put the page with what is known of all channels."""
    named = {name: flat(fit) for name, fit in saved.of_models("fit").items()}
    outline = saved.group("outline")
    if outline is None or not saved.models or saved.models[-1] not in named:
        return
    first, last = (named[saved.models[end]] for end in (0, -1))
    shown = _most_error(first, len(named))
    curves = {name: fit.isel(channel=shown) for name, fit in named.items()}
    frames = [
        _model(last.isel(channel=shown), outline, saved),
        *_curves(curves, saved),
        packed(STATE, {}),
        *_modes(saved),
    ]
    words = "" if len(shown) == last.sizes["channel"] else f" The {len(shown)} of largest error."
    yield Item(
        RESPONSES,
        "All channels",
        Interactive(kept_frames(frames)),
        f"Drag across a chart to zoom all, press a channel of the matrix to see it.{words}",
        ("response", "error", "structure"),
    )


STATE: Json = {
    "is": "state",
    "sliders": [],
    "effects": [],
    "steps": [{"title": "", "parent": None, "chi2": None}],
    "current": 0,
    "path": [0],
    "can_undo": False,
    "can_redo": False,
    "script": "",
}
"""What the live page is told of steps: here there are none."""


def _most_error(fit: xr.Dataset, models: int) -> list[int]:
    """Numbers of the channels that are kept, in their order."""
    of_each = fit.sizes["frequency"] * (2 + 5 * models)
    most = max(1, MOST_NUMBERS // of_each)
    error = np.nan_to_num(_error(fit), nan=0.0)
    return sorted(np.argsort(-np.mean(error**2, axis=1))[:most].tolist())


def _error(fit: xr.Dataset) -> np.ndarray:
    """Root mean square of the residuals over their deviations [channel, line]."""
    ratio = fit["error"] / fit["noise"]
    return np.asarray(ratio.transpose("channel", "frequency").values, dtype=float)


def _parts(fit: xr.Dataset, word: str) -> np.ndarray:
    """Outputs [channel, part, line], of complex ones both parts."""
    values = fit[word].transpose("channel", "frequency").values
    if f"{word}_phase" not in fit:
        return np.asarray(values[:, None])
    angle = DEGREES * fit[f"{word}_phase"].transpose("channel", "frequency").values
    return np.asarray(10 ** values[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def _model(fit: xr.Dataset, outline: xr.Dataset, saved: Saved) -> bytes:
    points = outline["point"].values
    header = {
        "is": "model",
        "name": "",
        "words": "",
        "pairs": [_pair(fit.isel(channel=number)) for number in range(fit.sizes["channel"])],
        "unit": str(fit["error"].attrs["units"]),
        "structure": {
            "points": points,
            "lines": outline["line"].values.astype(int),
            "on_a_line": bool(outline.attrs["on_a_line"]),
            "low": points.min(axis=0),
            "high": points.max(axis=0),
            "transducers": [*_transducers(saved, bool(outline.attrs["on_a_line"]))],
        },
        "saves": [],
    }
    return packed(
        header, {"frequency": fit["frequency"].values, "measured": _parts(fit, "measured")}
    )


def _pair(channel: xr.Dataset) -> Json:
    level = float(channel[FORCE_LEVEL]) if FORCE_LEVEL in channel.coords else None
    return {word: str(channel[word].item()) for word in ("sensor", "actuator")} | {"level": level}


def _transducers(saved: Saved, on_a_line: bool) -> Iterator[Json]:
    """Recorded places and directions; on a line the places that a tolerance allows."""
    for item in placed_items(saved.group("places")):
        kind, at = str(item["kind"].item()), item["recorded"].values
        if kind == "effect" or not np.isfinite(at).all():
            continue
        prior = item["prior"].values
        ends = [prior.min(axis=0), prior.max(axis=0)] if on_a_line else []
        yield {
            "kind": kind,
            "name": name_of(item),
            "at": at,
            "directions": [item["direction_recorded"].values],
            "tolerance": ends if np.isfinite(prior).all() else [],
        }


def _curves(named: Mapping[str, xr.Dataset], saved: Saved) -> Iterator[bytes]:
    """What each model predicts, under the names of the page."""
    models = list(dict.fromkeys(saved.models))[-2:]
    names = dict(zip(models, NAMES[len(models)], strict=True))
    for title, fit in named.items():
        yield _curve(fit, names.get(title, "as drawn"), title, saved)


def _curve(fit: xr.Dataset, name: str, title: str, saved: Saved) -> bytes:
    error, predicted = _error(fit), _parts(fit, "predicted")
    noise = fit["noise"].transpose("channel", "frequency").values / np.sqrt(predicted.shape[1])
    bands = np.array_split(error**2, min(BANDS, error.shape[1]), axis=1)
    placed = placed_items(saved.group("places"))
    header = {"is": "curves", "name": name, "title": title, "serial": 0, "task": ""}
    header |= {"is_state": True, "values": {}, "chi2": float(np.nanmean(error**2))}
    items = [(str(item["kind"].item()), name_of(item)) for item in placed]
    header |= {"items": items, "added": [name for kind, name in items if kind == "effect"]}
    arrays = {
        "predicted": predicted,
        "deviation": np.repeat(noise[:, None], predicted.shape[1], axis=1),
        "error": error,
        "chi2_of_pairs": _mean(error**2),
        "chi2_of_bands": np.stack([_mean(band) for band in bands], axis=1),
        "places": np.array([item["posterior"].mean("draw").values for item in placed]),
    }
    return packed(header, arrays)


def _mean(squares: np.ndarray) -> np.ndarray:
    """Mean over lines; NaN where nothing was measured."""
    count = np.isfinite(squares).sum(axis=1)
    return np.asarray(np.nansum(squares, axis=1) / np.where(count, count, np.nan))


def _modes(saved: Saved) -> Iterator[bytes]:
    """Modes of the last model, and of the first one beside them."""
    groups = [saved.group(f"shapes_{number}") for number in (len(saved.models) - 1, 0)]
    now, before = groups
    if now is None or before is None:
        return
    from ....criticism.check.correlation import as_channels, mac  # where there are shapes alone

    shapes = [group["shape"].values for group in (now, before)]
    models = [
        {"frequency": group["natural_frequency"].values, "shape": shape}
        for group, shape in zip((now, before), shapes, strict=True)
    ]
    header = {"is": "modes", "now": models[0], "before": models[1], "beside": saved.models[0]}
    yield packed({**header, "mac": np.round(mac(*map(as_channels, shapes)), 6)}, {})
