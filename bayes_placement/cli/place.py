"""place: in, file names and options; out, where to measure, in words and files.

Not known here: how words on the command line are read, how anything is computed.
"""

import warnings
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pandas as pd
import xarray as xr

from .. import design
from .._files import write_atomically
from .._progress import stages, terminal
from .._types import InputError, Progress
from ..criticism.missing.improve import improve
from ..design import information
from ..design._fewer import with_lines, with_more, with_only
from ..design.information._estimator import Estimator
from ..design.maps import information_map
from ..design.place import Placement, place
from ..design.planned import planned
from ..design.running._executors import workers
from ..effects import library
from ..experiment.experiment import Experiment, Measurements
from ..inference import methods
from ..io.model import Study
from ..plots import placement as placement_plots
from ..plots.structure import outline
from ..positions.bounds import in_space
from . import _studies
from ._outputs import make_folder, write_figures, write_table, write_text
from .terminal import frame, say, say_each

MOST_CELLS = 100_000
"""Placements, at most, that an exhaustive search tries."""

SHOWN = 10
"""Placements that are shown in the terminal."""

STILL = 1e-9
"""Share of the greatest mode shape below which a point does not move."""

KNOWN, PLACE, MAP = "what is known", "place", "map"
"""Pieces of work."""

ESTIMATORS = {
    "kde": information.KDE,
    "exact": information.Exact,
    "expected-gain": information.ExpectedGain,
}
SEARCHES = {
    "exhaustive": design.Exhaustive,
    "sequential": design.Sequential,
    "forward": design.Forward,
    "evolutionary": design.Evolutionary,
}


class Options(NamedTuple):
    """What was asked for.

    Parameters
    ----------
    estimator, search
        By their names.
    about
        Names of the parameters that are to be learnt; None for all.
    sensors
        Sensors to place; None for all that are declared.
    places
        Places to try for each transducer.
    lines
        Lines [Hz] that are used, at most.
    sigma
        Standard deviation of log10 of the amplitude; None as declared.
    workers, dask
        See `bp.design.workers`.
    seed
        Seed.
    """

    estimator: str
    search: str
    about: list[str] | None
    sensors: int | None
    places: int
    lines: int
    sigma: float | None
    workers: int | None
    dask: str | None
    seed: int


def run(path: Path, data: Path | None, options: Options, out: Path) -> None:
    """Run `bayes-placement place`: where to measure, so that most is learnt."""
    console = terminal()
    study = _studies.read(path)
    measured = _measured(study, data, path, options)
    whole = _asked(_planned(study, measured, options), options)
    experiment = with_lines(whole, options.lines)
    places = _places(experiment, options)
    make_folder(out)
    say(console, f"{experiment}\n")
    say_each(console, _thinned(whole, experiment))
    before = [] if measured is None else [KNOWN]
    after = [MAP] if _is_mapped(places, options) else []
    with (
        workers(options.workers, dask=options.dask) as executor,
        stages(console, [*before, PLACE, *after]) as begin,
    ):
        estimator, complaints = _estimator(options, study, measured, begin)
        settings: dict[str, Any] = {
            "estimator": estimator,
            "about": options.about,
            "key": options.seed,
            "executor": executor,
            "store": out / "chunks",
        }
        search = SEARCHES[options.search]()
        with warnings.catch_warnings(record=True) as doubts:
            warnings.simplefilter("always", information.InformationWarning)
            best = place(experiment, places, search=search, progress=begin(PLACE), **settings)
            # An exhaustive search has left all cells in the store.
            found = [
                information_map(experiment, places, progress=begin(MAP), **settings) for _ in after
            ]
    words = [str(best), *complaints, *_last(doubts)]
    console.print(frame(_shown(best), "rank"))
    say_each(console, words)
    _write(best, words, found, out)
    say(console, f"Tables and figures are in {out}/")


def _last(doubts: list[warnings.WarningMessage]) -> list[str]:
    """What is to be said of estimates that are in doubt, once."""
    return [str(one.message) for one in doubts[-1:]]


def _measured(study: Study, data: Path | None, path: Path, options: Options) -> Measurements | None:
    """Data that the next measurement goes on from; None where it is the first."""
    if data is None and options.estimator != "separation":
        return None
    return _studies.measured(study, data, path, "place --estimator separation")


def _planned(study: Study, measured: Measurements | None, options: Options) -> Experiment:
    """The experiment with the output error that is stated, or that a measurement tells."""
    noise, known = study.experiment.noise, study.measurement if measured is None else measured
    if options.sigma is None and known is None and noise is not None and noise.reads_coherence:
        raise InputError(
            f"The model declares noise.{type(noise).__name__}(), which reads the output error from "
            "a measurement, but there is none. Give --data measured.uff, an earlier measurement of "
            "the same kind, or the standard deviation of log10 of the amplitude: --noise 0.01."
        )
    return planned(study.experiment, known, options.sigma)


def _thinned(whole: Experiment, experiment: Experiment) -> list[str]:
    """What to say where not all lines are used."""
    every, kept = np.size(whole.frequency), np.size(experiment.frequency)
    if kept == every:
        return []
    return [
        f"{kept} of {every} lines are used, evenly over the band, since more of them take longer "
        f"and need more draws; --lines {every} uses all."
    ]


