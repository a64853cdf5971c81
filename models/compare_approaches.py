"""Kernel density estimate against latent variables: what the same data say by either.

The paper estimates the density of z given h from draws of the placement, with kernels, inside
importance sampling from the prior (KDE). Here the placement is an unknown like the others, sampled
along by SMC (latent). Where parameters are few, quadrature tells which of the two is right.

Three scenes: the bar of the paper, and the bar on which somebody left a clamp, by a model without
and by one with a point mass. All observe the logarithm of the amplitude at ten lines, since a
density estimate needs few outputs.

    python models/compare_approaches.py            # some minutes
    python models/compare_approaches.py --fast     # the clamp alone at tiny sizes: half a minute
    python models/compare_approaches.py --out DIR  # and a figure
"""

import argparse
import sys
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpyro.distributions as dist
import pandas as pd
import xarray as xr
from matplotlib.figure import Figure

import bayes_placement as bp
from bayes_placement._sites import Role
from bayes_placement.inference.cross_check import GRID_UNKNOWNS, Method
from bayes_placement.inference.infer import InferenceWarning

try:
    from models import bar, hidden_effect
except ImportError:  # as a script, this folder is searched instead of the one above it
    import bar
    import hidden_effect

STIFFNESS, DAMPING = "structure.modes.youngs_modulus", "structure.damping.ratio"
PAPER, WITHOUT, WITH = "bar", "clamp, model without it", "clamp, model with it"
KDE, LATENT, EXACT = "KDE", "latent", "quadrature"


class Sizes(NamedTuple):
    """How much each approach computes.

    Parameters
    ----------
    draws
        Draws of h from the prior, n_sim,h of the paper.
    kernels
        Draws of the placement for each, n_sim,p.
    particles, moves
        Of the SMC.
    nodes
        Nodes for each parameter of the grid; 0 for no quadrature.
    placement_nodes
        Nodes for each position.
    """

    draws: int = 2000
    kernels: int = 800
    particles: int = 1000
    moves: int = 30
    nodes: int = 24
    placement_nodes: int = 128


FULL, FAST = Sizes(), Sizes(200, 50, 120, 5, 0, 0)


class Scene(NamedTuple):
    """An experiment, its measurement, and the parameter that the approaches are compared by."""

    experiment: bp.Experiment
    measurement: bp.Measurement
    parameter: str
    truth: Mapping[str, float]


class Study(NamedTuple):
    """Results of each approach, by scene."""

    scenes: Mapping[str, Scene]
    results: Mapping[str, Mapping[str, xr.DataTree]]

    def __str__(self) -> str:
        """Lay out a table for each scene, then what follows."""
        tables = [f"{scene}\n{table(self, scene).T.to_string()}\n" for scene in self.results]
        return "\n".join([*tables, *(f"- {line}" for line in words(self))])


