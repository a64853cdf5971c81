"""Modal parameters from FRFs: against closed-form poles, and on real measurements."""

import dataclasses
import warnings

import numpy as np
import pytest
from scipy.stats import chi2

import bayes_placement as bp
from bayes_placement._shared.errors import InputError
from bayes_placement.experiment.identification import IdentificationWarning
from tests.experiment import modal_bars

PLACES, DRIVEN = (0.12, 0.31, 0.47, 0.83), (0.21, 0.68)
RATIO = 0.01
NOISE = 0.01
"""Standard deviation of the noise over |H|, and five times less over its median everywhere."""

NATURAL = 500 / 3 * np.arange(1, 201)
"""Natural frequencies of the bar of `modal_bars` [Hz]."""

LINES = np.arange(60.0, 600.0, 1.0)


def shapes(places):
    """Mass-normalised shapes (place, mode)."""
    size = np.sqrt(2 / (modal_bars.DENSITY * modal_bars.AREA))
    return size * np.sin(np.pi * np.outer(places, np.arange(1, NATURAL.size + 1)))


def measured(*, seed=None, derivative=2, driven=DRIVEN, natural=NATURAL, lines=LINES, noise=NOISE):
    """FRFs of the bar in closed form, with noise of stated variance from a seed."""
    omega, of_modes = 2 * np.pi * lines, 2 * np.pi * natural[:, None]
    gain = (1j * omega) ** derivative / (of_modes**2 - omega**2 + 2j * RATIO * of_modes * omega)
    frf = np.einsum("sn,an,nf->saf", shapes(PLACES), shapes(driven), gain)
    size = noise * (np.abs(frf) + 0.2 * np.median(np.abs(frf)))
    if seed is not None:
        parts = np.random.default_rng(seed).standard_normal((2, *frf.shape))
        frf = frf + size * (parts[0] + 1j * parts[1]) / np.sqrt(2)
    return bp.Measurement.from_arrays(
        frf,
        lines,
        sensors=[f"s{number}" for number in range(len(PLACES))],
        actuators=[f"a{number}" for number in range(len(driven))],
        quantity=("receptance", "mobility", "accelerance")[derivative],
        variance=None if seed is None else size**2,
    )


def squares(modes, natural):
    """Squared errors over their variance: of frequency, of damping, and of each shape."""
    errors = np.stack([modes.natural_frequency - natural, modes.damping_ratio - RATIO])
    of_shapes = []
    for shape, covariance, true in zip(
        modes.shape.T, modes.covariance, shapes(PLACES).T, strict=False
    ):
        weight = np.linalg.inv(covariance[2:, 2:])
        left = shape - true * (true @ weight @ shape) / (true @ weight @ true)
        of_shapes.append(left @ weight @ left)
    return (errors / modes.deviation[:2]) ** 2, np.array(of_shapes)


def are_as_stated(squares, freedom):
    """Whether a sum of squares is one of chi2, at 1 in 1000 on either side."""
    return 0.0005 < chi2.cdf(np.sum(squares), freedom) < 0.9995


@pytest.mark.long
def test_errors_are_as_large_as_stated():
    """Twenty measurements of three modes, by chi2 of frequency, damping and shapes."""
    found = [squares(bp.identify(measured(seed=seed)), NATURAL[:3]) for seed in range(20)]
    of_poles, of_shapes = (np.stack(parts) for parts in zip(*found, strict=True))
    assert are_as_stated(of_poles[:, 0], 60)
    assert are_as_stated(of_poles[:, 1], 60)
    assert are_as_stated(of_shapes, 180)
    assert are_as_stated(of_poles.sum() + of_shapes.sum(), 300)


@pytest.mark.parametrize("derivative", [0, 1, 2])
@pytest.mark.parametrize("driven", [DRIVEN, DRIVEN[:1]])
def test_two_modes_in_one_peak_are_told_apart(derivative, driven):
    natural = np.insert(NATURAL[[0, 3, *range(4, 200)]], 1, [330.0, 335.0])
    modes = bp.identify(measured(seed=1, derivative=derivative, driven=driven, natural=natural))
    assert modes.natural_frequency.size == 3
    of_poles, of_shapes = squares(modes, natural[:3])
    assert are_as_stated(of_poles, 6)
    assert are_as_stated(of_shapes, 9)


@pytest.mark.long
def test_modes_are_those_of_the_model():
    modes = bp.identify(measured(seed=2))
    declared = modal_bars.experiment(modes, PLACES)
    data = declared.data(modes)
    left = (data.z - declared.observe.predicted(declared)) / data.deviation
    counted = np.asarray(data.measured)
    assert are_as_stated(np.asarray(left)[counted] ** 2, counted.sum())


