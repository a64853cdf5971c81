"""Model files for the command line, as small as can be."""

EXPERIMENT = """
import numpyro.distributions as dist
import bayes_placement as bp

modes = bp.beams.bar(3, length=1.0, area=1e-3, youngs_modulus=1e9, density=9000.0)
experiment = bp.Experiment(
    bp.Structure(modes, damping=bp.damping.Modal([dist.Uniform(0.02, 0.06)])),
    sensors=[bp.Sensor("s1", at=bp.positions.Segment(0.25, within=0.04))],
    actuators=[bp.Actuator("a1", at=0.3)],
    frequency=[150.0, 166.0],
    observe=bp.observe.LogAmplitude("velocity"),
    noise=bp.noise.Gaussian(0.05),
)
"""
