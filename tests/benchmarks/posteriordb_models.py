"""Models of posteriordb in NumPyro, each with its priors and what its reference names."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import numpyro
import numpyro.distributions as dist

REFERENCE = json.loads((Path(__file__).parent / "posteriordb" / "reference.json").read_text())
JITTER = 1e-10

Values = dict[str, Any]


class Posterior(NamedTuple):
    """A model, its priors by name, and the quantities of the reference from values by name."""

    model: Callable[[], None]
    priors: dict[str, dist.Distribution]
    quantities: Callable[[Values], list[Any]]


class Linear(eqx.Module):
    """A linear regression with flat priors."""

    columns: Any
    target: Any
    priors: dict[str, dist.Distribution]

    def __call__(self) -> None:
        beta = numpyro.sample("beta", self.priors["beta"])
        sigma = numpyro.sample("sigma", self.priors["sigma"])
        numpyro.sample("y", dist.Normal(self.columns @ beta, sigma), obs=self.target)


def linear(columns: list[np.ndarray], target: np.ndarray, widest: float) -> Posterior:
    matrix = np.stack([np.ones(len(target)), *columns], axis=1)
    flat = dist.Uniform(-widest, widest).expand([matrix.shape[1]]).to_event(1)
    priors = {"beta": flat, "sigma": dist.Uniform(0.0, widest)}
    model = Linear(jnp.asarray(matrix), jnp.asarray(target), priors)
    return Posterior(model, priors, lambda values: [*values["beta"], values["sigma"]])


def mesquite(model: str) -> Posterior:
    """Weight of mesquite bushes by their size; all but the first on logarithmic scales."""
    bushes = {name: np.asarray(values) for name, values in REFERENCE["data"]["mesquite"].items()}
    log = {name: np.log(values) for name, values in bushes.items() if name != "group"}
    group = bushes["group"].astype(float)
    area = log["diam1"] + log["diam2"]
    shape = log["diam1"] - log["diam2"]
    volume = area + log["canopy_height"]
    sizes = ["diam1", "diam2", "canopy_height", "total_height", "density"]
    if model == "mesquite":
        plain = [bushes[size].astype(float) for size in sizes]
        return linear([*plain, group], bushes["weight"], 5000.0)
    columns = {
        "logmesquite": [*(log[size] for size in sizes), group],
        "logmesquite_logva": [volume, area, group],
        "logmesquite_logvas": [volume, area, shape, log["total_height"], log["density"], group],
        "logmesquite_logvash": [volume, area, shape, log["total_height"], group],
        "logmesquite_logvolume": [volume],
    }
    return linear(columns[model], log["weight"], 20.0)


def eight_schools_noncentered() -> Posterior:
    data = REFERENCE["data"]["eight_schools"]
    effect, error = np.array(data["y"], dtype=float), np.array(data["sigma"], dtype=float)
    priors = {
        "scaled": dist.Normal(0.0, 1.0).expand([8]).to_event(1),
        "mu": dist.Normal(0.0, 5.0),
        "tau": dist.HalfCauchy(5.0),
    }

    def theta(values: Values) -> Any:
        return values["mu"] + values["tau"] * values["scaled"]

    def model() -> None:
        values = {name: numpyro.sample(name, prior) for name, prior in priors.items()}
        numpyro.sample("y", dist.Normal(theta(values), error), obs=effect)

    return Posterior(model, priors, lambda v: [*theta(v), v["mu"], v["tau"]])


def arma11() -> Posterior:
    y = np.array(REFERENCE["data"]["arma"]["y"])
    priors = {
        "mu": dist.Normal(0.0, 10.0),
        "phi": dist.Normal(0.0, 2.0),
        "theta": dist.Normal(0.0, 2.0),
        "sigma": dist.HalfCauchy(2.5),
    }

    def model() -> None:
        mu, phi, theta, sigma = (numpyro.sample(name, prior) for name, prior in priors.items())

        def step(error: Any, pair: Any) -> tuple[Any, Any]:
            before, now = pair
            error = now - (mu + phi * before + theta * error)
            return error, error

        first = y[0] - (mu + phi * mu)
        _, errors = jax.lax.scan(step, first, (jnp.asarray(y[:-1]), jnp.asarray(y[1:])))
        errors = jnp.concatenate([first[None], errors])
        numpyro.sample("errors", dist.Normal(errors, sigma), obs=jnp.zeros(len(y)))

    return Posterior(model, priors, lambda values: [values[name] for name in priors])


def covariance(x: np.ndarray, values: Values) -> Any:
    """Squared exponential kernel."""
    distance = (x[:, None] - x) / values["rho"]
    return values["alpha"] ** 2 * jnp.exp(-0.5 * distance**2)


def gp_regr() -> Posterior:
    data = {name: np.array(values) for name, values in REFERENCE["data"]["gp_pois_regr"].items()}
    priors = {
        "rho": dist.Gamma(25.0, 4.0),
        "alpha": dist.HalfNormal(2.0),
        "sigma": dist.HalfNormal(1.0),
    }

    def model() -> None:
        values = {name: numpyro.sample(name, prior) for name, prior in priors.items()}
        # The diagonal is sigma, not its square: so it stands in the database.
        matrix = covariance(data["x"], values) + values["sigma"] * jnp.eye(11)
        numpyro.sample("y", dist.MultivariateNormal(0.0, matrix), obs=data["y"])

    return Posterior(model, priors, lambda values: [values[name] for name in priors])


def gp_pois_regr() -> Posterior:
    data = {name: np.array(values) for name, values in REFERENCE["data"]["gp_pois_regr"].items()}
    priors = {
        "rho": dist.Gamma(25.0, 4.0),
        "alpha": dist.HalfNormal(2.0),
        "scaled": dist.Normal(0.0, 1.0).expand([11]).to_event(1),
    }

    def log_rate(values: Values) -> Any:
        matrix = covariance(data["x"], values) + JITTER * jnp.eye(11)
        return jnp.linalg.cholesky(matrix) @ values["scaled"]

    def model() -> None:
        values = {name: numpyro.sample(name, prior) for name, prior in priors.items()}
        numpyro.sample("k", dist.Poisson(jnp.exp(log_rate(values))), obs=data["k"])

    return Posterior(model, priors, lambda v: [v["rho"], v["alpha"], *log_rate(v)])


MODELS: dict[str, Callable[[], Posterior]] = {
    "eight_schools_noncentered": eight_schools_noncentered,
    "arma11": arma11,
    "gp_regr": gp_regr,
    "gp_pois_regr": gp_pois_regr,
}


def posterior(name: str) -> Posterior:
    """Model of a posterior of the database, `data-model`."""
    data, model = name.split("-")
    return mesquite(model) if data == "mesquite" else MODELS[model]()
