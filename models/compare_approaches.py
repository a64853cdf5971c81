"""Kernel density estimate and latent positions, compared on the same data.

The paper estimates the density of z given h by kernels, from draws of the placement, inside
importance sampling from the prior (KDE). Here the placement is also sampled with the parameters by
SMC (latent). Where parameters are few, quadrature gives the exact posterior.

Three scenes: the bar of the paper, and the bar on which a clamp was left, with a model without and
a model with a point mass. All observe the logarithm of the amplitude at ten lines, since a density
estimate needs few outputs.

    python models/compare_approaches.py            # a few minutes
    python models/compare_approaches.py --fast     # the clamp only, small: half a minute
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
from bayes_placement._shared.sites import Role
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
    """Settings of each approach.

    Parameters
    ----------
    draws
        Draws of h from the prior, n_sim,h of the paper.
    kernels
        Draws of the placement, n_sim,p.
    particles, moves
        Particles of SMC, and moves of each.
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
    """An experiment, its measurement, and the parameter by which approaches are compared."""

    experiment: bp.Experiment
    measurement: bp.Measurement
    parameter: str
    truth: Mapping[str, float]


class Comparison(NamedTuple):
    """Results of each approach, by scene."""

    scenes: Mapping[str, Scene]
    results: Mapping[str, Mapping[str, xr.DataTree]]

    def __str__(self) -> str:
        """Table of each scene, then conclusions."""
        tables = [f"{scene}\n{table(self, scene).T.to_string()}\n" for scene in self.results]
        return "\n".join([*tables, *(f"- {line}" for line in sentences(self))])


def clamped(structure: bp.Structure, lines: int = 10) -> bp.Experiment:
    """Experiment of the bar with the clamp, for the log amplitude at a few of its lines."""
    full = hidden_effect.experiment
    chosen = np.linspace(2, 60, lines).round().astype(int)  # 36 to 500 Hz: three resonances
    return bp.Experiment(
        structure,
        sensors=list(full.sensor.values()),
        actuators=list(full.actuator.values()),
        frequency=hidden_effect.measurement.frequency[chosen],
        observe=bp.observe.LogAmplitude("acceleration"),
        noise=bp.noise.FromCoherence(),
    )


def scenes() -> dict[str, Scene]:
    """The three scenes; the last two have the same measurement."""
    nominal = hidden_effect.bar()
    up_to_mass_of_bar = dist.LogUniform(0.01, 9.0)
    mass = bp.effects.point_mass(dist.Uniform(0.0, 1.0), up_to_mass_of_bar)
    common = (hidden_effect.measurement, STIFFNESS, hidden_effect.truth)
    return {
        PAPER: Scene(bar.experiment, bar.measurement, f"{DAMPING}.1", bar.truth),
        WITHOUT: Scene(clamped(nominal), *common),
        WITH: Scene(clamped(nominal + mass), *common),
    }


def approaches(experiment: bp.Experiment, sizes: Sizes) -> list[Method]:
    """Approaches that are feasible for an experiment."""
    smc = bp.engines.SMC(particles=sizes.particles, populations=2, moves=sizes.moves)
    density = bp.marginals.KDE(placement_draws=sizes.kernels)
    methods = [
        Method(KDE, bp.engines.Importance(draws=sizes.draws), density),
        Method(LATENT, smc, bp.marginals.Latent()),
    ]
    parameters = [unknown for unknown in experiment.unknowns if unknown.role is Role.PARAMETER]
    if sizes.nodes and len(parameters) <= GRID_UNKNOWNS:
        nodes = bp.marginals.Quadrature(nodes=sizes.placement_nodes)
        methods.append(Method(EXACT, bp.engines.Grid(nodes=sizes.nodes), nodes))
    return methods


def study(sizes: Sizes = FULL, names: Sequence[str] | None = None, key: int = 0) -> Comparison:
    """Infer every scene by every approach.

    Parameters
    ----------
    sizes
        Settings of each approach.
    names
        Scenes; all by default.
    key
        Seed.
    """
    chosen = {name: scene for name, scene in scenes().items() if names is None or name in names}
    return Comparison(chosen, {name: _results(scene, sizes, key) for name, scene in chosen.items()})


def _results(scene: Scene, sizes: Sizes, key: int) -> dict[str, xr.DataTree]:
    with warnings.catch_warnings():  # table and sentences report the diagnostics of each
        warnings.simplefilter("ignore", InferenceWarning)
        return {
            name: bp.infer(
                scene.experiment, scene.measurement, engine=engine, marginal=marginal, key=key
            )
            for name, engine, marginal in approaches(scene.experiment, sizes)
        }


def table(comparison: Comparison, scene: str) -> pd.DataFrame:
    """Estimates of every parameter, divergence, evidence, effective draws and seconds.

    A row for each approach.
    """
    rows = {name: _row(result) for name, result in comparison.results[scene].items()}
    return pd.DataFrame.from_dict(rows, orient="index")


def _row(result: xr.DataTree) -> dict[str, str]:
    estimates, row = result["estimates"].to_dataset(), {}
    parameters = estimates["unknown"].values[estimates["role"] == Role.PARAMETER.value]
    for name in parameters:
        estimate, short = estimates.sel(unknown=name), name.removeprefix("structure.")
        row |= {
            f"{short} mean": _number(estimate["mean"]),
            f"{short} variation": _number(estimate["cv"]),
        }
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


