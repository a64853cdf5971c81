"""Panels of what was measured and what models predict: outputs, errors, maps of these, modes."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from .._shared.labels import AS_DRAWN, FORCE_LEVEL
from ._colours import AFTER, BEFORE, DATA, FLOOR, INK, Style
from ._figures import HALF_TURN, LOGARITHM, channels, edges, in_decibels, phase_axis, unbroken

DASHES = {FLOOR: (0, (4, 2)), BEFORE: (0, (6, 1, 1, 1))}
"""Styles of the lines of a model as drawn and as given, which a print in grey tells apart."""

OUTSIDE = f"{AS_DRAWN}, beyond the edge"
"""Label of the marks where that model lies outside of a panel."""

MARGIN = 0.06
"""Share of what is shown that stays free above and below."""


def colours_of(models: Mapping[str, xr.Dataset]) -> dict[str, str]:
    """Colours of models by name; that as drawn has one of its own."""
    fitted = [name for name in models if name != AS_DRAWN]
    colours = [BEFORE, AFTER] if len(fitted) > 1 else [AFTER]
    known = {AS_DRAWN: FLOOR, **dict(zip(fitted, colours, strict=True))}
    return {name: known[name] for name in models}


def draw_measured(axes: np.ndarray, fit: xr.Dataset, rows: int) -> None:
    """Draw what was measured, once, as pale dots below the lines, which they would hide."""
    style: Style = {"color": DATA, "markersize": 5, "alpha": 0.5, "zorder": 1, "markeredgewidth": 0}
    for panel, channel in channels(axes[::rows], fit):
        measured, _ = in_decibels(channel["measured"], channel["measured"].attrs["units"])
        panel.plot(channel["frequency"], measured, ".", label="measured", **style)
    if "measured_phase" not in fit:
        return
    for panel, channel in channels(axes[1::rows], fit):
        panel.plot(channel["frequency"], channel["measured_phase"], ".", **style)


def draw_response(panel: Axes, channel: xr.Dataset, name: str, color: str) -> None:
    """Draw the amplitude that a model predicts; one as drawn may lie far below what is shown."""
    values, label = in_decibels(channel["predicted"], channel["predicted"].attrs["units"])
    panel.plot(channel["frequency"], values, label=name, **line_style(color))
    panel.set_ylabel(label)
    if color != FLOOR:
        measured, _ = in_decibels(channel["measured"], channel["measured"].attrs["units"])
        fitted = [curve.get_ydata() for curve in panel.lines if curve.get_color() != FLOOR]
        show_all_of(panel, [*map(np.asarray, fitted), measured.values])


def mark_outside(panel: Axes, channel: xr.Dataset) -> None:
    """Mark at the edges of a panel where the model as drawn lies outside of it."""
    values, _ = in_decibels(channel["predicted"], channel["predicted"].attrs["units"])
    low, high = panel.get_ylim()
    for is_outside, edge, marker in ((values < low, 0.0, "v"), (values > high, 1.0, "^")):
        lines = channel["frequency"].values[is_outside.values]
        if lines.size:
            style: Style = {"color": FLOOR, "markersize": 3, "linestyle": "none"}
            style |= {"marker": marker, "transform": panel.get_xaxis_transform()}
            panel.plot(lines, np.full(lines.size, edge), label=OUTSIDE, clip_on=False, **style)


def show_all_of(panel: Axes, curves: Sequence[np.ndarray]) -> None:
    """Let the axis reach over all of these curves, whatever else is drawn."""
    shown = np.concatenate([curve[np.isfinite(curve)] for curve in curves])
    margin = MARGIN * float(np.ptp(shown)) or 1.0
    panel.set_ylim(float(shown.min()) - margin, float(shown.max()) + margin)


def line_style(color: str) -> Style:
    """Style of the line of a model; that of the last one is unbroken."""
    return {"color": color, "linestyle": DASHES.get(color, "-"), "linewidth": 1.1}


def draw_phase(panel: Axes, channel: xr.Dataset, color: str) -> None:
    """Draw the phase that a model predicts."""
    phase = unbroken(channel["predicted_phase"].values)
    panel.plot(channel["frequency"], phase, **line_style(color))
    phase_axis(panel)


def have_one_noise(fits: Mapping[str, xr.Dataset]) -> bool:
    """Whether the noise is the same for all models: each infers its own where it is not known."""
    first, *others = (fit["noise"].values for fit in fits.values())
    return all(np.allclose(first, other, equal_nan=True, atol=0.0) for other in others)


def draw_error(
    panel: Axes, channel: xr.Dataset, name: str, color: str, *, has_own_noise: bool
) -> None:
    """Draw what a model leaves, and the noise; that of a model alone has the style of its line."""
    style = line_style(color) | {"linewidth": 0.8, "label": f"error, {name}"}
    panel.plot(channel["frequency"], channel["error"], **style)
    noise = line_style(color) if has_own_noise else {}
    noise |= {"color": INK, "linewidth": 1, "label": f"noise, {name}" if has_own_noise else "noise"}
    panel.plot(channel["frequency"], channel["noise"], **noise)
    panel.set_yscale("log")
    label = channel["error"].attrs["units"]
    unit = "log10 of ratio]" if label.startswith("log10") else label.rpartition("[")[2]
    panel.set_ylabel(f"size of error\n[{unit}")


POSTERIOR = AFTER
"""Colour of posteriors."""

SPARSE = 30
"""Up to so many lines are marked one by one, since the curve between them is no measurement."""


def draw_band(panel: Axes, channel: xr.Dataset, name: str) -> None:
    """Draw mean and band, what was measured, and the reference."""
    lines, low, high = (channel[variable].values for variable in ("frequency", "low", "high"))
    label = f"{name}, 90 % band"
    panel.fill_between(lines, low, high, color=POSTERIOR, alpha=0.3, label=label)
    style = "-" if lines.size > SPARSE else ".-"
    panel.plot(lines, channel["mean"], style, color=POSTERIOR, label=f"{name}, mean")
    if "measured" in channel:
        draw_measured_dots(panel, channel, "measured")
    if "reference" in channel:
        panel.plot(lines, channel["reference"], color=DATA, label="as recorded", linewidth=1)


def draw_phases(panel: Axes, channel: xr.Dataset) -> None:
    """Draw mean and band of the phase, and what was measured."""
    lines, mean, low, high = (channel[key].values for key in ("frequency", "mean", "low", "high"))
    for shift in (-2 * HALF_TURN, 0.0, 2 * HALF_TURN):  # a band goes on at the other end
        panel.fill_between(
            lines, low + shift, high + shift, color=POSTERIOR, alpha=0.3, linewidth=0
        )
    panel.plot(lines, unbroken(mean), color=POSTERIOR)
    if "measured" in channel:
        draw_measured_dots(panel, channel)
    phase_axis(panel)


def draw_measured_dots(panel: Axes, channel: xr.Dataset, label: str | None = None) -> None:
    """Draw what was measured where a curve stays seen: below it, or as circles about its dots."""
    lines, measured = channel["frequency"].values, channel["measured"]
    is_sparse = lines.size <= SPARSE
    size, fill = (13.0, "none") if is_sparse else (4.0, "full")
    panel.plot(
        lines, measured, ".", ms=size, fillstyle=fill, color=DATA, label=label, zorder=BELOW_CURVES
    )


def unit_of_difference(unit: str) -> str:
    """A difference of logarithms is that of a ratio."""
    return "[dB]" if unit.startswith(LOGARITHM) else unit.rpartition(" ")[2]


BELOW_CURVES = 1.5
"""Place of dots in the order in which a figure is drawn: above bands, below curves."""

BANDS = 40
"""Bands, at most, in which the residual is told."""

FAINTEST, BRIGHTEST = 0.3, 10.0
"""Least range of colours [noise deviations]."""

ROW, MOST_NAMES = 0.13, 30
"""Height of a channel pair [inch], and pairs whose names are written."""

LETTERS = 7
"""Size of its name [pt]."""

LABEL = "residual / noise [1]"


def in_bands(fit: xr.Dataset) -> xr.DataArray:
    """Root mean square of the error over the noise by measured channel pair and band.

    The `edges` of the bands [Hz] are its attribute.
    """
    dimensions = [word for word in ("sensor", "actuator", FORCE_LEVEL) if word in fit.dims]
    flat = (fit["error"] / fit["noise"]).stack(channel=dimensions, create_index=False)
    measured = flat.isel(channel=np.flatnonzero(flat.notnull().any("frequency")))
    parts = np.array_split(np.arange(fit.sizes["frequency"]), min(BANDS, fit.sizes["frequency"]))
    # Errors of complex outputs are of both parts, as the noise is.
    squares = [(measured.isel(frequency=part) ** 2).mean("frequency") for part in parts]
    bounds = edges(fit["frequency"].values)[[0, *(int(part[-1]) + 1 for part in parts)]]
    sizes: xr.DataArray = xr.concat(squares, "band") ** 0.5
    return sizes.transpose("channel", "band").assign_attrs(edges=bounds)


def pair_names(channels: xr.DataArray) -> list[str]:
    """Names of channel pairs, with their force level where there are several."""
    levels = channels.coords.get(FORCE_LEVEL)
    ends = [""] * channels.sizes["channel"] if levels is None else [f", {f:g} N" for f in levels]
    pairs = zip(channels["sensor"].values, channels["actuator"].values, ends, strict=True)
    return [f"{sensor}, {actuator}{end}" for sensor, actuator, end in pairs]


def height_of(pairs: int) -> float:
    """Height of a panel of so many channel pairs [inch]."""
    return 0.7 + ROW * min(pairs, MOST_NAMES)


def name_rows(panel: Axes, names: Sequence[str]) -> None:
    """Name channel pairs, of very many each n-th."""
    step = -(-len(names) // MOST_NAMES)
    panel.set_yticks(range(0, len(names), step), names[::step], fontsize=LETTERS)


def draw_maps(figure: Figure, axes: np.ndarray, sizes: dict[str, xr.DataArray]) -> None:
    """Draw a map for each model below the other, all in one scale of colours."""
    greatest = max([BRIGHTEST, *(float(size.max()) for size in sizes.values())])
    norm = LogNorm(FAINTEST, greatest, clip=True)
    for panel, (name, size) in zip(axes.flat, sizes.items(), strict=True):
        mesh = _draw(panel, size, norm)
        panel.set_title(name)
    axes.flat[-1].set_xlabel("frequency [Hz]")
    figure.colorbar(mesh, ax=axes.ravel().tolist(), label=LABEL, fraction=0.05, pad=0.01)


def _draw(panel: Axes, size: xr.DataArray, norm: LogNorm) -> QuadMesh:
    names = pair_names(size)
    rows = np.arange(len(names) + 1) - 0.5
    mesh = panel.pcolormesh(size.attrs["edges"], rows, size.values, norm=norm, cmap="cividis")
    mesh.set_rasterized(True)  # small in an SVG
    name_rows(panel, names)
    panel.invert_yaxis()
    return mesh


DEVIATIONS = 1.96
"""Standard deviations to either side of an interval that holds 95 %."""

DODGE = 0.16
"""Distance of the marks of two models of one mode."""

MARKS = ("o", "s", "D", "^")

PERCENT = 100.0

FADED = 0.75
"""Opacity of a square of a modal assurance criterion of 1, below the number on it."""


OfModes = Float[np.ndarray, "mode"]
Models = Iterator[tuple[str, float, Style, xr.Dataset]]


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
        style: Style = {"ha": "center", "va": "center", "fontsize": 8}
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


def _models(fits: Mapping[str, xr.Dataset], colours: Colours) -> Models:
    """Name, shift to the side, style and modes of each model."""
    middle = (len(fits) - 1) / 2
    for number, (name, fit) in enumerate(fits.items()):
        style: Style = {
            "marker": MARKS[number % len(MARKS)],
            "linestyle": "none",
            "markersize": 5,
            "color": colours.models[number % len(colours.models)],
        }
        yield name, DODGE * (number - middle), style, fit


def _draw_measured(panel: Axes, values: OfModes, half: OfModes, colours: Colours) -> None:
    """Draw what was measured with intervals of 95 %."""
    style: Style = {"color": colours.measured, "linestyle": "none", "capsize": 4}
    places = np.arange(len(values))
    panel.errorbar(places, values, half, marker="_", label="measured, 95 %", **style)


def _name_modes(panel: Axes, frequency: OfModes) -> None:
    labels = [f"{number}\n{hertz:.4g}" for number, hertz in enumerate(frequency, 1)]
    panel.set_xticks(range(len(labels)), labels)
    panel.set_xlim(-0.5, len(labels) - 0.5)
    panel.set_xlabel("measured mode, natural frequency [Hz]")
