"""Misfit of a model as given, then with one more effect each time, in a panel."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

from .._shared.files import Json
from ._colours import AFTER

LEAST_MISFIT = 1e-3
"""Misfit below which a point stands at the lower end: data without noise can be fitted exactly."""

OF_SPAN = 0.12
"""Share of the height of all points, on a scale of logarithms, that is left above them."""


class Falling(NamedTuple):
    """Misfit of each step that no error takes up, what it is, and that of the noise alone."""

    values: list[float]
    quantity: str
    label: str = "misfit of the best fit"
    floor: float = 1.0
    floor_label: str = "noise floor of a correct model"


def told_misfit(steps: Sequence[Json]) -> Falling:
    """Misfit of each step of a ledger that no error takes up: without model error, where known.

    Where the noise is not known that is the noise that each step needs, held against the scatter of
    neighbouring lines about the last one: what a step misses, it takes for noise and scatter both.
    """
    noise, chi2 = "noise_needed", "chi2_per_datum"
    is_noise_known = any(step[noise] is None for step in steps)
    exact = [step.get(f"{chi2 if is_noise_known else noise}_when_exact") for step in steps]
    end, without = ("", "") if None in exact else ("_when_exact", " without model error")
    squares = _numbers(steps, f"{chi2}{end}")
    if is_noise_known:
        return Falling(squares.tolist(), f"reduced chi-square{without} [1]")
    noises = [step[f"{noise}{end}"] for step in steps]
    shares = 100 * _numbers(noises, "relative")
    words = f"noise needed{without}, of the amplitude [%]", "noise that the best fit needs"
    floor = float(shares[-1] / _numbers(noises, "over_scatter")[-1])
    return Falling(shares.tolist(), *words, floor, "scatter of neighbouring lines")


def _numbers(rows: Sequence[Json], name: str) -> Float[np.ndarray, "step"]:
    return np.array([row[name] for row in rows], dtype=float)


def draw_falling(
    panel: Axes, names: list[str], misfit: Falling, floor: str, *, top: float, beside: float
) -> None:
    """Draw the misfit of steps above the noise, with room beside them and, by a factor, above."""
    drawn = np.maximum(misfit.values, LEAST_MISFIT)
    panel.plot(range(len(drawn)), drawn, "o-", color=AFTER, label=misfit.label)
    for number, (value, height) in enumerate(zip(misfit.values, drawn, strict=True)):
        panel.annotate(short(value), (number, height), (8, 4), textcoords="offset points")
    shown = drawn
    if np.isfinite(misfit.floor):  # too few lines have no scatter
        panel.axhline(misfit.floor, color=floor, linestyle="--", label=misfit.floor_label)
        shown = np.append(drawn, misfit.floor)
    panel.set_yscale("log")
    room = max(top, float(shown.max() / shown.min()) ** OF_SPAN)  # numbers stand above their points
    panel.set_ylim(0.5 * shown.min(), room * shown.max())
    panel.set_xlim(-beside, len(drawn) - beside)
    panel.set_xticks(range(len(names)), names)


def short(value: float) -> str:
    """Write a number of at least three digits."""
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"
