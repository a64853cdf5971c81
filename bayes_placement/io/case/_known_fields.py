"""Fields that a case may have: those that are read, and those that tell people more."""

import difflib
from typing import Any

from ._json_fields import CaseError, JsonObject

_TRANSDUCER = {
    "id": None,
    "uff_node": None,
    "position_m": None,
    "tolerance_m": None,
    "directions": None,
    "angle_tolerance_rad": None,
    "gain_tolerance": None,
    "delay_tolerance_s": None,
    "note": None,
}
_STRUCTURE = {
    **dict.fromkeys(
        (
            "area_m2",
            "axis",
            "boundary_conditions",
            "density_kg_m3",
            "height_m",
            "length_m",
            "motion",
            "note",
            "outer_diameter_m",
            "poisson_ratio",
            "section",
            "size_x_m",
            "size_y_m",
            "thickness_m",
            "type",
            "wall_m",
            "width_m",
            "youngs_modulus_Pa",
        )
    ),
    "damping": dict.fromkeys(("model", "ratio", "note")),
    "members": dict.fromkeys(("name", "start", "end", "note")),
    "suspension": dict.fromkeys(("x_m", "stiffness_N_per_m", "note")),
}
_PRIOR = dict.fromkeys(
    ("type", "low", "high", "mean", "standard_deviation", "median", "log_standard_deviation")
)
_MEASUREMENT: dict[str, Any] = {
    "noise_level": dict.fromkeys(("coherence_factor", "floor", "ratio", "note")),
    "states": dict.fromkeys(("label", "files", "note")),
    **dict.fromkeys(
        (
            "array",
            "baseline_files",
            "convention",
            "estimator",
            "files",
            "force_levels_N",
            "in_channels",
            "n_averages",
            "noise",
            "note",
            "out_channels",
            "quantity",
            "sensor_setup",
            "units",
        )
    ),
}
KNOWN: dict[str, Any] = {
    **dict.fromkeys(
        ("angle_convention", "angle_prior", "case", "nominal_fe_model", "note", "position_prior")
    ),
    "actuators": _TRANSDUCER,
    "sensors": _TRANSDUCER,
    "structure": _STRUCTURE,
    "uncertain_parameters": {**dict.fromkeys(("name", "nominal", "note")), "prior": _PRIOR},
    "frequency": dict.fromkeys(("band_hz", "n_lines", "spacing", "note")),
    "measurement": _MEASUREMENT,
    "effects": dict.fromkeys(
        ("kind", "candidate", "name", "note", "pieces", "law", "motion", "direction")
    ),
    "hints": ...,
}
"""Fields of `case.json`, with those of their objects, or of the objects that they list.

`hints` holds anything; a `note` may stand in any object, and says what people should know.
"""


def check_known(fields: JsonObject, known: dict[str, Any] | None = None) -> None:
    """Refuse a field that is not known: a misspelt one would be ignored."""
    known = KNOWN if known is None else known
    for name, value in fields.content.items():
        if name not in known:
            raise _unknown(fields, name, known)
        if isinstance(known[name], dict):
            for inner in _objects(fields, name, value):
                check_known(inner, known[name])


def _objects(fields: JsonObject, name: str, value: Any) -> list[JsonObject]:
    """Objects in a field; what is none is refused where it is read."""
    if isinstance(value, dict):
        return [fields.object(name)]
    are_objects = isinstance(value, list) and all(isinstance(entry, dict) for entry in value)
    return fields.objects(name) if are_objects else []


def _unknown(fields: JsonObject, name: str, known: dict[str, Any]) -> CaseError:
    nearest = difflib.get_close_matches(name, known, n=1, cutoff=0.0)[0]
    return CaseError(
        f"{fields.file}: the field {fields.dotted_path(name)} is not known; the nearest known one "
        f'is "{nearest}". Only known fields are taken, since a misspelt one would be ignored: '
        'correct its name, or put what people should know into "note" or "hints".'
    )
