"""`bayes-placement place`: where to measure, so that most is learnt about the parameters."""

import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

from .. import design
from .._shared.errors import InputError, UsageError
from .._shared.executors import workers
from .._shared.progress import Progress
from ..criticism.missing.improve import improve
from ..design import information
from ..design._candidates import can_be_at, positions_on
from ..design.information.estimator import Estimator
from ..design.maps import information_map
from ..design.next_measurement import planned
from ..design.place import Placement, place
from ..effects import library
from ..experiment.experiment import Experiment, Measurements
from ..experiment.modal_parameters import ModalParameters
from ..experiment.variants import with_lines, with_more_sensors, with_only
from ..inference import cross_check
from ..inference.results import warnings_of
from ..io._gate import files_read
from ..io.model import Study
from ..plots import placement as plots
from ..positions.bounds import in_space
from ..positions.vectors import Recorded
from ._inputs import infer_posterior, measured, read_study
from ._run import Output, Run
from ._terminal import Screen

Positions = dict[str, list[Recorded]]
Region = tuple[float, float] | tuple[tuple[float, ...], tuple[float, ...]]

MOST_ROWS = 10
"""Placements, at most, that are shown in the terminal."""

EARLIER_DATA, PLACE, MAP = "earlier data", "place", "map"
"""Tasks that have a progress bar."""

SEARCHES = {
    "exhaustive": design.Exhaustive,
    "sequential": design.Sequential,
    "forward": design.Forward,
    "evolutionary": design.Evolutionary,
}


class Options(NamedTuple):
    """Options of the command.

    None means all parameters to learn about, all sensors that are declared, the noise (standard
    deviation of log10 of the amplitude) as declared, and a least distance [m] of 1 % of the
    structure. Forbidden regions and costs [nat] are as typed; `workers` and `dask` are of
    `bp.design.workers`.
    """

    estimator: str
    search: str
    about: list[str] | None
    sensors: int | None
    places: int
    lines: int
    noise: float | None
    workers: int | None
    dask: str | None
    seed: int
    least_distance: float | None = None
    forbidden: tuple[str, ...] = ()
    cost: tuple[str, ...] = ()


def run(path: Path, data: Path | None, options: Options, output: Output) -> int:
    """Search for the best placement, and write tables, a map and figures.

    Data are of an earlier measurement.
    """
    screen = output.screen
    rules = _rules(options)
    with files_read() as files:
        study = read_study(path)
        earlier = _earlier_data(study, data, path, options)
    all_lines = with_sensors(_planned(study, earlier, options), options.sensors)
    experiment = with_lines(all_lines, options.lines)
    positions = positions_to_try(experiment, options.search, options.places)
    run = output.begin("place", path, files=files, **options._asdict())
    screen.text("\n".join([f"{experiment}\n", *_words_on_lines(all_lines, experiment)]))
    tasks = [EARLIER_DATA] if earlier is not None else []
    # A map is of one or two transducers, and of all placements.
    maps = [MAP] if options.search == "exhaustive" and len(positions) <= 2 else []
    with (
        workers(options.workers, dask=options.dask) as executor,
        screen.progress([*tasks, PLACE, *maps]) as begin_task,
    ):
        estimator, warned = named_estimator(
            options.estimator, study, earlier, options.seed, partial(begin_task, EARLIER_DATA)
        )
        settings: dict[str, Any] = {
            "estimator": estimator,
            "about": options.about,
            "lines": None,  # chosen above
            "key": options.seed,
            "executor": executor,
            "store": run.shared / "chunks",
        }
        search = SEARCHES[options.search]()
        with warnings.catch_warnings(record=True) as doubts:
            warnings.simplefilter("always", information.InformationWarning)
            best = place(
                experiment,
                positions,
                search=search,
                progress=begin_task(PLACE),
                **rules,
                **settings,
            )
            # An exhaustive search has left all cells of the map in the store.
            drawn = [
                information_map(experiment, positions, progress=begin_task(task), **settings)
                for task in maps
            ]
    # The last doubt is about all that was estimated.
    sentences = [str(best), *warned, *(str(doubt.message) for doubt in doubts[-1:])]
    _write(best, sentences, drawn, run)
    return _finished(screen, run, best, sentences)


