"""What the folder of a run holds of what a report shows."""

import json
import shlex
from pathlib import Path
from typing import NamedTuple

import pandas as pd
import xarray as xr
from pandas.api.types import is_numeric_dtype

from ..._shared.errors import InputError
from ..._shared.files import Json
from ..._shared.labels import ABOUT, AS_DRAWN
from ...io import netcdf
from ._svg import checked_svg

FINDINGS = "findings.nc"
"""File of the arrays that figures are drawn from."""

LEDGER, EXPLANATION, RUNS = "ledger.json", "explanation.json", "run.json"

STATES = "states.json"

_FILES = (FINDINGS, LEDGER, STATES, "cross_check.csv", "placements.csv")


class Saved(NamedTuple):
    """What is known of a run."""

    folder: Path
    """The folder of the results."""
    about: Json
    """Words on the run: its verdict, sentences, warnings and settings."""
    findings: xr.DataTree
    """Arrays; empty where none were kept."""
    ledger: Json
    """The ledger, as in its file; empty where there is none."""
    runs: Json
    """What the runs in the folder were given, by command, as `run.json` says."""
    effects: tuple[Json, ...] = ()
    """Entries of claimed effects, as in the file of `improve`, or else of `explain`."""

    def drawing(self, name: str) -> str | None:
        """Return a drawing of the folder by the name of its file; None where there is none."""
        path = self.folder / name
        return checked_svg(path.read_text(encoding="utf-8")) if path.is_file() else None

    def table(self, name: str) -> pd.DataFrame | None:
        """Return a table of the folder by the name of its file; None where there is none."""
        path = self.folder / name
        if not path.is_file():
            return None
        table = pd.read_csv(path)
        unnamed = [column for column in table if str(column).startswith("Unnamed")]
        numbers = [column for column in unnamed if is_numeric_dtype(table[column])]
        return table.drop(columns=numbers).rename(columns=dict.fromkeys(unnamed, "group"))

    def group(self, name: str) -> xr.Dataset | None:
        """Return arrays of the findings; None where there are none."""
        return self.findings[name].to_dataset() if name in self.findings.children else None

    def of_models(self, word: str) -> dict[str, xr.Dataset]:
        """Return what was kept of each model, `fit` or `modes`; as drawn first, where kept."""
        suffixes = {AS_DRAWN: "drawn"} | {name: str(n) for n, name in enumerate(self.models)}
        groups = {name: self.group(f"{word}_{suffix}") for name, suffix in suffixes.items()}
        return {name: group for name, group in groups.items() if group is not None}

    @property
    def models(self) -> list[str]:
        """Names of the models."""
        return [str(name) for name in self.about.get("models", [])]


def saved(folder: str | Path) -> Saved:
    """Read what a run left in its folder."""
    place = Path(folder)
    if not place.is_dir():
        raise FileNotFoundError(
            f"There is no folder {place}. Results are written by `bayes-placement improve MODEL "
            "--out results`."
        )
    if not any((place / name).is_file() for name in _FILES):
        raise InputError(
            f"{place} holds no results ({', '.join(_FILES)}); the folder of a run is needed, since "
            "a report shows what it found: bayes-placement improve MODEL --out results."
        )
    path = place / FINDINGS
    arrays = netcdf.read(path) if path.is_file() else xr.DataTree()
    about = json.loads(arrays.attrs.get(ABOUT, "{}"))
    top = place.parent if place.name.startswith("state_") else place
    ledger = _ledger(place / LEDGER)
    effects = (ledger or _json(place / EXPLANATION)).get("effects") or ()
    return Saved(place, about, arrays, ledger, runs(top), tuple(effects))


def _ledger(path: Path) -> Json:
    """Return the ledger in a file; empty where there is none."""
    stated = _json(path)
    if path.is_file():
        _check(stated, path)
    return stated


def runs(folder: Path) -> Json:
    """Return what the runs in a folder were given, by command; empty where that was not kept."""
    return _json(folder / RUNS)


def states(folder: Path) -> list[str]:
    """Return labels of the later states of a structure; empty where there is only one."""
    listed = enumerate(_json(folder / STATES).get("states", []), 1)
    return [str(state.get("label", f"state {number}")) for number, state in listed]


def _json(path: Path) -> Json:
    if not path.is_file():
        return {}
    try:
        stated: Json = dict(json.loads(path.read_text(encoding="utf-8")))
    except (TypeError, ValueError) as error:
        raise InputError(
            f"{path} cannot be read as JSON ({error}); the file of a run is needed, since its "
            "numbers are shown. Run the command again."
        ) from error
    return stated


def placed_items(places: xr.Dataset | None) -> list[xr.Dataset]:
    """Each instrument and effect; a sensor and an actuator may have one name."""
    if places is None:
        return []
    return [places.isel(item=number) for number in range(places.sizes["item"])]


def name_of(item: xr.Dataset) -> str:
    """Name of an instrument or an effect."""
    return str(item["item"].item())


_NEEDED = ("added", "chi2_per_datum", "noise_needed", "parameters")
"""What every report shows of a step."""


def _check(stated: Json, path: Path) -> None:
    """Refuse a ledger without what every report shows, as another version may have written it."""
    steps = stated.get("steps") or [{}]
    lacking = [word for word in ("steps", "probabilities") if word not in stated]
    lacking += [f"steps.{key}" for key in _NEEDED if any(key not in step for step in steps)]
    if lacking:
        raise InputError(
            f"{path}, written by {_writer(stated)}, lacks {', '.join(lacking)}; all of these are "
            f"needed, since a report shows the misfit of each step. Run again: {_line(stated)}"
        )


def _writer(stated: Json) -> str:
    """The version that wrote a ledger."""
    version = stated.get("record", {}).get("versions", {}).get("bayes_placement")
    return f"bayes_placement {version}" if version else "a version that it does not name"


def _line(stated: Json) -> str:
    """The command that writes the ledger anew."""
    model = stated.get("record", {}).get("model", {}).get("path")
    return f"bayes-placement improve {shlex.quote(model) if model else 'MODEL'} --report"
