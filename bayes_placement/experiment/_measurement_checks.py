"""Checks of the arrays of a measurement: axes, gaps, ranges, and lines that are asked for."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from jaxtyping import Float, Int

from .._shared.arguments import as_array, check_annotated, finite_number, shown
from .._shared.errors import InputError
from ._noise_level import FEWEST_FITTED

PairLabel = Callable[[int, int], str]


def frequency(lines: np.ndarray) -> None:
    """Refuse lines that are not one increasing axis of frequencies [Hz]."""
    if lines.ndim != 1 or lines.size == 0:
        raise InputError(
            f"frequency has shape {lines.shape}; one axis with at least one line [Hz] is needed: "
            "frequency=np.arange(1.0, 100.0)."
        )
    if not np.isfinite(lines).all() or lines[0] < 0:
        raise InputError(
            f"frequency has the value {lines[~(lines >= 0) | np.isinf(lines)][0]:g} Hz; lines must "
            "be finite and not negative, since FRFs are one-sided: frequency[frequency >= 0]."
        )
    falling = np.flatnonzero(np.diff(lines) <= 0)
    if falling.size:
        before, after = lines[falling[0]], lines[falling[0] + 1]
        raise InputError(
            f"frequency goes from {before:g} Hz to {after:g} Hz; it must increase from line to "
            "line, so that each line is found. Sort both by np.argsort(frequency)."
        )


def shape(name: str, values: np.ndarray, needed: tuple[int, int, int]) -> None:
    """Refuse an array that is not laid out as sensor, actuator, frequency."""
    if values.shape != needed:
        raise InputError(
            f"{name} has shape {values.shape}; (sensor, actuator, frequency) = {needed} is needed "
            "by the channels and lines given. Move its axes: np.moveaxis(frf, source, destination)."
        )


def frf(values: np.ndarray, lines: np.ndarray, label: PairLabel) -> None:
    """Refuse gaps inside a measured pair, and a measurement of nothing."""
    unmeasured = np.isnan(values).all(axis=-1)
    if unmeasured.all():
        raise InputError(
            "frf holds nothing but NaN; at least one pair of sensor and actuator must be measured, "
            "since there is nothing to learn from otherwise. Look at how the file was read."
        )
    gaps = np.argwhere(~np.isfinite(values) & ~unmeasured[..., None])
    if gaps.size:
        row, column, line = gaps[0].tolist()
        raise InputError(
            f"frf is {values[row, column, line]:g} for {label(row, column)} at {lines[line]:g} Hz; "
            "a measured pair needs a finite value at every line, and NaN throughout means not "
            "measured. Drop the line for all pairs: frf[..., np.isfinite(frf).all(axis=(0, 1))]."
        )


def coherence(values: np.ndarray, lines: np.ndarray, label: PairLabel) -> None:
    """Refuse a coherence outside [0, 1] and gaps; NaN at every line stands for unknown."""
    estimated = ~np.isnan(values).all(axis=-1, keepdims=True)
    outside = np.argwhere(~((values >= 0) & (values <= 1)) & estimated)
    if outside.size:
        row, column, line = outside[0].tolist()
        raise InputError(
            f"coherence is {values[row, column, line]:g} for {label(row, column)} at "
            f"{lines[line]:g} Hz; it must lie between 0 and 1, being a share of power. Give the "
            "ordinary coherence |Gxy|^2 / (Gxx Gyy), or NaN at every line where it is unknown."
        )


def averages(count: float | int | None) -> None:
    """Refuse a number of averages that is no positive integer."""
    if count is not None:
        finite_number("averages", count, "averages=16")
    if count is not None and not (count >= 1 and count == int(count)):
        raise InputError(
            f"averages={count} was given; a whole number of at least 1 is needed, since it divides "
            "the variance of the FRF: averages=16."
        )


def force_level(amplitude: float | int | None) -> None:
    """Refuse a force amplitude [N] that is not positive and finite."""
    if amplitude is not None:
        finite_number("force_level", amplitude, "force_level=0.5")
    if amplitude is not None and not 0 < amplitude < np.inf:
        raise InputError(
            f"force_level={amplitude} was given; a positive amplitude [N] is needed, since an FRF "
            "is motion per force: force_level=0.5."
        )


def positions(
    recorded: Mapping[str, Sequence[float | int]],
) -> dict[str, tuple[float, float, float]]:
    """Return recorded coordinates [m] as three finite numbers for each transducer."""
    check_annotated("positions", recorded, Mapping[str, object])
    return {name: _point(name, point) for name, point in recorded.items()}


def _point(name: str, point: Sequence[float | int]) -> tuple[float, float, float]:
    values = np.asarray(point)
    coordinates = values.astype(float) if values.dtype.kind in "iuf" else np.full(1, np.nan)
    if coordinates.shape != (3,) or not np.isfinite(coordinates).all():
        raise InputError(
            f"The position of {name!r} was given as {point}; three finite coordinates [m] are "
            f"needed, since structures lie in space: positions={{{name!r}: (0.25, 0.0, 0.0)}}."
        )
    x, y, z = coordinates.tolist()
    return x, y, z


def variance(values: np.ndarray, measured: np.ndarray, lines: np.ndarray, label: PairLabel) -> None:
    """Refuse a variance that is zero, infinite or NaN where a pair was measured."""
    useful = (values > 0) & np.isfinite(values)
    useless = np.argwhere(~useful & measured[..., None])
    if useless.size:
        row, column, line = useless[0].tolist()
        raise InputError(
            f"Coherence and FRF make the variance of {label(row, column)} at {lines[line]:g} Hz "
            f"{values[row, column, line]:g}; a positive one is needed, since coherence 0 means an "
            "unbounded error, coherence 1 or a zero FRF means none, and NaN is unknown. Leave such "
            "lines out: measurement.without(low, high); or state the "
            "error: noise.Gaussian(sigma) with coherence=None."
        )


def stated_variance(
    values: np.ndarray, measured: np.ndarray, lines: np.ndarray, label: PairLabel
) -> None:
    """Refuse a stated variance that is zero or unknown where a pair was measured."""
    useless = np.argwhere(~(values > 0) & measured[..., None])
    if useless.size:
        row, column, line = useless[0].tolist()
        raise InputError(
            f"The variance of {label(row, column)} at {lines[line]:g} Hz is "
            f"{values[row, column, line]:g}; a positive one is needed, since a likelihood without "
            "noise is infinite. Repeats that agree in all digits are one record copied, and lines "
            "that do not scatter are computed; state the error: noise.Gaussian(sigma)."
        )


def no_coherence(has_coherence: bool) -> InputError:
    """Return the error that says what the error of an FRF follows from."""
    missing = "number of averages" if has_coherence else "coherence"
    field = "averages=20" if has_coherence else "coherence=coherence"
    line = "averages = 20" if has_coherence else 'coherence = "coh"'
    return InputError(
        f"The measurement has no {missing}; both are needed, since the error of an FRF follows "
        f"from the two together. Give what is missing: Measurement.from_arrays(..., {field}), or "
        f"in the mapping of a file {line}; read the error from the scatter of the lines: "
        "noise.FromScatter(); or state it: noise.Gaussian(sigma)."
    )


def no_variance() -> InputError:
    """Return the error that says where a variance is stated."""
    return InputError(
        "The measurement states no variance of its FRFs; one is needed, since the size of the "
        "error is read from it. Take time records, bp.time_records.frf(...), state it, "
        "Measurement.from_arrays(..., variance=...), or use noise.FromCoherence()."
    )


def no_line(request: str, lines: np.ndarray) -> InputError:
    """Return the error that says which lines there are."""
    return InputError(
        f"{request} leaves no line of this measurement, which has {lines.size} from "
        f"{lines[0]:g} to {lines[-1]:g} Hz; at least one is needed. Choose a band [Hz] that "
        "overlaps with them."
    )


def no_scatter(lines: np.ndarray) -> InputError:
    """Return the error that says why the scatter of lines is not known."""
    return InputError(
        f"The scatter of {lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz was asked for; "
        f"at least {FEWEST_FITTED} that are evenly spaced are needed, since noise is what "
        "neighbours do not share. Read the whole record and choose lines then: "
        "measurement.thinned(200); or state the error: noise.Gaussian(sigma)."
    )


def not_negative(values: np.ndarray, lines: np.ndarray, label: PairLabel) -> None:
    """Refuse variances that are negative or infinite, and gaps; NaN at every line is unknown."""
    known = ~np.isnan(values).all(axis=-1, keepdims=True)
    wrong = np.argwhere(~((values >= 0) & np.isfinite(values)) & known)
    if wrong.size:
        row, column, line = wrong[0].tolist()
        raise InputError(
            f"variance is {values[row, column, line]:g} for {label(row, column)} at "
            f"{lines[line]:g} Hz; it must be finite and not negative, being E|error|^2. Give NaN "
            "at every line of a pair where it is unknown."
        )


def not_measured(requested: np.ndarray, lines: np.ndarray, index: np.ndarray) -> InputError:
    """Return the error that names lines that are missing, and the line that takes measured ones.

    Lines are in Hz. The index of each is the number of the nearest measured one where that is too
    far away, else -1.
    """
    missing = np.flatnonzero(index >= 0)
    pairs = zip(requested[missing[:5]], lines[index[missing[:5]]], strict=True)
    shown = [f"{line:g} Hz (nearest {measured:g} Hz)" for line, measured in pairs]
    tail = f" and {missing.size - 5} more" if missing.size > 5 else ""
    return InputError(
        f"{missing.size} of the frequencies given were not measured: {', '.join(shown)}{tail}. A "
        "measured line is needed for each, since FRFs are not interpolated across resonances; "
        f"measured were {lines.size} lines from {lines[0]:g} to {lines[-1]:g} Hz. "
        f"{_measured_instead(requested, lines)}."
    )


def _measured_instead(requested: np.ndarray, lines: np.ndarray) -> str:
    """Say how to take the measured lines of the band that was asked for, or all where it has none.

    The numbers are those that are written: rounded to six digits they may leave out the last line.
    """
    low, high = (float(f"{end:g}") for end in (requested.min(), requested.max()))
    inside = int(np.sum((lines >= low) & (lines <= high)))
    if not inside:
        return "None of them lies in the band asked for: frequency=measurement.frequency takes all"
    return (
        f"The {inside} of them in the band asked for: "
        f"frequency=measurement.band({low:g}, {high:g}).frequency"
    )


def numeric(argument: str, values: object, kinds: str) -> None:
    """Refuse an array of something else than numbers.

    Kinds are those of NumPy's types that are taken: `iuf` for real numbers, `c` for complex ones.
    """
    array = as_array(values)
    if array.dtype.kind not in kinds:
        number = "complex or real" if "c" in kinds else "real"
        raise InputError(
            f"{argument}={shown(values)} was given, of {array.dtype}; an array of {number} numbers "
            f"is needed, since FRFs are computed with: {argument}=np.asarray(..., dtype=float)."
        )


def band(low: object, high: object) -> None:
    """Refuse limits of a band that are no numbers, or fall."""
    first = finite_number("low", low, "band(100.0, 200.0)")
    last = finite_number("high", high, "band(100.0, 200.0)")
    if last < first:
        raise InputError(
            f"A band from {first:g} to {last:g} Hz was given; its limits must rise, since no line "
            f"lies in it otherwise: band({last:g}, {first:g})."
        )


# Universal files carry 6 significant digits of the first line and of the spacing, so a line is
# known to 5e-6 of its frequency; twice that still tells apart the lines of any such file.
LINE_TOLERANCE = 1e-5


def measured_lines(
    frequency: Float[np.ndarray, "frequency"], requested: Float[np.ndarray, "requested"]
) -> Int[np.ndarray, "requested"]:
    """Index of the measured line at each requested frequency [Hz]."""
    nearest = np.rint(np.interp(requested, frequency, np.arange(frequency.size))).astype(int)
    close = np.isclose(frequency[nearest], requested, rtol=LINE_TOLERANCE, atol=0.0)
    if not close.all():
        raise not_measured(requested, frequency, np.where(close, -1, nearest))
    if np.any(np.diff(nearest) <= 0):
        raise InputError(
            "The frequencies given do not increase from one measured line to the next; each "
            "line is needed once, since a line that counts twice makes the answer too certain: "
            "measurement.lines(np.unique(frequency))."
        )
    return nearest
