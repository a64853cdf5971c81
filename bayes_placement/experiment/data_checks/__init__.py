"""data_checks: what is wrong with a measurement before any inference."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from ..._shared.reprs import notebook_html
from .._experiment_checks import at_levels
from ..measurement import Measurement
from ..modal_parameters import ModalParameters
from . import beside_model, driving_points, mains, mistaken_records, without_model
from .record import Fault, Record

__all__ = ["CHECKS", "DataCheck", "DataChecks", "check_data"]

if TYPE_CHECKING:
    import pandas as pd

    from ..experiment import Experiment


class DataCheck(NamedTuple):
    """A check of the data.

    Parameters
    ----------
    name
        What it is about.
    can_check
        Whether a record allows it.
    check
        The faults that it finds in a record.

    Examples
    --------
    >>> from bayes_placement.experiment.data_checks import CHECKS
    >>> [check.name for check in CHECKS][:3]
    ['repeated records', 'overload', 'coherence']
    """

    name: str
    can_check: Callable[[Record], bool]
    check: Callable[[Record], Iterator[Fault]]


CHECKS = (
    DataCheck("repeated records", without_model.has_two_pairs, without_model.repeated),
    DataCheck("overload", without_model.has_lines, without_model.overloaded),
    DataCheck("coherence", without_model.has_coherence, without_model.full_coherence),
    DataCheck("mistaken records", mistaken_records.can_check, mistaken_records.check),
    DataCheck("natural frequencies", beside_model.has_modes_alone, beside_model.modes_elsewhere),
    DataCheck("units", beside_model.is_held, beside_model.mistaken_units),
    DataCheck("phase", without_model.observes_phase, without_model.no_phase),
    DataCheck(
        "driving points", driving_points.has_driving_points, driving_points.energy_given_back
    ),
    DataCheck("reciprocity", driving_points.has_reciprocal_pairs, driving_points.not_reciprocal),
    DataCheck(
        "rigid-body line", beside_model.has_rigid_body_line, beside_model.off_rigid_body_line
    ),
    DataCheck("stated noise", beside_model.states_noise, beside_model.understated_noise),
    DataCheck("mains", mains.can_check, mains.check),
    DataCheck("names", without_model.has_names_alike, without_model.names_alike),
)
"""Every check, in the order in which they are done."""


@dataclass(frozen=True)
class DataChecks:
    """What the checks of a measurement found.

    Parameters
    ----------
    faults
        Faults by the name of the check that found them; empty lists where it found none. A check
        that the measurement does not allow is not in it.

    Examples
    --------
    >>> experiment.check_data(measured).words()
    ['No fault was found in the data (checked: overload, mistaken records, natural frequencies,
    units, phase).']
    """

    faults: dict[str, list[Fault]]

    @property
    def passed(self) -> bool:
        """Whether no check found a fault."""
        return not any(self.faults.values())

    def sentences(self) -> list[str]:
        """One sentence for each fault."""
        return [fault.sentence for faults in self.faults.values() for fault in faults]

    def words(self) -> list[str]:
        """One sentence for each fault; one that names the checks where there is none."""
        if not self.passed or not self.faults:
            return self.sentences()
        return [f"No fault was found in the data (checked: {', '.join(self.faults)})."]

    def table(self) -> "pd.DataFrame":
        """One row for each fault."""
        import pandas as pd

        rows = [
            {"check": name, **fault._asdict()}
            for name, faults in self.faults.items()
            for fault in faults
        ]
        return pd.DataFrame(rows, columns=["check", *Fault._fields])

    def __repr__(self) -> str:
        """Say which checks were done, and how many faults each found."""
        found = (f"{name}: {len(faults)} faults" for name, faults in self.faults.items() if faults)
        return f"DataChecks: {', '.join(found) or ' '.join(self.words())}"

    def _repr_html_(self) -> str:
        return notebook_html(repr(self), self.table().drop(columns="sentence"), self.words())

    def __str__(self) -> str:
        """Write the sentences as a list."""
        return "\n".join(f"- {sentence}" for sentence in self.words())


def check_data(
    experiment: "Experiment", measurement: Measurement | ModalParameters | Sequence[Measurement]
) -> DataChecks:
    """Look for faults of a measurement that no model explains, before any inference.

    Records that occur twice, clipped or flat ones, a coherence of 1 everywhere; records that are
    conjugated, inverted, differentiated, integrated, in decibels, with phases in degrees, with
    lines in rad/s or with two channels swapped; resonances and amplitudes where units were
    mistaken; FRFs without a phase; driving points that give energy back, pairs that are not
    reciprocal, free structures off their rigid-body line, understated noise, and hum of the
    mains. Lines outside those of the experiment count as well. Where modes are observed, modes of
    the model that have one natural frequency.

    Parameters
    ----------
    experiment
        The experiment: which channels there are, where they are recorded and how sure that is.
    measurement
        One measurement, or one for each force level.

    Examples
    --------
    >>> experiment.check_data(measured).passed
    True
    """
    if experiment.observe.is_modal:
        return DataChecks({"repeated modes": list(beside_model.repeated_modes(experiment))})
    runs = at_levels(measurement, experiment.force_levels)
    channels = experiment.sensor_channels, experiment.actuator_channels
    records = [Record(experiment, run.channels(*channels), n) for n, run in enumerate(runs)]
    faults: dict[str, list[Fault]] = {}
    for record in records:
        for check in CHECKS:
            if check.can_check(record):
                found = list(_labelled(check.check(record), record))
                faults.setdefault(check.name, []).extend(found)
                if found and check.check is mistaken_records.check:
                    break  # what follows would compare numbers that are not what they should be
    return DataChecks(faults)


def _labelled(faults: Iterator[Fault], record: Record) -> Iterator[Fault]:
    """Say which force level a fault belongs to, where there are several."""
    if record.experiment.force_levels is None:
        yield from faults
        return
    force = record.experiment.force_levels[record.level]
    for fault in faults:
        sentence = f"At {force:g} N: {fault.sentence[0].lower()}{fault.sentence[1:]}"
        yield fault._replace(sentence=sentence)