def _finished(screen: Screen, run: Run, best: Placement, sentences: list[str]) -> int:
    """Show what was found and end the run."""
    screen.verdict(sentences[0])
    screen.table(_table(best), "rank")
    screen.list(sentences[1:])
    placed = {name: np.asarray(at).tolist() for name, at in best.positions.items()}
    return run.finish(screen, sentences[0], {"positions": placed, "sentences": sentences})


def _rules(options: Options) -> dict[str, Any]:
    """Rules of the placement, as `place` takes them."""
    return {
        "least_distance": options.least_distance,
        "forbidden": [_region(word) for word in options.forbidden],
        "cost": dict(map(_cost, options.cost)),
    }


def _earlier_data(
    study: Study, data: Path | None, path: Path, options: Options
) -> Measurements | None:
    """Data that the next measurement is to add to; None where it is the first."""
    if data is None and options.estimator != "separation":
        return None
    earlier = measured(study, data, path, "place --estimator separation")
    if isinstance(earlier, ModalParameters):
        raise UsageError(
            "Modal parameters were given to `place`; FRFs are needed, since it compares places by "
            "FRFs to be measured there: --data measured.uff. `improve` and `check` take modes."
        )
    return earlier


def _planned(study: Study, earlier: Measurements | None, options: Options) -> Experiment:
    """The experiment with the output error that is stated, or that a measurement tells."""
    noise = study.experiment.noise
    measurement = study.measurement if earlier is None else earlier
    if (
        options.noise is None
        and measurement is None
        and noise is not None
        and noise.reads_measurement
    ):
        raise UsageError(
            f"The model declares noise.{type(noise).__name__}(), which reads the output error from "
            "a measurement, but there is none. Give --data measured.uff, an earlier measurement of "
            "the same kind, or the standard deviation of log10 of the amplitude: --noise 0.01."
        )
    return planned(study.experiment, measurement, options.noise)


def with_sensors(experiment: Experiment, count: int | None) -> Experiment:
    """Return the experiment with its first sensors only, or with more like the last one."""
    sensors = list(experiment.sensor)
    if count is None or count == len(sensors):
        return experiment
    if count < 1:
        raise UsageError(
            f"--sensors {count} was given; at least one sensor is needed: --sensors 2."
        )
    if count < len(sensors):
        return with_only(experiment, sensors=sensors[:count])
    return with_more_sensors(experiment, count - len(sensors))


def _words_on_lines(all_lines: Experiment, experiment: Experiment) -> list[str]:
    """Sentence for the terminal where not all frequency lines are used."""
    declared, used = np.size(all_lines.frequency), np.size(experiment.frequency)
    if used == declared:
        return []
    return [
        f"{used} of {declared} lines are used, evenly over the band, since more of them take "
        f"longer and need more draws; --lines {declared} uses all."
    ]


def _table(best: Placement) -> pd.DataFrame:
    """The best placements, for the terminal."""
    gains = best.table[["information_gain", "information_gain_se"]]
    table = best.table.drop(columns=[*gains.columns, "cost", "net_gain"])
    table = table.add_suffix(" [m]").map(lambda at: f"{at:.4g}")
    table["information [nat]"] = [f"{gain:.4g} ± {error:.1g}" for gain, error in gains.to_numpy()]
    return table.set_axis(np.arange(len(table)) + 1, axis="index").head(MOST_ROWS)


def _write(best: Placement, sentences: list[str], maps: list[xr.Dataset], run: Run) -> None:
    run.text("placement.txt", "\n".join(sentences))
    run.table("placements.csv", best.table)
    for learnt in maps:
        run.dataset("map.nc", learnt)
    run.verdict(sentences[0])
    run.figures(
        lambda: {"placements.png": plots.placements(best)},
        *(partial(_map, learnt) for learnt in maps),
    )


def _map(learnt: xr.Dataset) -> dict[str, Figure]:
    return {"map.png": plots.information(learnt)}