def test_shapes_at_the_places_of_a_hammer_are_those_of_its_actuators():
    whole = measured(seed=3)
    hammered = bp.Measurement.from_arrays(
        whole.frf.swapaxes(0, 1),
        whole.frequency,
        sensors=whole.actuators,
        actuators=whole.sensors,
        quantity=whole.quantity,
        variance=whole.variance.swapaxes(0, 1),
    )
    one, other = bp.identify(whole), bp.identify(hammered, shapes_at="actuators", number=[1, 2, 3])
    np.testing.assert_allclose(other.covariance, one.covariance, rtol=1e-6, atol=1e-15)
    assert (other.sensors, other.number) == (one.sensors, (1, 2, 3))


def test_what_was_not_measured_has_no_shape_and_computed_lines_no_noise():
    whole = measured()
    frf = whole.frf.copy()
    frf[1], frf[2, 0] = np.nan, np.nan
    modes = bp.identify(
        bp.Measurement.from_arrays(
            frf,
            whole.frequency,
            sensors=whole.sensors,
            actuators=whole.actuators,
            quantity=whole.quantity,
        )
    )
    assert np.isnan(modes.shape[1]).all()
    np.testing.assert_allclose(modes.natural_frequency, NATURAL[:3], rtol=1e-5)
    np.testing.assert_allclose(modes.damping_ratio, RATIO, rtol=1e-3)


def test_a_mode_at_the_end_of_the_lines_is_left_out_in_a_sentence():
    with pytest.warns(
        IdentificationWarning, match="The peak at 500 Hz is left out: it is cut off by the end"
    ):
        modes = bp.identify(measured(seed=4, lines=LINES[LINES < 504.0]))
    assert modes.natural_frequency.size == 2


def test_noise_that_is_stated_too_small_makes_errors_larger():
    known = measured(seed=5)
    small = bp.Measurement.from_arrays(
        known.frf,
        known.frequency,
        sensors=known.sensors,
        actuators=known.actuators,
        quantity=known.quantity,
        variance=known.variance / 100,
    )
    with pytest.warns(IdentificationWarning, match="10 times as much about the modes"):
        modes = bp.identify(small)
    right = bp.identify(known)
    np.testing.assert_allclose(modes.deviation[0], right.deviation[0], rtol=0.05)


def test_lines_without_a_peak_are_refused():
    with pytest.raises(InputError, match="No peak of the FRFs stands out of their noise"):
        bp.identify(measured(seed=6, lines=np.arange(200.0, 300.0, 1.0)))


def test_a_pole_that_bends_the_background_is_no_mode():
    lines = np.arange(1.0, 200.0)
    resonance = lines**2 / (100.0**2 - lines**2 + 60j * lines)
    noise = 1e-3 * np.random.default_rng(0).standard_normal((2, lines.size))
    channels = {"sensors": ["s1"], "actuators": ["a1"], "quantity": "accelerance"}
    frf = resonance + noise[0] + 1j * noise[1]
    modes = bp.identify(bp.Measurement.from_arrays(frf, lines, **channels))
    assert modes.natural_frequency.size == 1
    assert abs(modes.natural_frequency[0] - 100) < 5 * modes.deviation[0, 0]


def test_a_channel_that_reads_nothing_is_refused():
    whole = measured(seed=8)
    dead = whole.frf.copy()
    dead[1] = 0.0
    with pytest.raises(InputError, match="zero at all lines"):
        bp.identify(dataclasses.replace(whole, frf=dead))


def test_few_lines_are_refused():
    with pytest.raises(InputError, match="6 lines about the peak"):
        bp.identify(measured(seed=7, lines=np.arange(162.0, 174.0, 2.2), noise=1e-4))


def test_real_frequencies_of_a_free_beam(shared_data):
    path = shared_data / "measured/free_free_beam/measured.uff"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IdentificationWarning)
        modes = bp.identify(bp.io.uff.read(path, require_positions=False))
    known = [51.5, 142.18, 278.67, 460.39, 687.17, 958.53]
    np.testing.assert_allclose(modes.natural_frequency, known, rtol=5e-4)


@pytest.mark.long
def test_real_frequencies_of_a_plane(shared_data):
    """All peaks but those of 87.85 and 135.3 Hz, which rise too little; 125.2 and 125.6 are one."""
    with np.load(shared_data / "measured/plane/measured.npz") as file:
        arrays = dict(file)
    frf = arrays["frf"][:, ::3]
    measurement = bp.Measurement.from_arrays(
        frf,
        arrays["frequency_hz"],
        sensors=["wing", "tail", "fin"],
        actuators=[f"h{number}" for number in range(frf.shape[1])],
        quantity="accelerance",
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IdentificationWarning)
        modes = bp.identify(measurement.band(10, 180), shapes_at="actuators")
    known = [18.84, 40.12, 89.65, 97.07, 105.2, 118.0, 125.4, 129.9, 143.4, 166.3]
    np.testing.assert_allclose(modes.natural_frequency, known, rtol=2e-3)
    assert np.isfinite(modes.shape).all()
