"""The bar of hidden_effect.py from the time records of a hammer test.

Seven hits are in one record of force and accelerations, `hammer_test.wav`, simulated by
hammer_test_measurement.py, which shares no code with this package. The hammer hit twice in one of
them. FRFs and the variance of each of their lines follow from the six others.
`bayes-placement improve models/hammer_test.py` finds the clamp.
"""

from pathlib import Path

import bayes_placement as bp

try:
    from models import hidden_effect
except ImportError:  # run by its path, this folder is searched instead of the one above it
    import hidden_effect

CHANNELS = {
    "a1": bp.time_records.Signal("channel 1", "10 V", sensitivity="20 mV/N"),
    "s1": bp.time_records.Signal("channel 2", "10 V", sensitivity="50 mV/(m/s^2)"),
    "s2": bp.time_records.Signal("channel 3", "10 V", sensitivity="50 mV/(m/s^2)"),
    "s3": bp.time_records.Signal("channel 4", "10 V", sensitivity="50 mV/(m/s^2)"),
}
"""What each channel is: a WAV file holds shares of its range, here 10 V."""

recording = bp.time_records.read(Path(__file__).with_name("hammer_test.wav"), CHANNELS)
estimate = bp.time_records.frf_of(
    recording,
    "a1",
    excitation=bp.time_records.Impacts(duration=0.25, before=0.008),
    band=(20.0, 1000.0),
)
measurement = estimate.measurement

experiment = bp.Experiment(
    hidden_effect.bar(),
    sensors=[bp.Sensor(name, at=hidden_effect.at(name)) for name in ("s1", "s2", "s3")],
    actuators=[bp.Actuator("a1", at=hidden_effect.at("a1"))],
    frequency=measurement.frequency,
    observe=bp.observe.Complex("acceleration"),
    noise=bp.noise.FromVariance(),
)

truth = hidden_effect.truth
