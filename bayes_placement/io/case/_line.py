"""_structure: in, the fields of a case; out, the structure that it draws, with its priors.

Not known here: sensors, measurements, how fields are checked.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
from numpyro.distributions import Distribution, LogNormal, Normal, Uniform

from ..._types import Parameter
from ...effects.ground_spring import GroundSpring, ground_spring
from ...experiment.damping import Modal
from ...experiment.structure import Structure
from ...modes.beams import beams
from ...modes.modes import Modes
from ._finite_elements import Model
from ._json_fields import CaseError, Fields, Rule, begins_with, between, distinct, one_of, positive


class _Line(NamedTuple):
    """A kind of line structure: direction of its motion and its ends, by the words of a case."""

    direction: int
    motion: str
    ends: dict[str, str]


_LINES = {
    "axial bar": _Line(
        1,
        "axial displacement u(x), direction 1",
        {"fixed at x=0 and x=L": "fixed-fixed"},
    ),
    "Euler-Bernoulli beam, bending": _Line(
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


class Line(NamedTuple):
    """The nominal line structure of a case, its words understood."""

    fields: Fields
    length: float
    direction: int
    build: Callable[..., Modes]
    springs: list[Fields]


Drawn = Line | Model
"""What a case draws: a line, or a finite element model."""


def drawn(case: Fields) -> Drawn:
    """Read the fields `structure` and `nominal_fe_model`.

    Raises
    ------
    CaseError
        If a field is missing or wrong.
    """
    if case.has("nominal_fe_model"):
        return Model(case)
    fields = case.inside("structure")
    line = _LINES[fields.take("type", one_of(*_LINES))]
    fields.take("motion", begins_with(line.motion))
    words = fields.take("boundary_conditions", one_of(*line.ends))
    length = float(fields.take("length_m", positive("m", 1.0)))
    beam: Callable[..., Modes] = beams.bar if line.direction == 1 else beams.beam
    build = partial(
        beam,
        length=length,
        ends=line.ends[words],
        direction=line.direction,
        **_section(fields, line.direction),
    )
    hung = words == _SUSPENDED or fields.has("suspension")
    springs = fields.each("suspension", least=1) if hung else []
    return Line(fields, length, line.direction, build, springs)


def _section(fields: Fields, direction: int) -> dict[str, float]:
    if direction == 1:
        return {"area": float(fields.take("area_m2", positive("m2", 1e-3)))}
    width = float(fields.take("width_m", positive("m", 0.03)))
    height = float(fields.take("height_m", positive("m", 0.006)))
    return {"area": width * height, "second_moment": width * height**3 / 12}


def structure(case: Fields, drawn: Drawn, highest: float) -> Structure:
    """Build the structure with its uncertain parameters, for lines up to a highest one [Hz].

    Raises
    ------
    CaseError
        If a field is missing or wrong.
    """
    nominal = _nominal(drawn.fields)
    given: dict[str, Parameter] = {**nominal, **_priors(case, nominal)}
    damping = Modal(given["modal_damping_ratio"])
    if isinstance(drawn, Model):
        stated = given["youngs_modulus_Pa"], given["density_kg_m3"]
        return Structure(drawn.modes(highest, *stated), damping=damping)
    modes = _modes_kept(drawn, nominal, highest)
    built = drawn.build(
        modes, youngs_modulus=given["youngs_modulus_Pa"], density=given["density_kg_m3"]
    )
    whole = Structure(built, damping=damping)
    for number, spring in enumerate(drawn.springs, start=1):
        whole = whole + _suspension(spring, number, drawn.length)
    return whole


def _nominal(fields: Fields) -> dict[str, float]:
    damping = fields.inside("damping")
    damping.take("model", one_of(_DAMPING))
    return {
        "youngs_modulus_Pa": float(fields.take("youngs_modulus_Pa", _MODULUS)),
        "density_kg_m3": float(fields.take("density_kg_m3", _DENSITY)),
        "modal_damping_ratio": float(damping.take("ratio", _RATIO)),
    }


def _modes_kept(drawn: Line, nominal: dict[str, float], highest: float) -> int:
    reach = 2 * np.pi * _BAND_FACTOR * highest
    material = {
        "youngs_modulus": nominal["youngs_modulus_Pa"],
        "density": nominal["density_kg_m3"],
    }
    for count in _COUNTS:
        frequencies = np.asarray(drawn.build(count, **material).angular_frequency())
        if frequencies[-1] > reach:
            return max(int(np.sum(frequencies <= reach)), _LEAST_MODES)
    raise CaseError(
        f"{drawn.fields.file}: the structure in `structure` has more than {_COUNTS[-1]} natural "
        f"frequencies below {_BAND_FACTOR * highest:g} Hz, {_BAND_FACTOR} times the end of "
        "frequency.band_hz; lengths in m, modulus in Pa and density in kg/m3 are needed, since SI "
        'is assumed throughout. Check the units, for example "youngs_modulus_Pa": 2.1e11 for '
        "steel."
    )


def _suspension(spring: Fields, number: int, length: float) -> GroundSpring:
    place = spring.take("x_m", between(0.0, length, "m", 0.2 * length))
    stiffness = spring.take("stiffness_N_per_m", positive("N/m", 230.0))
    return ground_spring(at=float(place), stiffness=float(stiffness), name=f"suspension_{number}")


def _priors(case: Fields, nominal: dict[str, float]) -> dict[str, Distribution]:
    every = case.each("uncertain_parameters")
    names = [one.take("name", one_of(*_UNCERTAIN)) for one in every]
    distinct("name", every)
    return {
        name: _prior(one.inside("prior"), _UNCERTAIN[name], nominal[name])
        for name, one in zip(names, every, strict=True)
    }


def _prior(fields: Fields, allowed: Rule, nominal: float) -> Distribution:
    return _PRIORS[fields.take("type", one_of(*_PRIORS))](fields, allowed, nominal)


def _uniform(fields: Fields, allowed: Rule, nominal: float) -> Distribution:
    """Uniform law around the nominal value: one beside it betrays another unit."""
    low = fields.take(
        "low",
        Rule(
            f"{allowed.needed}, not above the nominal value {nominal:g} in `structure`,",
            0.9 * nominal,
            lambda value: allowed.accepts(value) and value <= nominal,
        ),
    )
    high = fields.take(
        "high",
        Rule(
            f"{allowed.needed}, above `low` and not below the nominal value {nominal:g},",
            1.1 * nominal,
            lambda value: allowed.accepts(value) and value > low and value >= nominal,
        ),
    )
    return Uniform(float(low), float(high))


def _normal(fields: Fields, allowed: Rule, nominal: float) -> Distribution:
    mean = fields.take("mean", allowed)
    # Five standard deviations: what is positive by nature must not be drawn as negative.
    narrow = positive("in the unit of the mean", 0.05 * mean, most=0.2 * mean)
    return Normal(float(mean), float(fields.take("standard_deviation", narrow)))


def _lognormal(fields: Fields, allowed: Rule, nominal: float) -> Distribution:
    median = fields.take("median", allowed)
    spread = fields.take("log_standard_deviation", positive("1", 0.1))
    return LogNormal(float(np.log(median)), float(spread))


_PRIORS = {"uniform": _uniform, "normal": _normal, "lognormal": _lognormal}