ESTIMATORS: dict[str, Callable[..., Estimator]] = {
    "kernel-gain": information.KernelGain,
    "exact": information.Exact,
    "expected-gain": information.ExpectedGain,
    "separation": information.Separation,
}


def named_estimator(
    name: str,
    study: Study,
    measurement: Measurements | None,
    seed: int,
    begin: Callable[[], Progress],
) -> tuple[Estimator, list[str]]:
    """Return an estimator and the warnings of the inference from earlier data that it starts from.

    `begin` is called as that inference begins, and returns what it reports its progress to.
    """
    if name == "separation":
        assert measurement is not None
        return _separation(study.experiment, measurement, begin()), []
    if measurement is None:
        return ESTIMATORS[name](), []
    method = cross_check.standard_methods(study.experiment, study.engine)[0]
    posterior = infer_posterior(study.experiment, measurement, method, seed, begin())
    return ESTIMATORS[name](after=posterior), warnings_of(posterior)


def _separation(
    experiment: Experiment, measurement: Measurements, progress: Progress
) -> information.Separation:
    """Separation of the explanations that earlier data leave."""
    ledger = improve(experiment, measurement, candidates=library(experiment), progress=progress)
    if len(ledger.alternatives) < 2:
        names = "".join(f" ({alternative.name})" for alternative in ledger.alternatives)
        raise InputError(
            "--estimator separation tells explanations apart, but the data leave only one"
            f"{names}. Give --estimator expected-gain, to sharpen its parameters."
        )
    return information.Separation(alternatives=ledger.alternatives)


MOST_PLACEMENTS = 100_000
"""Placements, at most, that an exhaustive search tries."""


def positions_to_try(experiment: Experiment, search: str, count: int) -> Positions:
    """Return the positions of the structure at which each sensor and actuator can be mounted [m].

    Of `count` positions those are kept that a tolerance allows.
    """
    if search == "evolutionary" and in_space(experiment.structure.modes.bounds()):
        raise UsageError(
            "--search evolutionary moves along a line, but this structure lies in space. Give "
            "--search sequential or forward, or use bp.place with a tolerance for each transducer."
        )
    positions = positions_on(experiment, count)
    transducers = {**experiment.sensor, **experiment.actuator}
    allowed = {
        name: [at for at in positions if can_be_at(experiment, transducer, at)]
        for name, transducer in transducers.items()
    }
    nowhere = [name for name, remaining in allowed.items() if not remaining]
    if nowhere:
        raise UsageError(
            f'At none of {len(positions)} positions "{nowhere[0]}" can be mounted with its '
            "tolerance. Try more positions, --places 200, or use bp.place with positions of your "
            "own."
        )
    placements = np.prod([len(remaining) for remaining in allowed.values()], dtype=float)
    if search == "exhaustive" and placements > MOST_PLACEMENTS:
        raise UsageError(
            f"--search exhaustive would try {placements:.2g} placements of {', '.join(allowed)}. "
            "Give --search forward (or evolutionary), fewer --sensors or fewer --places."
        )
    return allowed


def _region(word: str) -> Region:
    """Low and high corners [m] of a region, from `0.4:0.45` or `0,0,0:0.1,0.1,0`."""
    try:
        low, high = ([float(number) for number in corner.split(",")] for corner in word.split(":"))
    except ValueError:
        low, high = [], []
    if not low or len(low) != len(high) or len(low) not in (1, 3):
        raise UsageError(
            f"--forbidden {word!r} was given; the least and the greatest position [m] of a region "
            "are needed, since nothing is placed between them: --forbidden 0.4:0.45, or in space "
            "--forbidden 0,0,0:0.1,0.1,0."
        )
    return (low[0], high[0]) if len(low) == 1 else (tuple(low), tuple(high))


def _cost(word: str) -> tuple[str, float]:
    """Name and cost [nat] of a transducer, from `s1=0.1`."""
    name, _, number = word.rpartition("=")
    try:
        cost = float(number)
    except ValueError:
        cost = -1.0
    if not name or not cost >= 0:
        raise UsageError(
            f"--cost {word!r} was given; a transducer and the information gain [nat] that it must "
            "exceed to be used are needed: --cost s2=0.1."
        )
    return name, cost
