"""Nominal bar or beam of a case, and the structure of a case with its priors."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpyro.distributions import Distribution, LogNormal, Normal, Uniform

from ..._shared.dimensions import Parameter
from ...effects.attached import Attached
from ...experiment.damping import Modal
from ...experiment.structure import Structure
from ...laws import Dashpot, Spring
from ...modes import beams
from ...modes.modes import Modes
from ._finite_elements import FiniteElementStructure
from ._json_fields import (
    CaseError,
    FieldRule,
    JsonObject,
    begins_with,
    between,
    check_distinct,
    choice,
    positive,
)


class _LineKind(NamedTuple):
    """A kind of bar or beam: its direction of motion and its ends, by the texts of a case."""

    direction: int
    motion: str
    ends: dict[str, str]


_LINE_KINDS = {
    "axial bar": _LineKind(
        1,
        "axial displacement u(x), direction 1",
        {"fixed at x=0 and x=L": "fixed-fixed"},
    ),
    "Euler-Bernoulli beam, bending": _LineKind(
        3,
        "transverse displacement w(x) along z, direction 3",
        {
            "clamped at x=0 (w=0, dw/dx=0), free at x=L": "fixed-free",
            "free-free on a soft suspension": "free-free",
        },
    ),
}
_SUSPENDED = "free-free on a soft suspension"
_DAMPING = "modal viscous, the same ratio for every mode"

# With the static correction a mode left out at q times the top of the band lacks at most the share
# 1 / (q^2 - 1) of its own static part, which is small itself. On bars and beams with noise of 1 %,
# four times the band adds less than 0.01 to chi2 per datum, twice the band up to 0.7. Something
# attached to the structure feels the driving point, where it is more: six times the band then adds
# less than 0.01.
_BAND_FACTOR, _LEAST_MODES = 6, 20
_COUNTS = 50, 100, 200, 400  # tried in turn

_MODULUS, _DENSITY = positive("Pa", 2.1e11), positive("kg/m3", 7850.0)
_RATIO = positive("1", 0.01, most=1.0)
_UNCERTAIN = {
    "youngs_modulus_Pa": _MODULUS,
    "density_kg_m3": _DENSITY,
    "modal_damping_ratio": _RATIO,
}


class BarOrBeam(NamedTuple):
    """The nominal bar or beam of a case, of a length [m], that moves in direction 1 or 3.

    `build` makes its modes of their number, a modulus and a density; `springs` are the objects of
    its suspension.
    """

    fields: JsonObject
    length: float
    direction: int
    build: Callable[..., Modes]
    springs: list[JsonObject]


NominalStructure = BarOrBeam | FiniteElementStructure
"""The nominal structure of a case."""


def nominal_structure(case: JsonObject) -> NominalStructure:
    """Read the fields `structure` and `nominal_fe_model`."""
    if case.has("nominal_fe_model"):
        return FiniteElementStructure(case)
    fields = case.object("structure")
    kind = _LINE_KINDS[fields.value("type", choice(*_LINE_KINDS))]
    fields.value("motion", begins_with(kind.motion))
    ends = fields.value("boundary_conditions", choice(*kind.ends))
    length = float(fields.value("length_m", positive("m", 1.0)))
    bar_or_beam: Callable[..., Modes] = beams.bar if kind.direction == 1 else beams.beam
    build = partial(
        bar_or_beam,
        length=length,
        ends=kind.ends[ends],
        direction=kind.direction,
        **_section(fields, kind.direction),
    )
    suspended = ends == _SUSPENDED or fields.has("suspension")
    springs = fields.objects("suspension", least=1) if suspended else []
    return BarOrBeam(fields, length, kind.direction, build, springs)


def _section(fields: JsonObject, direction: int) -> dict[str, float]:
    if direction == 1:
        return {"area": float(fields.value("area_m2", positive("m2", 1e-3)))}
    width = float(fields.value("width_m", positive("m", 0.03)))
    height = float(fields.value("height_m", positive("m", 0.006)))
    return {"area": width * height, "second_moment": width * height**3 / 12}


def structure(case: JsonObject, nominal: NominalStructure, highest: float) -> Structure:
    """Build the structure with its uncertain parameters, for lines up to a highest one [Hz]."""
    values = _nominal_values(nominal.fields)
    parameters: dict[str, Parameter] = {**values, **_priors(case, values)}
    modulus, density = parameters["youngs_modulus_Pa"], parameters["density_kg_m3"]
    damping = Modal(parameters["modal_damping_ratio"])
    if isinstance(nominal, FiniteElementStructure):
        return Structure(nominal.modes(highest, modulus, density), damping=damping)
    count = _modes_kept(nominal, values, highest)
    modes = nominal.build(count, youngs_modulus=modulus, density=density)
    suspended = Structure(modes, damping=damping)
    for mount in _suspension(nominal, values) if nominal.springs else ():
        suspended = suspended + mount
    return suspended


def _nominal_values(fields: JsonObject) -> dict[str, float]:
    damping = fields.object("damping")
    damping.value("model", choice(_DAMPING))
    return {
        "youngs_modulus_Pa": float(fields.value("youngs_modulus_Pa", _MODULUS)),
        "density_kg_m3": float(fields.value("density_kg_m3", _DENSITY)),
        "modal_damping_ratio": float(damping.value("ratio", _RATIO)),
    }


def _modes_kept(nominal: BarOrBeam, values: dict[str, float], highest: float) -> int:
    limit = 2 * np.pi * _BAND_FACTOR * highest
    material = {
        "youngs_modulus": values["youngs_modulus_Pa"],
        "density": values["density_kg_m3"],
    }
    for count in _COUNTS:
        frequencies = np.asarray(nominal.build(count, **material).angular_frequency())
        if frequencies[-1] > limit:
            return max(int(np.sum(frequencies <= limit)), _LEAST_MODES)
    raise CaseError(
        f"{nominal.fields.file}: the structure in `structure` has more than {_COUNTS[-1]} natural "
        f"frequencies below {_BAND_FACTOR * highest:g} Hz, {_BAND_FACTOR} times the end of "
        "frequency.band_hz; lengths in m, modulus in Pa and density in kg/m3 are needed, since SI "
        'is assumed throughout. Check the units, for example "youngs_modulus_Pa": 2.1e11 for '
        "steel."
    )


def _suspension(nominal: BarOrBeam, values: dict[str, float]) -> list[Attached]:
    """Springs, and dashpots that damp the structure's bounce on them as its other modes."""
    position = between(0.0, nominal.length, "m", 0.2 * nominal.length)
    places = [float(spring.value("x_m", position)) for spring in nominal.springs]
    stiffness = positive("N/m", 230.0)
    springs = [float(spring.value("stiffness_N_per_m", stiffness)) for spring in nominal.springs]
    area = _section(nominal.fields, nominal.direction)["area"]
    mass = values["density_kg_m3"] * area * nominal.length
    relaxation = 2 * values["modal_damping_ratio"] / np.sqrt(sum(springs) / mass)
    return [
        Attached(place, Spring(k) | Dashpot(float(relaxation * k)), name=f"suspension_{number}")
        for number, (place, k) in enumerate(zip(places, springs, strict=True), start=1)
    ]


