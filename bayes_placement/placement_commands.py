"""placement_commands: in, file names and options; out, where to measure, in words and files.

Not known here: how words on the command line are read, how anything is computed.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from . import _studies, design, information, placement_plots
from ._bounds import in_space
from ._executors import workers
from ._files import write_whole
from ._outputs import make_folder, write_figures, write_table, write_text
from ._terminal import frame, say, stages, terminal
from .criticism.improve import improve
from .design._fewer import with_more, with_only
from .design.maps import information_map
from .design.place import Placement, place
from .design.planned import planned
from .effects import library
from .experiment import Experiment, Measurements
from .infer import infer
from .information._estimator import Estimator
from .structure_plots import outline

MOST_CELLS = 100_000
"""Placements, at most, that an exhaustive search tries."""

SHOWN = 10
"""Placements that are shown in the terminal."""

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
    sensors
        Sensors to place; None for all that are declared.
    places
        Places to try for each transducer.
    sigma
        Standard deviation of log10 of the amplitude; None as declared.
    workers, dask
        See `bp.workers`.
    seed
        Seed.
    """

    estimator: str
    search: str
    sensors: int | None
    places: int
    sigma: float | None
    workers: int | None
    dask: str | None
    seed: int


def run(path: Path, data: Path | None, options: Options, out: Path) -> None:
    """Run `bayes-placement place`: where to measure, so that most is learnt."""
    console = terminal()
    study = _studies.read(path)
    measured = _measured(study, data, path, options)
    make_folder(out)
    experiment = _asked(planned(study.experiment, _known(study, measured), options.sigma), options)
    names = [*experiment.sensor, *experiment.actuator]
    places = _places(experiment, names, options)
    say(console, f"{experiment}\n")
    before = ["what is known"] if data is not None or options.estimator == "separation" else []
    with (
        workers(options.workers, dask=options.dask) as executor,
        stages(console, [*before, "place", "map"]) as begin,
    ):
        progress = begin(before[0]) if before else None
        estimator = _estimator(options, study.experiment, measured, progress)
        settings: dict[str, Any] = {
            "estimator": estimator,
            "key": options.seed,
            "executor": executor,
            "store": out / "chunks",
        }
        search = SEARCHES[options.search]()
        best = place(experiment, places, search=search, progress=begin("place"), **settings)
        whole = _map(experiment, places, options, settings | {"progress": begin("map")})
    ranked = best.tried.set_axis(np.arange(len(best.tried)) + 1, axis="index")
    console.print(frame(ranked.head(SHOWN).map(_figure), "rank"))
    say(console, best)
    _write(best, whole, out)
    say(console, f"Tables and figures are in {out}/")


def _measured(study: Any, data: Path | None, path: Path, options: Options) -> Measurements | None:
    """Data that the next measurement goes on from; None where it is the first."""
    if data is None and options.estimator != "separation":
        return None
    return _studies.measured(study, data, path, "place --estimator separation")


def _known(study: Any, measured: Measurements | None) -> Measurements | None:
    """A measurement of the same kind, which tells the output error."""
    return study.measurement if measured is None else measured


def _asked(experiment: Experiment, options: Options) -> Experiment:
    """The experiment with so many sensors: the first ones, or more like the last one."""
    sensors = list(experiment.sensor.values())
    if options.sensors is None or options.sensors == len(sensors):
        return experiment
    if options.sensors < 1:
        raise ValueError(
            f"--sensors {options.sensors} was given; at least one sensor is needed: --sensors 2."
        )
    if options.sensors < len(sensors):
        kept = [one.name for one in sensors[: options.sensors]]
        return with_only(experiment, [*kept, *experiment.actuator])
    return with_more(experiment, options.sensors - len(sensors))


def _places(
    experiment: Experiment, names: Sequence[str], options: Options
) -> dict[str, Sequence[Any]]:
    """Places to try, of those where each transducer can sit."""
    every = _everywhere(experiment, options.places)
    known = {**experiment.sensor, **experiment.actuator}
    found: dict[str, Sequence[Any]] = {
        name: [at for at in every if _can_sit(experiment, known[name], at)] for name in names
    }
    empty = [name for name, several in found.items() if not several]
    if empty:
        raise ValueError(
            f'None of {len(every)} places is one where "{empty[0]}" can sit with its tolerance. '
            "Try more places, --places 200, or use bp.place with places of your own."
        )
    cells = np.prod([len(several) for several in found.values()])
    if options.search == "exhaustive" and cells > MOST_CELLS:
        raise ValueError(
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
    return [tuple(map(float, at)) for at in _far_apart(known, count)]


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
    options: Options, experiment: Experiment, measured: Measurements | None, progress: Any
) -> Estimator:
    if options.estimator == "separation":
        assert measured is not None
        found = improve(experiment, measured, candidates=library(experiment), progress=progress)
        return information.Separation(found.alternatives)
    after = None
    if measured is not None:
        after = infer(experiment, measured, key=options.seed, progress=progress)
    kinds = {
        "kde": information.KDE,
        "exact": information.Exact,
        "expected-gain": information.ExpectedGain,
    }
    return kinds[options.estimator](after=after)


def _map(
    experiment: Experiment,
    places: dict[str, Sequence[Any]],
    options: Options,
    settings: dict[str, Any],
) -> xr.Dataset | None:
    """Map of one or two transducers, whose cells an exhaustive search has left in the store."""
    if options.search != "exhaustive" or len(places) > 2:
        return None
    return information_map(experiment, places, **settings)


def _figure(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _write(best: Placement, whole: xr.Dataset | None, out: Path) -> None:
    write_text(out / "placement.txt", str(best))
    write_table(out / "placements.csv", best.tried)
    figures = {"placements.png": placement_plots.placements(best)}
    if whole is not None:
        write_whole(out / "map.nc", lambda beside: whole.to_netcdf(beside, engine="h5netcdf"))
        figures["map.png"] = placement_plots.information(whole)
    write_figures(figures, out)
