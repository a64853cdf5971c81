"""Time histories of universal files (dataset 58, function type 1)."""

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ...positions.channel import Channel
from ..uff._datasets import FUNCTION, Dataset, MeasurementFileError
from ..uff._datasets import load as datasets_of
from .clock import Sampled, check_starts, rate_of_times

TIME_RESPONSE = 1
_TIME = 17  # data type of the abscissa
_UNSTATED = ("", "NONE")


def load(path: Path, names: Iterable[str]) -> Sampled:
    """Read time histories by node and direction (`12+z`), with unit and sampling rate.

    Further records of one node and direction are `12+z (2)` and so on.
    """
    functions = [dataset for dataset in datasets_of(path) if dataset.number == FUNCTION]
    records = _named([one for one in functions if one.fields["func_type"] == TIME_RESPONSE])
    if not records:
        types = sorted({dataset.fields["func_type"] for dataset in functions})
        raise MeasurementFileError(
            f"{path} holds {f'functions of type {types}' if types else 'no function'}; time "
            f"histories (dataset 58, function type {TIME_RESPONSE}) are needed here. FRFs are read "
            "by bp.io.read(path)."
        )
    times = {name: np.asarray(record.fields["x"], float) for name, record in records.items()}
    check_starts({name: float(times[name][0]) for name in names if name in times})
    return Sampled(
        arrays={name: np.asarray(record.fields["data"]) for name, record in records.items()},
        units={name: _unit(record) for name, record in records.items()},
        rates={name: rate_of_times(values) for name, values in times.items()},
    )


def _named(datasets: list[Dataset]) -> dict[str, Dataset]:
    seen: Counter[str] = Counter()
    named = {}
    for dataset in datasets:
        _check_abscissa(dataset)
        fields = dataset.fields
        node, direction = str(fields["rsp_node"]), fields["rsp_dir"]
        is_translation = abs(direction) <= 3
        label = (
            Channel(node, direction).label if is_translation else f"{node} direction {direction}"
        )
        seen[label] += 1
        named[f"{label} ({seen[label]})" if seen[label] > 1 else label] = dataset
    return named


def _check_abscissa(dataset: Dataset) -> None:
    kind = dataset.fields["abscissa_spec_data_type"]
    label = dataset.fields["abscissa_axis_units_lab"].strip()
    if kind != _TIME or label not in (*_UNSTATED, "s", "sec"):
        raise MeasurementFileError(
            f"{dataset.place} is a time history over data type {kind} in {label!r}; time (17) in s "
            "is needed, since the sampling rate follows from it. Export it over seconds."
        )


def _unit(dataset: Dataset) -> str:
    label: str = dataset.fields["ordinate_axis_units_lab"].strip()
    return "" if label in _UNSTATED else label