def sentences(comparison: Comparison) -> list[str]:
    """Conclusions: kernels compared with noise, bias by a hidden effect, and its correction."""
    lines = [
        *(line for scene in comparison.results for line in _warnings(comparison, scene)),
        *(_width_sentence(comparison, scene) for scene in comparison.results),
    ]
    if {WITHOUT, WITH} <= set(comparison.results):
        lines += [_bias_sentence(comparison, approach) for approach in (KDE, LATENT)]
        lines.append(_evidence_sentence(comparison))
        lines += _comparison_sentences(comparison)
    return lines


def _warnings(comparison: Comparison, scene: str) -> list[str]:
    """Warnings of each approach."""
    return [
        f"{scene}, {approach}: {line}"
        for approach, result in comparison.results[scene].items()
        for line in result.attrs["warnings"]
    ]


def _estimate(comparison: Comparison, scene: str, approach: str) -> xr.Dataset:
    estimates = comparison.results[scene][approach]["estimates"].to_dataset()
    return estimates.sel(unknown=comparison.scenes[scene].parameter)


def _width_sentence(comparison: Comparison, scene: str) -> str:
    others = [name for name in comparison.results[scene] if name != KDE]
    others_words = " and ".join(
        f"{float(_estimate(comparison, scene, name)['cv']):.2g} by {name}" for name in others
    )
    ratio = _kernel_over_noise(comparison.results[scene][KDE])
    by_kernels = _estimate(comparison, scene, KDE)
    return (
        f"{scene}: the kernels are {ratio:.1f} times as wide as the output error, and KDE finds "
        f"{comparison.scenes[scene].parameter} to a coefficient of variation of "
        f"{float(by_kernels['cv']):.2g} (effective sample size {float(by_kernels['ess']):.0f}), "
        f"compared with {others_words}."
    )


def _bias_sentence(comparison: Comparison, approach: str) -> str:
    true = comparison.scenes[WITH].truth[STIFFNESS]
    deviations = []
    for scene in (WITHOUT, WITH):
        estimate = _estimate(comparison, scene, approach)
        mean, deviation, ess = (float(estimate[name]) for name in ("mean", "sd", "ess"))
        errors = f"{abs(mean - true) / deviation:.1f} of its standard deviations"
        warning = f"with an effective sample size of {ess:.0f}, too small for an estimate"
        deviations.append(
            f"{100 * abs(mean - true) / true:.2g} % off, {warning if ess < 10 else errors}"
        )
    return (
        f"{approach}: without the clamp in the model, Young's modulus is {deviations[0]}; with a "
        f"point mass in the model, {deviations[1]}."
    )


def _evidence_sentence(comparison: Comparison) -> str:
    """Increase of the evidence by the mass, for both approaches."""
    evidence = {
        (approach, scene): float(_estimate(comparison, scene, approach)["log_evidence"])
        for approach in (KDE, LATENT)
        for scene in (WITHOUT, WITH)
    }
    rise = [evidence[approach, WITH] - evidence[approach, WITHOUT] for approach in (KDE, LATENT)]
    return (
        f"Adding the mass raises the log evidence by {rise[0]:.0f} with KDE and by {rise[1]:.0f} "
        "with latent placement: wide kernels attribute misfit to uncertain placement."
    )


def _comparison_sentences(comparison: Comparison) -> list[str]:
    models = {scene: comparison.results[scene][LATENT] for scene in (WITHOUT, WITH)}
    compared = bp.compare(models)
    return compared.words()[len(compared.warnings) :]


def figure(comparison: Comparison) -> Figure:
    """Posterior of the compared parameter by each approach, with a panel for each scene."""
    drawn = Figure(figsize=(6.4, 2.6 * len(comparison.results)), layout="constrained")
    axes = drawn.subplots(len(comparison.results), 1, squeeze=False).ravel()
    for axis, (name, results) in zip(axes, comparison.results.items(), strict=True):
        scene = comparison.scenes[name]
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
    """Edges midway between nodes, so that each node is the middle of its interval."""
    nodes = np.unique(draws)
    middle = (nodes[1:] + nodes[:-1]) / 2
    return np.concatenate([[2 * nodes[0] - middle[0]], middle, [2 * nodes[-1] - middle[-1]]])


def _density(axis: Any, draws: np.ndarray, bins: Any = 25, **style: Any) -> None:
    """Outline of the histogram of draws; a line where all draws are equal."""
    if np.ptp(draws) == 0:
        axis.axvline(draws[0], **style)
        return
    count, edges = np.histogram(draws, bins, density=True)
    axis.stairs(count / count.max(), edges, linewidth=1.5, **style)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the study, write its tables and conclusions, and its figure to a folder."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--fast", action="store_true", help="the clamp only, with small settings")
    parser.add_argument("--out", type=Path, help="folder for approaches.png")
    options = parser.parse_args(arguments)
    comparison = study(FAST, (WITHOUT, WITH)) if options.fast else study()
    sys.stdout.write(f"{comparison}\n")
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
        figure(comparison).savefig(options.out / "approaches.png", dpi=150)


if __name__ == "__main__":
    main()