def clamped(structure: bp.Structure, lines: int = 10) -> bp.Experiment:
    """Return the experiment of the clamped bar with the log amplitude at a few of its lines."""
    whole = hidden_effect.experiment
    chosen = np.linspace(2, 60, lines).round().astype(int)  # 36 to 500 Hz: three resonances
    return bp.Experiment(
        structure,
        sensors=list(whole.sensor.values()),
        actuators=list(whole.actuator.values()),
        frequency=hidden_effect.measurement.frequency[chosen],
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def scenes() -> dict[str, Scene]:
    """Return the three scenes; the last two are of one measurement."""
    drawn = hidden_effect.bar()
    up_to_its_own = dist.LogUniform(0.01, 9.0)
    mass = bp.effects.point_mass(dist.Uniform(0.0, 1.0), up_to_its_own)
    known = (hidden_effect.measurement, STIFFNESS, hidden_effect.truth)
    return {
        PAPER: Scene(bar.experiment, bar.measurement, f"{DAMPING}.1", bar.truth),
        WITHOUT: Scene(clamped(drawn), *known),
        WITH: Scene(clamped(drawn + mass), *known),
    }


def approaches(experiment: bp.Experiment, sizes: Sizes) -> list[Method]:
    """Return the approaches that suit an experiment."""
    smc = bp.engines.SMC(particles=sizes.particles, populations=2, moves=sizes.moves)
    density = bp.marginals.KDE(placement_draws=sizes.kernels)
    found = [
        Method(KDE, bp.engines.Importance(draws=sizes.draws), density),
        Method(LATENT, smc, bp.marginals.Latent()),
    ]
    parameters = [one for one in experiment.unknowns if one.role is Role.PARAMETER]
    if sizes.nodes and len(parameters) <= GRID_UNKNOWNS:
        nodes = bp.marginals.Quadrature(nodes=sizes.placement_nodes)
        found.append(Method(EXACT, bp.engines.Grid(nodes=sizes.nodes), nodes))
    return found


def study(sizes: Sizes = FULL, names: Sequence[str] | None = None, key: int = 0) -> Study:
    """Infer every scene by every approach.

    Parameters
    ----------
    sizes
        How much each computes.
    names
        Scenes; all by default.
    key
        Seed.
    """
    chosen = {name: one for name, one in scenes().items() if names is None or name in names}
    return Study(chosen, {name: _results(scene, sizes, key) for name, scene in chosen.items()})


def _results(scene: Scene, sizes: Sizes, key: int) -> dict[str, xr.DataTree]:
    with warnings.catch_warnings():  # the table and the words say what is wrong with each
        warnings.simplefilter("ignore", InferenceWarning)
        return {
            name: bp.infer(
                scene.experiment, scene.measurement, engine=engine, marginal=marginal, key=key
            )
            for name, engine, marginal in approaches(scene.experiment, sizes)
        }


def table(found: Study, scene: str) -> pd.DataFrame:
    """Figures of every parameter, divergence, evidence, effective draws and seconds.

    One row for each approach.
    """
    rows = {name: _row(result) for name, result in found.results[scene].items()}
    return pd.DataFrame.from_dict(rows, orient="index")


def _row(result: xr.DataTree) -> dict[str, str]:
    estimates, row = result["estimates"].to_dataset(), {}
    parameters = estimates["unknown"].values[estimates["role"] == Role.PARAMETER.value]
    for name in parameters:
        one, short = estimates.sel(unknown=name), name.removeprefix("structure.")
        row |= {f"{short} mean": _number(one["mean"]), f"{short} variation": _number(one["cv"])}
    exact = result.attrs["engine"] == "Grid"
    ess = np.nan if exact else estimates["ess"].sel(unknown=parameters).min()
    row |= {"KL of parameters [nat]": _number(estimates["kl_parameters"])}
    row |= {"log evidence": _number(estimates["log_evidence"]), "smallest ESS": _number(ess)}
    row |= {"kernel / noise": _number(_kernel_over_noise(result))}
    return row | {"seconds": f"{result.attrs['seconds']:.0f}"}


def _number(value: Any) -> str:
    return "-" if np.isnan(float(value)) else f"{float(value):.4g}"


def _kernel_over_noise(result: xr.DataTree) -> float:
    stats = result["sample_stats"].to_dataset()
    return float(stats["kernel_over_noise"].mean()) if "kernel_over_noise" in stats else np.nan


def words(found: Study) -> list[str]:
    """Say what is learnt: kernels against noise, bias by a hidden effect, its cure and its size."""
    lines = [
        *(line for scene in found.results for line in _warnings(found, scene)),
        *(_width_words(found, scene) for scene in found.results),
    ]
    if {WITHOUT, WITH} <= set(found.results):
        lines += [_bias_words(found, approach) for approach in (KDE, LATENT)]
        lines.append(_misfit_words(found))
        lines += _comparison_words(found)
    return lines


def _warnings(found: Study, scene: str) -> list[str]:
    """Return what each approach warns of."""
    return [
        f"{scene}, {approach}: {line}"
        for approach, result in found.results[scene].items()
        for line in result.attrs["warnings"]
    ]


def _estimate(found: Study, scene: str, approach: str) -> xr.Dataset:
    estimates = found.results[scene][approach]["estimates"].to_dataset()
    return estimates.sel(unknown=found.scenes[scene].parameter)


def _width_words(found: Study, scene: str) -> str:
    others = [name for name in found.results[scene] if name != KDE]
    against = " and ".join(
        f"{float(_estimate(found, scene, name)['cv']):.2g} by {name}" for name in others
    )
    ratio = _kernel_over_noise(found.results[scene][KDE])
    one = _estimate(found, scene, KDE)
    return (
        f"{scene}: the kernels are {ratio:.1f} times as wide as the output error, and KDE finds "
        f"{found.scenes[scene].parameter} to a coefficient of variation of {float(one['cv']):.2g} "
        f"({float(one['ess']):.0f} draws effective), against {against}."
    )


def _bias_words(found: Study, approach: str) -> str:
    true = found.scenes[WITH].truth[STIFFNESS]
    said = []
    for scene in (WITHOUT, WITH):
        one = _estimate(found, scene, approach)
        mean, deviation, ess = float(one["mean"]), float(one["sd"]), float(one["ess"])
        errors = f"{abs(mean - true) / deviation:.1f} of its standard deviations"
        few = f"though on {ess:.0f} effective draws, too few for an estimate"
        said.append(f"{100 * abs(mean - true) / true:.2g} % off, {few if ess < 10 else errors}")
    return (
        f"{approach}: without the clamp in the model, Young's modulus is {said[0]}; with a point "
        f"mass in the model, {said[1]}."
    )


def _misfit_words(found: Study) -> str:
    """Say by how much the evidence rises with the mass, as either approach sees it."""
    evidence = {
        (approach, scene): float(_estimate(found, scene, approach)["log_evidence"])
        for approach in (KDE, LATENT)
        for scene in (WITHOUT, WITH)
    }
    rise = [evidence[one, WITH] - evidence[one, WITHOUT] for one in (KDE, LATENT)]
    return (
        f"Adding the mass raises the log evidence by {rise[0]:.0f} as KDE sees it and by "
        f"{rise[1]:.0f} with latent placement: wide kernels take a misfit for uncertain placement."
    )


def _comparison_words(found: Study) -> list[str]:
    models = {scene: found.results[scene][LATENT] for scene in (WITHOUT, WITH)}
    compared = bp.compare(models)
    return compared.words()[len(compared.warnings) :]


def figure(found: Study) -> Figure:
    """Posterior of the compared parameter by each approach, one panel a scene."""
    drawn = Figure(figsize=(6.4, 2.6 * len(found.results)), layout="constrained")
    axes = drawn.subplots(len(found.results), 1, squeeze=False).ravel()
    for axis, (name, results) in zip(axes, found.results.items(), strict=True):
        scene = found.scenes[name]
        for number, (approach, result) in enumerate(results.items()):
            draws = result["posterior"][scene.parameter].values.ravel()
            bins = _cells(draws) if approach == EXACT else 25
            _density(axis, draws, bins, label=approach, color=f"C{number}", linestyle="-")
        axis.axvline(scene.truth[scene.parameter], color="k", linestyle=":", label="true value")
        unit = result["posterior"][scene.parameter].attrs["units"]
        prior = result["prior"][scene.parameter]
        axis.set_xlim(float(prior.min()), float(prior.max()))
        axis.set_ylim(0.0, 1.1)
        axis.set_xlabel(f"{scene.parameter} [{unit}]")
        axis.set_ylabel("density / its peak")
        axis.set_title(name)
        axis.legend(loc="upper left")
    return drawn


def _cells(draws: np.ndarray) -> np.ndarray:
    """Edges midway between nodes, so that each stands for the interval about it."""
    nodes = np.unique(draws)
    middle = (nodes[1:] + nodes[:-1]) / 2
    return np.concatenate([[2 * nodes[0] - middle[0]], middle, [2 * nodes[-1] - middle[-1]]])


def _density(axis: Any, draws: np.ndarray, bins: Any = 25, **style: Any) -> None:
    """Outline of the draws; a line where all of them are copies of one."""
    if np.ptp(draws) == 0:
        axis.axvline(draws[0], **style)
        return
    count, edges = np.histogram(draws, bins, density=True)
    axis.stairs(count / count.max(), edges, linewidth=1.5, **style)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study, write its tables and words, and its figure to a folder."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--fast", action="store_true", help="the clamp alone, at tiny sizes")
    parser.add_argument("--out", type=Path, help="folder for approaches.png")
    given = parser.parse_args(arguments)
    found = study(FAST, (WITHOUT, WITH)) if given.fast else study()
    sys.stdout.write(f"{found}\n")
    if given.out is not None:
        given.out.mkdir(parents=True, exist_ok=True)
        figure(found).savefig(given.out / "approaches.png", dpi=150)


if __name__ == "__main__":
    main()
