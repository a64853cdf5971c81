"""Reads HDF5 and MATLAB 7.3 by h5py and pymatreader, in a separate process: see `_child.py`."""

from collections.abc import Iterator
from typing import Any

import h5py
import numpy as np

MOST_OBJECTS = 100_000
DEEPEST = 30
SMALL = 1 << 20  # bytes that any dataset may announce
GREATEST_RATIO = 1100  # deflate packs 1032 bytes into one at most
FILTERS = {
    h5py.h5z.FILTER_DEFLATE,
    h5py.h5z.FILTER_SHUFFLE,
    h5py.h5z.FILTER_FLETCHER32,
    h5py.h5z.FILTER_LZF,
}
PACKED = {"scale_factor", "add_offset"}  # attributes of netCDF
REFERENCES = "#refs#"


class RefusedHDF5File(Exception):  # noqa: N818, its name is the word that people read
    """A file that is not read; the process that asked for it makes our error of its words."""


def read(path: str, most: int) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """Arrays by name, with the units that are stated with them and what was left out.

    Where they announce more than so many bytes, these are told and no array is read.
    """
    with h5py.File(path, "r") as file:
        faults: dict[str, str] = {}
        datasets = dict(_datasets(file, "", faults, set(), 0))
        for name, dataset in datasets.items():
            fault = _fault(dataset)
            if fault:
                faults[name] = fault
        total = sum(data.nbytes for name, data in datasets.items() if name not in faults)
        if total > most:
            return {}, {"bytes": total}
        if any("MATLAB_class" in data.attrs for data in datasets.values()):
            return _matlab(path, list(file), faults)
        good = {name: data for name, data in datasets.items() if name not in faults}
        units = {name: _text(data.attrs.get("units")) for name, data in good.items()}
        arrays = {name: _values(data) for name, data in good.items()}
    stated = {name: unit for name, unit in units.items() if unit}
    return arrays, {"form": "an HDF5 file", "units": stated, "faults": faults}


def _datasets(
    group: h5py.Group, prefix: str, faults: dict[str, str], seen: set[int], depth: int
) -> Iterator[tuple[str, h5py.Dataset]]:
    """Datasets by name; no link is followed that leaves the file or comes back to a group."""
    if depth > DEEPEST or len(seen) > MOST_OBJECTS:
        raise RefusedHDF5File(f"groups are nested more than {DEEPEST} deep, or are too many")
    for key in group:
        name = f"{prefix}{key}"
        if not isinstance(group.get(key, getlink=True), h5py.HardLink):
            faults[name] = "it is a link to another place, which is not followed"
            continue
        item = group[key]
        address = h5py.h5o.get_info(item.id).addr
        if address in seen:
            faults[name] = "it is another name of an object that is read already"
        elif isinstance(item, h5py.Dataset):
            yield name, item
        elif isinstance(item, h5py.Group):
            yield from _datasets(item, f"{name}/", faults, seen | {address}, depth + 1)


def _fault(dataset: h5py.Dataset) -> str:
    """Why a dataset is not read; empty where it is."""
    kind = dataset.dtype
    stored = dataset.id.get_storage_size()
    plist = dataset.id.get_create_plist()
    used = {plist.get_filter(number)[0] for number in range(plist.get_nfilters())}
    if dataset.shape is None:
        return "it is empty"
    if dataset.is_virtual or dataset.external:
        return "its values are in another file, which is not opened"
    if used - FILTERS:
        return "it is packed by a filter that HDF5 does not bring"
    is_number = kind.kind in "biufc" or _is_complex(kind)
    if not (is_number or h5py.check_string_dtype(kind) or h5py.check_ref_dtype(kind)):
        return "it holds neither numbers nor text"
    if PACKED & set(dataset.attrs):
        return "it is packed by scale_factor and add_offset, which are not applied"
    if dataset.nbytes > SMALL + GREATEST_RATIO * stored:
        raise RefusedHDF5File(
            f"{dataset.name} announces {dataset.nbytes} bytes in {stored} stored ones"
        )
    return ""


def _is_complex(kind: np.dtype) -> bool:
    """Whether it is a complex number as MATLAB and others store it."""
    return kind.names in (("real", "imag"), ("r", "i")) and all(
        kind[name].kind == "f" for name in kind.names
    )


def _values(dataset: h5py.Dataset) -> np.ndarray:
    if h5py.check_string_dtype(dataset.dtype):
        return np.asarray(dataset.asstr()[()], dtype=str)
    values = dataset[()]
    if _is_complex(dataset.dtype):
        real, imaginary = (values[name].astype(float) for name in dataset.dtype.names)
        return real + 1j * imaginary
    return np.asarray(values)


def _text(value: object) -> str:
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.item()
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value or "")


def _matlab(
    path: str, names: list[str], faults: dict[str, str]
) -> tuple[dict[str, np.ndarray], dict[str, object]]:
    """Variables of MATLAB; a cell points to the references, all of which must be readable."""
    import pymatreader

    wrong = {fault.split("/")[0] for fault in faults}
    if REFERENCES in wrong:
        raise RefusedHDF5File(f"{REFERENCES}: {next(iter(faults.values()))}")
    wanted = [name for name in names if not name.startswith("#") and name not in wrong]
    content = pymatreader.read_mat(path, variable_names=wanted) if wanted else {}
    arrays: dict[str, np.ndarray] = {}
    in_order = {name: content[name] for name in wanted if name in content}
    collect(in_order, "", arrays, faults)
    return arrays, {"form": "a MATLAB 7.3 file", "units": {}, "faults": faults}


def collect(value: Any, name: str, arrays: dict[str, np.ndarray], faults: dict[str, str]) -> None:
    """Arrays of nested dictionaries; a field of a structure is `structure.field`.

    That of one of several structures is `structure.1.field`.
    """
    is_list = isinstance(value, list | tuple)
    if is_list and any(isinstance(item, dict) for item in value):
        value = {str(number): item for number, item in enumerate(value, start=1)}
    if isinstance(value, dict):
        for key, inner in value.items():
            collect(inner, f"{name}.{key}" if name else key, arrays, faults)
        return
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        array = np.array(None)
    mixed = array.dtype.kind == "U" and is_list and not all(isinstance(x, str) for x in value)
    if array.dtype.kind not in "biufcU" or mixed:
        faults[name] = "it holds neither numbers nor text"
    elif not array.size:
        faults[name] = "it is empty"
    else:
        arrays[name] = array
