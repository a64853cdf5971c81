"""Experiments and their data from draws of imperfect structures."""

from typing import NamedTuple

import numpyro.distributions as dist

import bayes_placement as bp
from tests.benchmarks import missing_effects
from tests.meshed_plates import CELLS, plate_modes
from tests.simulator.crude_draws import CrudeDraw
from tests.simulator.fine_elements import Line
from tests.simulator.imperfect_draws import ImperfectDraw


class Given(NamedTuple):
    """What the engineer has: the model, and what was measured before and after."""

    experiment: bp.Experiment
    measured: bp.Measurement
    baseline: bp.Measurement


def given(drawn: ImperfectDraw | CrudeDraw) -> Given:
    if isinstance(drawn.nominal, Line):
        experiment, measured = missing_effects.experiment_of(drawn)
    else:
        cells = getattr(drawn, "cells", None) or CELLS
        experiment = plate_experiment(drawn, cells)
        measured = missing_effects.measurement_of(experiment, drawn.records[0])
    return Given(experiment, measured, missing_effects.measurement_of(experiment, drawn.baseline))


def plate_experiment(drawn: ImperfectDraw | CrudeDraw, cells=CELLS) -> bp.Experiment:
    distributions = {name: dist.Uniform(*bounds) for name, bounds in drawn.priors.items()}
    damping = bp.damping.Modal(distributions.pop("damping_ratio"))
    return bp.Experiment(
        bp.Structure(plate_modes(drawn.nominal, cells, **distributions), damping=damping),
        sensors=[placed(bp.Sensor, instrument) for instrument in drawn.sensors],
        actuators=[placed(bp.Actuator, instrument) for instrument in drawn.actuators],
        frequency=drawn.records[0].frequency,
        observe=bp.observe.Complex("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def placed(kind, instrument):
    at = bp.positions.Box(
        (*instrument.recorded, 0.0), within=(instrument.within, instrument.within, 0.0)
    )
    return kind(instrument.name, at=at, directions=(instrument.direction,))
