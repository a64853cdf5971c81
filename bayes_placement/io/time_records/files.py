"""Recordings from files: WAV, TDMS, MDF, LabVIEW text, universal files, and arrays by name."""

import difflib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..._shared.arguments import check_annotated, check_kind
from ..._shared.errors import InputError, warn
from .. import _contents as content
from .._frf_units import VOLTAGE, plain
from .._gate import FileWarning, check_plausible, existing, path_of, reading
from ..arrays import load as load_arrays
from . import recorder_files
from .recording import Recording, Signal, is_known
from .records import Sampled, Samples, rate_of, rate_of_times

LOADERS: Mapping[str, Callable[[Path, Iterable[str]], Sampled]] = {
    content.WAV: recorder_files.load_wav,
    content.TDMS: recorder_files.load_tdms,
    content.MDF: recorder_files.load_mdf,
    content.LABVIEW: recorder_files.load_lvm,
    content.UNIVERSAL: recorder_files.load_universal,
}
"""Readers of formats with a sampling rate of their own, by what the first bytes tell."""


def read(
    path: str | Path,
    channels: Mapping[str, Signal],
    *,
    rate: float | int | None = None,
    time: str | None = None,
) -> Recording:
    """Read channels that were sampled together.

    WAV (RF64 too), TDMS, MDF, LabVIEW text (.lvm) and universal files (dataset 58) have a sampling
    rate; for files of arrays (MATLAB 5 to 7.3, text, NumPy, HDF5, workbooks) it is given, or
    follows from a column of times. The first bytes tell the format. Names in TDMS files are
    `group/channel`, in WAV files `channel 1` and so on, in universal files node and direction:
    `12+z`; a single array (.npy) has the name of its file.

    Parameters
    ----------
    path
        The file.
    channels
        For each label of a sensor or actuator, what it is in the file.
    rate
        Sampling rate [Hz], where the file has none.
    time
        Name of the array with the times [s] of the samples.

    Returns
    -------
    Recording
        Samples of each channel in SI, and their rate [Hz].

    Raises
    ------
    MissingExtraError
        If the library of a format is not installed.
    FileNotFoundError
        If there is no such file.
    InputError
        If a channel is not in the file, its unit contradicts that of the file, the sampling rate is
        not known or not even, or the reader refuses the file.

    Examples
    --------
    >>> np.savez("hits.npz", hammer=np.zeros(64), acc=np.zeros(64))
    >>> signal = bp.time_records.Signal
    >>> channels = {"a1": signal("hammer", "N"), "s1": signal("acc", "g")}
    >>> bp.time_records.read("hits.npz", channels, rate=512.0).quantity
    {'a1': 'force', 's1': 'acceleration'}
    """
    file = existing(path_of(path), "a file of time records")
    _check_channels(channels)
    check_annotated("time", time, str | None)
    with reading(file, "a file of time records", "Export it again."):
        sources = [_name(signal) for signal in channels.values()]
        sampled = _load(file, [*sources, *([] if time is None else [time])])
        raw = {label: _samples(sampled, signal) for label, signal in channels.items()}
        times = {} if time is None else {f"times {time!r}": _times(sampled, time)}
        _check_lengths({**raw, **times})
        stated = {sampled.rates[name] for name in sources if name in sampled.rates}
        known = rate_of(stated, rate, *map(rate_of_times, times.values()))
    scales = {label: signal.scale() for label, signal in channels.items()}
    samples = {label: values * scales[label].factor for label, values in raw.items()}
    check_plausible(file, **samples)
    quantity = {label: scale.quantity for label, scale in scales.items()}
    return Recording(known, samples, quantity)


def _check_channels(channels: Any) -> None:
    needed = "a Signal for each label is needed, since names and units are not guessed"
    instead = "{'hammer': Signal('Force', 'N'), 's1': Signal('Acc 1', 'm/s^2')}"
    check_kind("channels", channels, Mapping, needed, instead)
    for label, signal in channels.items():
        check_kind(f"channels[{label!r}]", signal, Signal, needed, instead)
    if not channels:
        raise InputError(f"channels={{}} was given; {needed}: {instead}.")


def _load(path: Path, names: list[str]) -> Sampled:
    kind = content.content_of(path)
    if kind in LOADERS:
        return LOADERS[kind](path, names)
    named = load_arrays(path)
    return Sampled(named.arrays, named.units, {}, named.left_out)


