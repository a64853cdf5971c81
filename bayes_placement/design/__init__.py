"""design: in, an experiment; out, where its sensors and actuators had best sit.

Not known here: how information is estimated, measurements.
"""
