"""Panels of measured and model modes: natural frequency, damping ratio, likeness of shapes."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

DEVIATIONS = 1.96
"""Standard deviations to either side of an interval that holds 95 %."""

DODGE = 0.16
"""Distance of the marks of two models of one mode."""

MARKS = ("o", "s", "D", "^")

PERCENT = 100.0

FADED = 0.75
"""Opacity of a square of a modal assurance criterion of 1, below the number on it."""


class Colours(NamedTuple):
    """Colours of what was measured and of the models, and of squares and the numbers on them."""

    measured: str
    models: Sequence[str]
    square: str
    ink: str


def draw_frequencies(panel: Axes, fits: Mapping[str, xr.Dataset], colours: Colours) -> None:
    """Draw natural frequencies of models over the measured ones, less 1, in %."""
    first = next(iter(fits.values()))
    measured = first["natural_frequency"].values
    half = PERCENT * DEVIATIONS * first["natural_frequency_deviation"].values / measured
    _draw_measured(panel, np.zeros(measured.size), half, colours)
    for name, shift, style, fit in _models(fits, colours):
        offset = PERCENT * (fit["natural_frequency_of_model"].values / measured - 1)
        panel.plot(np.arange(measured.size) + shift, offset, label=name, **style)
    panel.axhline(0.0, color=colours.ink, linewidth=0.5)
    panel.set_ylabel("natural frequency,\nmodel less measured [%]")
    _name_modes(panel, measured)


def draw_damping(panel: Axes, fits: Mapping[str, xr.Dataset], colours: Colours) -> None:
    """Draw damping ratios in %."""
    first = next(iter(fits.values()))
    measured = PERCENT * first["damping_ratio"].values
    half = PERCENT * DEVIATIONS * first["damping_ratio_deviation"].values
    _draw_measured(panel, measured, half, colours)
    for name, shift, style, fit in _models(fits, colours):
        ratio = PERCENT * fit["damping_ratio_of_model"].values
        panel.plot(np.arange(measured.size) + shift, ratio, label=name, **style)
    panel.set_ylabel("damping ratio [%]")
    _name_modes(panel, first["natural_frequency"].values)


def draw_assurance(panel: Axes, fit: xr.Dataset, colours: Colours) -> None:
    """Draw the modal assurance criterion of each measured mode with modes of a model."""
    criterion = fit["assurance"].values
    for row, column in np.ndindex(criterion.shape):
        value = float(criterion[row, column])
        corner = column - 0.5, row - 0.5
        square = Rectangle(corner, 1, 1, facecolor=colours.square, alpha=FADED * value)
        panel.add_patch(square)
        style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 8}
        panel.text(column, row, f"{value:.2f}".lstrip("0"), color=colours.ink, **style)
    for row, number in enumerate(fit["number"].values):
        corner = int(number) - 1.5, row - 0.5
        panel.add_patch(Rectangle(corner, 1, 1, fill=False, edgecolor=colours.ink, linewidth=1.2))
    rows, columns = criterion.shape
    panel.set(xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5))
    panel.set_xticks(range(columns), [str(number) for number in fit["mode_of_model"].values])
    panel.set_yticks(range(rows), [str(number) for number in fit["mode"].values])
    panel.set_xlabel("mode of the model")
    panel.set_ylabel("measured mode")


def has_damping(fits: Mapping[str, xr.Dataset]) -> bool:
    """Whether a damping ratio was measured."""
    first = next(iter(fits.values()))
    return bool(np.isfinite(first["damping_ratio"].values).any())


def with_shapes(fits: Mapping[str, xr.Dataset]) -> dict[str, xr.Dataset]:
    """Those of the models whose shapes can be compared."""
    return {name: fit for name, fit in fits.items() if "assurance" in fit}


def _models(fits: Mapping[str, xr.Dataset], colours: Colours) -> Any:
    """Name, shift to the side, style and modes of each model."""
    middle = (len(fits) - 1) / 2
    for number, (name, fit) in enumerate(fits.items()):
        style: dict[str, Any] = {
            "marker": MARKS[number % len(MARKS)],
            "linestyle": "none",
            "markersize": 5,
            "color": colours.models[number % len(colours.models)],
        }
        yield name, DODGE * (number - middle), style, fit


def _draw_measured(panel: Axes, values: Any, half: Any, colours: Colours) -> None:
    """Draw what was measured with intervals of 95 %."""
    style: dict[str, Any] = {"color": colours.measured, "linestyle": "none", "capsize": 4}
    places = np.arange(len(values))
    panel.errorbar(places, values, half, marker="_", label="measured, 95 %", **style)


def _name_modes(panel: Axes, frequency: Any) -> None:
    labels = [f"{number}\n{hertz:.4g}" for number, hertz in enumerate(frequency, 1)]
    panel.set_xticks(range(len(labels)), labels)
    panel.set_xlim(-0.5, len(labels) - 0.5)
    panel.set_xlabel("measured mode, natural frequency [Hz]")
