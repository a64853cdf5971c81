"""Checks of what an experiment is given: lines, force levels, mounting, and runs at its levels."""

from collections import OrderedDict
from collections.abc import Sequence, Sized
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import jax
import numpy as np
from jaxtyping import Array, Float

from .._shared.arguments import as_array, check_annotated, check_kind, shown
from .._shared.errors import InfeasibleError, InputError
from .._shared.sites import Role, unknowns
from ..effects.effect import Effect
from ..laws.tabulated import tables_in
from ..modes.modes import Modes
from .measurement import Measurement
from .modal_parameters import ModalParameters
from .noise import Noise
from .observation import Observation
from .recording import MOUNTINGS
from .structure import Structure
from .transducers import Actuator, Sensor, Transducer

if TYPE_CHECKING:  # the class imports this module
    from .experiment import Experiment


Kind = TypeVar("Kind", bound=Transducer)

SHOWN = 5
"""Names that a message lists."""


def kinds(
    structure: object, sensors: object, actuators: object, observe: object, noise: object
) -> None:
    """Refuse arguments of an experiment of another kind."""
    needed = "a structure is needed, which has modes and damping"
    instead = "Structure(beams.bar(...), damping=damping.Modal(0.04))"
    check_kind("structure", structure, Structure, needed, instead)
    _check_transducers("sensors", sensors, Sensor, 'sensors=[bp.Sensor("s1", at=0.25)]')
    _check_transducers("actuators", actuators, Actuator, 'actuators=[bp.Actuator("a1", at=0.3)]')
    needed = "an observation is needed, since it says which numbers are compared"
    check_kind("observe", observe, Observation, needed, 'observe=observe.Complex("acceleration")')
    if noise is not None:
        needed = "an output error is needed, since a number does not say of what"
        check_kind("noise", noise, Noise, needed, "noise=noise.Gaussian(0.01)")


def all_known(experiment: "Experiment") -> None:
    """Refuse an experiment whose response depends on something unknown."""
    names = [
        unknown.name for unknown in unknowns(experiment) if unknown.role is not Role.OUTPUT_ERROR
    ]
    if names:
        tail = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        raise InputError(
            f"Still unknown: {', '.join(names[:SHOWN])}{tail}; the response of an experiment needs "
            "a number in the place of every distribution, since each of its values gives another "
            f'response. Give values, experiment.fix({{"{names[0]}": ...}}).frf(), or take '
            "nominal ones, experiment.nominal().frf(); "
            "bp.simulate(experiment) draws responses from the prior."
        )


def _check_transducers(
    argument: str, transducers: Any, kind: type[Transducer], instead: str
) -> None:
    """Refuse what is no list of sensors, or of actuators."""
    needed = f"a list of objects of {kind.__name__} is needed, since names and places belong to it"
    check_kind(argument, transducers, Sequence, needed, instead)
    for transducer in transducers:
        check_kind(f"an entry of {argument}", transducer, kind, needed, instead)


def lines(frequency: object) -> Float[Array | np.ndarray, "frequency"]:
    """Return lines [Hz] as an array."""
    if isinstance(frequency, jax.core.Tracer):
        return frequency
    values = as_array(frequency)
    if values.dtype.kind not in "iuf":
        raise InputError(
            f"frequency={shown(frequency)} was given; a list of real numbers [Hz] is needed, since "
            "these are the lines: frequency=[21.65, 64.95]."
        )
    array = values.astype(float)
    if array.ndim != 1 or array.size == 0 or not np.all(np.isfinite(array)) or np.any(array < 0):
        raise InputError(
            f"frequency of shape {array.shape} was given; a list of lines [Hz], finite and not "
            "negative, is needed: frequency=[21.65, 64.95]."
        )
    lines_of_it, counts = np.unique(array, return_counts=True)
    if counts.max() > 1:
        raise InputError(
            f"frequency has the line {lines_of_it[np.argmax(counts)]:g} Hz {counts.max()} times; "
            "each line is needed once, since one that counts twice makes the answer too certain: "
            "frequency=np.unique(frequency)."
        )
    return array


def static_line(frequency: object, modes: Modes) -> None:
    """Refuse 0 Hz for a structure that moves as a rigid body."""
    if isinstance(frequency, jax.core.Tracer) or modes.rigid_body_modes == 0:
        return
    if np.any(np.asarray(frequency) == 0):
        raise InputError(
            f"A line at 0 Hz was given, but the structure has {modes.rigid_body_modes} rigid-body "
            "modes; lines above 0 Hz are needed, since a constant force accelerates a free "
            "structure without limit: frequency=frequency[frequency > 0]."
        )


def lines_of_structure(structure: Structure, frequency: object, observe: Observation) -> None:
    """Refuse lines at which a structure has no response, or a law that is a table no value."""
    static_line(frequency, structure.modes)
    for table in tables_in(structure.effects):
        if observe.is_modal:
            raise InputError(
                f"{table!r} was given to an experiment that observes modes; a network is needed, "
                "since natural frequencies are looked for where a table may have no lines: "
                "effects.Spring(1e4) | effects.Dashpot(10.0)."
            )
        if not isinstance(frequency, jax.core.Tracer):
            table.check_lines(frequency)