def _priors(case: JsonObject, nominal: dict[str, float]) -> dict[str, Distribution]:
    parameters = case.objects("uncertain_parameters")
    names = [parameter.value("name", choice(*_UNCERTAIN)) for parameter in parameters]
    check_distinct("name", parameters)
    priors = [parameter.object("prior") for parameter in parameters]
    return {
        name: _PRIORS[prior.value("type", choice(*_PRIORS))](prior, _UNCERTAIN[name], nominal[name])
        for name, prior in zip(names, priors, strict=True)
    }


def _uniform(fields: JsonObject, allowed: FieldRule, nominal: float) -> Distribution:
    """Uniform prior that contains the nominal value; otherwise the unit is probably another."""
    low = fields.value(
        "low",
        FieldRule(
            f"{allowed.needed}, not above the nominal value {nominal:g} in `structure`,",
            0.9 * nominal,
            lambda value: allowed.accepts(value) and value <= nominal,
        ),
    )
    high = fields.value(
        "high",
        FieldRule(
            f"{allowed.needed}, above `low` and not below the nominal value {nominal:g},",
            1.1 * nominal,
            lambda value: allowed.accepts(value) and value > low and value >= nominal,
        ),
    )
    return Uniform(float(low), float(high))


def _normal(fields: JsonObject, allowed: FieldRule, nominal: float) -> Distribution:
    mean = fields.value("mean", allowed)
    # The mean is five standard deviations above zero: a positive quantity is not drawn negative.
    narrow = positive("in the unit of the mean", 0.05 * mean, most=0.2 * mean)
    return Normal(float(mean), float(fields.value("standard_deviation", narrow)))


def _lognormal(fields: JsonObject, allowed: FieldRule, nominal: float) -> Distribution:
    median = fields.value("median", allowed)
    spread = fields.value("log_standard_deviation", positive("1", 0.1))
    return LogNormal(float(np.log(median)), float(spread))


_PRIORS = {"uniform": _uniform, "normal": _normal, "lognormal": _lognormal}
