"""Results of inference whose posterior is known in closed form."""

import numpy as np
import pytest
import xarray as xr


def lay_out(measured, draws, *, deviation=None, replicates=None, frequency=None, levels=None):
    """Lay out arrays [sensor, actuator, part, frequency] as `infer` does; one part is no axis.

    With levels, the lines of all of them follow each other along the last axis.
    """
    parts, lines = measured.shape[2:]
    unit = "acceleration per force [(m/s²)/N]"
    attributes = {"units": unit if parts == 2 else f"log10 of {unit}"}
    frequency = np.linspace(10, 500, lines) if frequency is None else frequency
    coordinates = {
        "sensor": [f"s{i + 1}" for i in range(measured.shape[0])],
        "actuator": [f"a{i + 1}" for i in range(measured.shape[1])],
        "frequency": ("frequency", frequency, {"units": "Hz"}),
    }
    if parts == 2:
        coordinates["part"] = ["real", "imaginary"]
    if levels is not None:
        coordinates["force_level"] = ("force_level", levels, {"units": "N"})
        coordinates["frequency"] = ("frequency", frequency[: lines // len(levels)], {"units": "Hz"})

    def by_level(array):
        """Array [..., part, line] as [..., force_level, part, frequency]."""
        if levels is None:
            return array
        return np.stack(np.split(array, len(levels), axis=-1), axis=-3)

    def group(leading, **arrays):
        part = ("part",) if parts == 2 else ()
        level = () if levels is None else ("force_level",)
        dims = (*leading, "sensor", "actuator", *level, *part, "frequency")
        arrays = {n: by_level(x) for n, x in arrays.items() if x is not None}
        arrays = {n: x if parts == 2 else x[..., 0, :] for n, x in arrays.items()}
        variables = {name: (dims, array, attributes) for name, array in arrays.items()}
        return xr.Dataset(variables, coords=coordinates)

    chain = {"response": draws[None]}
    if replicates is not None:
        chain["measured"] = replicates[None]
    return {
        "/observed_data": group((), measured=measured, deviation=deviation),
        "/posterior_predictive": group(("chain", "draw"), **chain),
    }


def linear_gaussian(
    seed,
    *,
    shape=(3, 2, 2, 60),
    unknowns=6,
    prior=1.0,
    draws=200,
    known=True,
    missing=0.0,
    levels=1,
    noise=True,
):
    """Result of an exact inference of a linear model with Gaussian prior and noise.

    `missing` [noise deviations] is in the data and not in the model. The noise is not of the same
    size at all lines.
    """
    random = np.random.default_rng(seed)
    sensors, actuators, parts, lines = shape
    frequency = np.tile(np.linspace(10, 500, lines), levels)
    shape = (sensors, actuators, parts, lines * levels)
    bumps = np.exp(-0.5 * ((frequency - np.linspace(30, 480, unknowns)[:, None]) / 60) ** 2)
    basis = 3 * bumps[:, None, None, None] * random.normal(size=(unknowns, *shape[:3], 1))
    deviation = 0.3 * np.exp(np.sin(frequency / 40)) * np.ones(shape)
    matrix = (basis / deviation).reshape(unknowns, -1).T
    truth = prior * random.normal(size=unknowns)
    over = matrix @ truth + random.normal(size=matrix.shape[0])
    over = over + (missing * np.ones(shape)).ravel()
    covariance = np.linalg.inv(matrix.T @ matrix + np.eye(unknowns) / prior**2)
    values = random.multivariate_normal(covariance @ matrix.T @ over, covariance, size=draws)
    response = (values @ matrix.T).reshape(draws, *shape) * deviation
    replicates = response + deviation * random.normal(size=response.shape)
    groups = lay_out(
        over.reshape(shape) * deviation,
        response,
        deviation=deviation if known else None,
        replicates=replicates if noise else None,
        frequency=frequency,
        levels=2.0 * np.arange(1, levels + 1) if levels > 1 else None,
    )

    def named(array):
        columns = {f"structure.h{i}": (("chain", "draw"), x[None]) for i, x in enumerate(array.T)}
        return xr.Dataset(columns)

    groups["/posterior"] = named(values)
    groups["/prior"] = named(prior * random.normal(size=(1000, unknowns)))
    return xr.DataTree.from_dict(groups)


@pytest.fixture(scope="session")
def correct_model():
    """Return the function that makes such results."""
    return linear_gaussian