def levels(amplitudes: Sequence[float] | None) -> tuple[float, ...] | None:
    """Return force amplitudes [N]; None where they are not known."""
    if amplitudes is None:
        return None
    needed = "a list of force amplitudes [N] is needed, since each is measured once"
    instead = "force_levels=[0.1, 1.0]"
    check_kind("force_levels", amplitudes, (Sequence, np.ndarray), needed, instead)
    numbers = [isinstance(force, int | float | np.number) for force in amplitudes]
    if not all(numbers) or any(isinstance(force, bool) for force in amplitudes):
        check_annotated("force_levels", amplitudes, Sequence[float])
    forces = tuple(float(amplitude) for amplitude in amplitudes)
    positive = all(0 < force < np.inf for force in forces)
    if not forces or not positive or len(set(forces)) < len(forces):
        raise InputError(
            f"force_levels={forces} was given; force amplitudes [N] are needed, positive and each "
            "once, since a nonlinear response depends on them: force_levels=[0.1, 1.0]."
        )
    return forces


def mounting(word: str, observe: Observation) -> str:
    """Return how sensors are mounted, one of `MOUNTINGS`; fixed where modes are observed."""
    if word not in MOUNTINGS:
        raise InputError(
            f"sensors_mounted={word!r} was given; it must be 'roving', where each sensor is alone "
            "in its run, or 'fixed', where all are mounted all the time: sensors_mounted='fixed'."
        )
    return "fixed" if observe.is_modal else word


def no_data_without_noise(data: object) -> None:
    """Refuse data for an experiment without noise."""
    if data is not None:
        raise InputError(
            "The experiment has noise=None, so no measured value has a density. Give it "
            "noise.Gaussian(sigma), or use marginals.KDE(), whose kernel is a density by itself "
            "(the paper's case of no output error)."
        )


def least_transducers(
    observe: Observation, actuators: Sized, noise: Noise | None, levels: object
) -> int:
    """Return the least number of transducers of a side: none where modes are observed."""
    if not observe.is_modal:
        return 1
    if len(actuators) or levels is not None:
        raise InputError(
            f"{'actuators' if len(actuators) else 'force_levels'}= was given with "
            "observe.ModalData; none is needed, since modal parameters do not depend on "
            "where and how hard a structure is driven. Leave it out."
        )
    known = noise is None or (noise.reads_variance and not unknowns(noise))
    if not known:
        raise InputError(
            f"noise.{type(noise).__name__} was given with observe.ModalData; noise.FromVariance of "
            "a known scale is needed, since the errors of modal parameters are stated with them, "
            "each in its own unit, and so few do not tell their size: noise=noise.FromVariance()."
        )
    return 0


def seen(effect: object, observe: Observation) -> None:
    """Refuse an effect that modal parameters do not show."""
    if observe.is_modal and isinstance(effect, Effect) and not effect.changes_modes:
        raise InputError(
            f'The effect "{effect.name}" was added to an experiment that observes modes; FRFs are '
            "needed to see it, since it changes neither natural frequencies nor damping nor real "
            "shapes. Leave it out, or observe FRFs: observe=observe.Complex('acceleration')."
        )


def driven(observe: Observation) -> None:
    """Refuse to compute FRFs where modes are observed."""
    if observe.is_modal:
        no_frfs("FRFs were asked for")


def no_frfs(what: str) -> NoReturn:
    """Refuse what needs FRFs."""
    raise InfeasibleError(
        f"{what}, but the experiment observes modal parameters; FRFs are needed for it, with lines "
        "and actuators, since it is computed line by line. Declare an experiment of FRFs: "
        "Experiment(..., actuators=[...], frequency=..., observe=observe.Complex('acceleration'))."
    )


def by_name(transducers: Sequence[Kind], modes: Modes, least: int = 1) -> OrderedDict[str, Kind]:
    """Transducers by name, placed on a structure, at least so many."""
    # An ordered dictionary keeps its order through JAX; a plain one would be sorted by name.
    placed = OrderedDict((transducer.name, transducer.on(modes)) for transducer in transducers)
    names = [transducer.name for transducer in transducers]
    repeated = sorted({name for name in names if names.count(name) > 1})
    if repeated:
        raise InputError(
            f'Two transducers are called "{repeated[0]}". Each needs a name of its own, since '
            "unknowns are named by it. A sensor used in several runs is given once."
        )
    if len(placed) < least:
        raise InputError(
            "An experiment needs at least one sensor and one actuator, since an FRF is measured "
            'between the two: sensors=[bp.Sensor("s1", at=0.25)].'
        )
    return placed


def at_levels(
    measurements: Measurement | ModalParameters | Sequence[Measurement],
    levels: Sequence[float] | None,
) -> list[Measurement]:
    """Measurements in the order of some force levels [N].

    There is none for a single measurement at whatever level.
    """
    single = isinstance(measurements, Measurement | ModalParameters)
    entries: Any = [measurements] if single else measurements
    for run in entries if isinstance(entries, list | tuple) else [entries]:
        needed = "measured FRFs are needed, with their channels and lines"
        instead = "io.read_measurement(path), or Measurement.from_arrays(...)"
        check_kind("measurement", run, Measurement, needed, instead)
    runs = list(entries)
    if levels is None:
        if len(runs) != 1:
            raise InputError(
                f"{len(runs)} measurements were given to an experiment without force levels, "
                "which has one. Say how hard each was driven: "
                "Experiment(..., force_levels=[0.1, 1.0])."
            )
        return runs
    by_level = {run.force_level: run for run in runs}
    missing = [level for level in levels if level not in by_level]
    if missing:
        stated = ", ".join("none stated" if level is None else f"{level:g} N" for level in by_level)
        raise InputError(
            f"The experiment has the force level {missing[0]:g} N, but the measurements given have "
            f"{stated}. Give one measurement for each level: Measurement.from_arrays(..., "
            f"force_level={missing[0]:g})."
        )
    return [by_level[level] for level in levels]
