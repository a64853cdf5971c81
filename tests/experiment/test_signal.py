"""FRFs of noise alone are refused before any search; responses of structures are not."""

import dataclasses

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.experiment.data_checks.without_model import is_signal
from tests.criticism.small import experiment, measured


def test_noise_is_taken_for_a_signal_as_often_as_stated():
    random = np.random.default_rng(3)
    shapes = random.normal(size=(400, 2, 60)) + 1j * random.normal(size=(400, 2, 60))
    often = np.mean([is_signal([*frfs]) for frfs in shapes])
    assert abs(often - 0.05) < 5 * np.sqrt(0.05 * 0.95 / 400)


@pytest.mark.parametrize("lines", [40, 100])
@pytest.mark.parametrize("noise", [0.01, 0.3])
def test_responses_of_a_structure_are_signals(lines, noise):
    random = np.random.default_rng(4)
    frequency = np.linspace(20, 900, lines)
    frf = sum(1 / (k**2 - frequency**2 + 0.04j * k * frequency) for k in (150, 310, 480, 700))
    assert is_signal([frf * (1 + noise * random.normal(size=lines))])
    assert is_signal([np.full(lines, 1.0 + 0j) + 1e-3 * random.normal(size=lines)])


@pytest.mark.parametrize(
    ("frf", "words"),
    [
        (0.0, "There is no signal: the greatest FRF is 0;"),
        (1e-200, "There is no signal: the greatest FRF is"),
        (1.0, "There is no signal: FRFs at neighbouring lines have no more in common"),
    ],
    ids=["zero", "tiny", "noise"],
)
@pytest.mark.parametrize("search", [bp.explain, bp.improve, bp.reach])
def test_no_search_explains_noise(frf, words, search):
    model = experiment()
    nominal = measured()
    random = np.random.default_rng(5)
    noise = random.normal(size=nominal.frf.shape) + 1j * random.normal(size=nominal.frf.shape)
    with pytest.raises(InputError, match=words):
        search(model, dataclasses.replace(nominal, frf=frf * noise))