def _name(signal: Signal) -> str:
    return signal.source if isinstance(signal.source, str) else signal.source[0]


def _array(sampled: Sampled, name: str) -> np.ndarray:
    if name in sampled.left_out:
        raise InputError(
            f"{name!r} cannot be used: {sampled.left_out[name]}; one row of numbers is needed, "
            "since it is a record in time. Export it as such, under a name of its own."
        )
    if name not in sampled.arrays:
        close = difflib.get_close_matches(name, sampled.arrays, n=1)
        meant = f" Did you mean {close[0]!r}?" if close else ""
        raise InputError(
            f"There is no {name!r} in it.{meant} It holds {', '.join(map(repr, sampled.arrays))}: "
            "name one of them in Signal(...)."
        )
    array = sampled.arrays[name]
    if not array.size:
        raise InputError(
            f"{name!r} holds no sample; a record of some is needed, since FRFs are estimated from "
            "it. Export it again."
        )
    if array.dtype.kind not in "iuf":
        raise InputError(
            f"{name!r} holds {array.dtype}; real numbers are needed, since it is a record in time."
        )
    return array


def _samples(sampled: Sampled, signal: Signal) -> Samples:
    """Samples of a channel, in the unit of the file."""
    name = _name(signal)
    array = np.squeeze(_array(sampled, name))
    _check_unit(signal, sampled.units.get(name, ""))
    if isinstance(signal.source, str) == (array.ndim == 1):
        return np.asarray(array if array.ndim == 1 else _column(name, array, signal.source), float)
    named = "one column of several" if array.ndim == 1 else "no column"
    raise InputError(
        f"{name!r} has the shape {array.shape}, and Signal names {named}; the samples of one "
        f"channel are needed: Signal({name!r}, ...) for one row, Signal(({name!r}, 1), ...) for "
        "several."
    )


def _check_unit(signal: Signal, stated: str) -> None:
    """Refuse another unit than the file states; what is no known unit contradicts none."""
    if not stated or plain(stated) == plain(signal.unit):
        return
    name = repr(signal.source)
    if not is_known(stated):
        warn(
            f"{name} is in {stated!r} by the file, which is no unit that is known; that of Signal "
            f"is taken, {signal.unit!r}. Compare it with the settings of the recorder.",
            FileWarning,
        )
        return
    sensitivity = ', sensitivity="100 mV/g"' if plain(stated) in VOLTAGE else ""
    raise InputError(
        f"{name} is in {stated!r} by the file, and Signal says {signal.unit!r}; one unit is "
        f"needed, since either could be meant: Signal({name}, unit={stated!r}{sensitivity})."
    )


def _times(sampled: Sampled, name: str) -> Samples:
    """Times [s] of the samples."""
    unit = sampled.units.get(name, "")
    if plain(unit) not in ("", "s"):
        raise InputError(
            f"The times {name!r} are in {unit!r} by the file; seconds are needed, since the "
            "sampling rate is in Hz. Give the rate instead: rate=4096.0, without time=."
        )
    return np.asarray(_array(sampled, name), float).ravel()


def _column(name: str, array: np.ndarray, source: Any) -> np.ndarray:
    """Channel of an array of several, along whose longer axis time goes."""
    number = source[1]
    if array.ndim != 2 or array.shape[0] == array.shape[1]:
        raise InputError(
            f"{name!r} has the shape {array.shape}; samples and channels are needed, the samples "
            "along the longer axis, since it does not say which is which."
        )
    rows = array if array.shape[0] < array.shape[1] else array.T
    if not 1 <= number <= len(rows):
        raise InputError(
            f"Column {number} of {name!r} was requested, which has {len(rows)}; one from 1 to "
            f"{len(rows)} is needed: Signal(({name!r}, 1), ...)."
        )
    return np.asarray(rows[number - 1])


def _check_lengths(samples: Mapping[str, Samples]) -> None:
    lengths = {label: values.size for label, values in samples.items()}
    if len(set(lengths.values())) > 1:
        counts = ", ".join(f"{label} {count}" for label, count in lengths.items())
        raise InputError(
            f"The channels have different numbers of samples: {counts}; the same samples of all "
            "are needed, since force and response are compared in time. Export them together."
        )
