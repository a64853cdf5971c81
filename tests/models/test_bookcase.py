"""The wrong instrument of the measured frame is named first, with strong evidence."""

import json

import numpy as np
import pytest

import bayes_placement as bp
from bayes_placement._shared.compiled import compiled
from models import bookcase

KINDS = ["reversed_sensor", "gain_error", "swapped_sensors", "point_mass"]


def test_the_study_says_which_data_it_needs(monkeypatch):
    monkeypatch.delenv(bookcase.FOLDER, raising=False)
    with pytest.raises(FileNotFoundError, match="BOOKCASE_DATA"):
        bookcase.read()


@pytest.mark.long
def test_at_low_frequency_the_frame_moves_as_one_mass():
    """Nominal masses; 1 Hz is far below the first resonance, and the rail holds nothing."""
    experiment = bookcase.experiment_at([1.0])
    ones = {name: 1.0 for name in experiment.unknown if ".parameter." in name}
    exact = experiment.with_model_error(None).fix(ones)
    values = {u.name: 0.01 for u in exact.unknowns}
    frf = np.asarray(compiled(bp.Experiment.frf)(exact.fix(values)))
    np.testing.assert_allclose(frf[:, 0, 0].real, 1 / (4 * bookcase.PLATE), rtol=0.02)


@pytest.mark.long
@pytest.mark.longest
def test_the_wrong_instrument_is_named_first_and_with_strong_evidence(shared_data):
    folder = shared_data / "measured/bookcase"
    measurement = bookcase.read(folder).thinned(80)
    experiment = bookcase.experiment_at(measurement.frequency)
    ledger = bp.improve(
        experiment, measurement, candidates=bp.effects.library(experiment, KINDS), most_effects=1
    )
    assert ledger.verdict == ("reversed_sensor",)
    first, last = ledger.steps
    assert last.setting == "sensor base_low"
    assert last.log_evidence > first.log_evidence + 100
    assert last.held_out > first.held_out
    assert last.noise_needed.relative < 0.7 * first.noise_needed.relative
    assert last.model_error["shape"].mean < 0.5 * first.model_error["shape"].mean
    truth = json.loads((folder / "truth.json").read_text())
    assert truth["what"].startswith("channel 0") and next(iter(bookcase.CHANNELS)) == "base_low"
