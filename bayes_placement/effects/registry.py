"""Every effect of the package, one line each, in the order in which candidates are tried."""

# ruff: noqa: F401, I001
from .point_mass import point_mass
from .ground_spring import ground_spring
from .ground_dashpot import ground_dashpot
from .tuned_absorber import tuned_absorber
from .local_stiffness_loss import local_stiffness_loss
from .region_stiffness_loss import region_stiffness_loss
from .hysteretic_damping import hysteretic_damping
from .viscoelastic_modulus import viscoelastic_modulus
from .compliant_support import compliant_support
from .soft_support import soft_support
from .axial_preload import axial_preload
from .member_preload import member_preload
from .shear_and_rotary_inertia import shear_and_rotary_inertia
from .cubic_stiffness import cubic_stiffness
from .residual_modes import residual_modes
from .sensor_mass import sensor_mass
from .actuator_mass import actuator_mass
from .stinger import stinger
from .exponential_window import exponential_window
from .time_delay import time_delay
from .channel_delay import channel_delay
from .gain_error import gain_error
from .mount_resonance import mount_resonance
from .misplaced_sensor import misplaced_sensor
from .misplaced_actuator import misplaced_actuator
from .reversed_sensor import reversed_sensor
from .reversed_channel import reversed_channel
from .swapped_sensors import swapped_sensors
from .swapped_actuators import swapped_actuators
from .frequency_drift import frequency_drift
from .low_pass import low_pass
from .phase_drift import phase_drift
from .cross_axis import cross_axis
from .frequency_scale import frequency_scale
from .mains_hum import mains_hum