def _asked(experiment: Experiment, options: Options) -> Experiment:
    """The experiment with so many sensors: the first ones, or more like the last one."""
    sensors = list(experiment.sensor.values())
    if options.sensors is None or options.sensors == len(sensors):
        return experiment
    if options.sensors < 1:
        raise InputError(
            f"--sensors {options.sensors} was given; at least one sensor is needed: --sensors 2."
        )
    if options.sensors < len(sensors):
        kept = [one.name for one in sensors[: options.sensors]]
        return with_only(experiment, [*kept, *experiment.actuator])
    return with_more(experiment, options.sensors - len(sensors))


def _places(experiment: Experiment, options: Options) -> dict[str, Sequence[Any]]:
    """Places to try, of those where each transducer can sit."""
    if options.search == "evolutionary" and in_space(experiment.structure.modes.bounds()):
        raise InputError(
            "--search evolutionary moves along a line, but this structure lies in space. Give "
            "--search sequential or forward, or use bp.place with a support for each transducer."
        )
    every = _everywhere(experiment, options.places)
    found: dict[str, Sequence[Any]] = {
        name: [at for at in every if _can_sit(experiment, one, at)]
        for name, one in {**experiment.sensor, **experiment.actuator}.items()
    }
    empty = [name for name, several in found.items() if not several]
    if empty:
        raise InputError(
            f'None of {len(every)} places is one where "{empty[0]}" can sit with its tolerance. '
            "Try more places, --places 200, or use bp.place with places of your own."
        )
    cells = np.prod([len(several) for several in found.values()], dtype=float)
    if options.search == "exhaustive" and cells > MOST_CELLS:
        raise InputError(
            f"--search exhaustive would try {cells:.2g} placements of {', '.join(found)}. Give "
            "--search forward (or evolutionary), fewer --sensors or fewer --places."
        )
    return found


def _everywhere(experiment: Experiment, count: int) -> list[Any]:
    """Places all over the structure: evenly along a line, nodes far apart in space."""
    modes = experiment.structure.modes
    bounds = modes.bounds()
    if not in_space(bounds):
        low, high = bounds
        return list(np.linspace(low, high, count + 2)[1:-1])
    points, _ = outline(modes)
    known = np.unique(points[~np.isnan(points).any(axis=1)], axis=0)
    # Where nothing moves, nothing is measured.
    motion = _motion(experiment, known)
    moving = known[motion > STILL * motion.max()]
    return [tuple(map(float, at)) for at in _far_apart(moving, count)]


def _motion(experiment: Experiment, points: np.ndarray) -> np.ndarray:
    """Greatest mode shape [kg^-1/2] at each point."""

    def greatest() -> Any:
        modes = experiment.nominal().structure.modes.solved()
        return jax.lax.map(lambda at: jnp.abs(modes.shapes(at)).max(), jnp.asarray(points))

    return np.asarray(jax.jit(greatest)())


def _far_apart(points: np.ndarray, count: int) -> np.ndarray:
    """So many points, each the one farthest from those before it."""
    distance = np.linalg.norm(points - points.mean(axis=0), axis=1)
    chosen = [int(np.argmax(distance))]
    distance = np.linalg.norm(points - points[chosen[0]], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]


def _can_sit(experiment: Experiment, one: Any, at: Any) -> bool:
    try:
        one.moved(at, experiment.structure.modes)
    except ValueError:
        return False
    return True


def _estimator(
    options: Options,
    study: Study,
    measured: Measurements | None,
    begin: Callable[[str], Progress],
) -> tuple[Estimator, list[str]]:
    """The estimator, and what is to be said about what it goes on from."""
    if options.estimator == "separation":
        assert measured is not None
        return _separation(study.experiment, measured, begin(KNOWN)), []
    kind = ESTIMATORS[options.estimator]
    if measured is None:
        return kind(), []
    method = methods.standard(study.experiment, study.engine)[0]
    after = _studies.inferred(study.experiment, measured, method, options.seed, begin(KNOWN))
    return kind(after=after), str(after.attrs["complaints"]).splitlines()


def _separation(
    experiment: Experiment, measured: Measurements, progress: Progress
) -> information.Separation:
    """Of the explanations that earlier data leave."""
    found = improve(experiment, measured, candidates=library(experiment), progress=progress)
    if len(found.alternatives) < 2:
        only = "".join(f" ({one.name})" for one in found.alternatives)
        raise InputError(
            f"--estimator separation tells explanations apart, but the data leave one only{only}. "
            "Give --estimator expected-gain, to sharpen its parameters."
        )
    return information.Separation(found.alternatives)


def _is_mapped(places: dict[str, Sequence[Any]], options: Options) -> bool:
    """Tell whether there is a map to draw: of one or two transducers, all cells of which are tried.

    One search only tries them all.
    """
    return options.search == "exhaustive" and len(places) <= 2


def _shown(best: Placement) -> pd.DataFrame:
    """The best placements, in words for the terminal."""
    places = best.table.drop(
        columns=["information_gain", "information_gain_se", "cost", "net_gain"]
    )
    table = places.add_suffix(" [m]").map(lambda at: f"{at:.4g}")
    table["information [nat]"] = [
        f"{kl:.4g} ± {error:.1g}"
        for kl, error in best.table[["information_gain", "information_gain_se"]].to_numpy()
    ]
    return table.set_axis(np.arange(len(table)) + 1, axis="index").head(SHOWN)


def _write(best: Placement, words: list[str], maps: list[xr.Dataset], out: Path) -> None:
    write_text(out / "placement.txt", "\n".join(words))
    write_table(out / "placements.csv", best.table)
    figures = {"placements.png": placement_plots.placements(best)}
    for one in maps:
        write_atomically(out / "map.nc", partial(one.to_netcdf, engine="h5netcdf"))
        figures["map.png"] = placement_plots.information(one)
    write_figures(figures, out)
