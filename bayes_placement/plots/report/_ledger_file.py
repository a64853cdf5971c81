"""The ledger in the file of a run: those of earlier versions get what a report shows."""

import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..._shared.errors import InputError

_STEP = {
    "setting": "",
    "remark": "",
    "p_value": None,
    "log_evidence": None,
    "held_out": None,
    "chi2_per_datum_when_exact": None,
    "noise_needed": None,
}
"""What a step has where its file does not say."""

_ESTIMATE = {"mean": None, "standard_deviation": None, "unit": ""}
"""What an estimate has where its file does not say."""

_NOISE = {"relative": None, "over_scatter": None}
"""What the noise that is needed has where its file does not say."""


def completed(stated: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Return a ledger with every key that a report shows.

    Estimates of earlier files have no `effect`, `field` and `word`: these are read from the names
    of the unknowns.
    """
    _check(stated, path)
    steps = [_step(step) for step in stated["steps"]]
    return {"probabilities": {}, **stated, "steps": steps}


def _check(stated: Mapping[str, Any], path: Path) -> None:
    """Refuse a ledger without what every report shows."""
    steps = stated.get("steps") or [{}]
    lacking = [] if stated.get("steps") else ["steps"]
    lacking += [
        f"steps.{key}"
        for key in ("added", "chi2_per_datum")
        if any(key not in step for step in steps)
    ]
    if lacking:
        raise InputError(
            f"{path}, written by {_writer(stated)}, lacks {', '.join(lacking)}; all of these are "
            f"needed, since a report shows the misfit of each step. Run again: {_line(stated)}"
        )


def _writer(stated: Mapping[str, Any]) -> str:
    """The version that wrote a ledger."""
    version = stated.get("record", {}).get("versions", {}).get("bayes_placement")
    return f"bayes_placement {version}" if version else "a version that it does not name"


def _line(stated: Mapping[str, Any]) -> str:
    """The command that writes the ledger anew."""
    model = stated.get("record", {}).get("model", {}).get("path")
    return f"bayes-placement improve {shlex.quote(model) if model else 'MODEL'} --report"


def _step(stated: Mapping[str, Any]) -> dict[str, Any]:
    noise = stated.get("noise_needed")
    estimates = {
        name: {**_ESTIMATE, **_from_name(name, stated["added"]), **estimate}
        for name, estimate in stated.get("parameters", {}).items()
    }
    return {
        **_STEP,
        **stated,
        "parameters": estimates,
        "noise_needed": noise and {**_NOISE, **noise},
    }


def _from_name(name: str, added: str | None) -> dict[str, Any]:
    """Effect, field and word of an unknown, `structure.effects.point_mass.mass`."""
    owner, _, word = name.partition(f"effects.{added}.")
    is_of_added = bool(word) and owner in ("structure.", "", "instrument_")
    word = word if is_of_added else name
    field = word.partition("[")[0].rpartition(".")[2]
    return {"effect": added if is_of_added else None, "field": field, "word": word}
