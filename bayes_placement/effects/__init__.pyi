from ._effect import (
    Attachment,
    CubicAttachment,
    Effect,
    GlobalChange,
    Hinged,
    InstrumentEffect,
    Modulus,
)
from ._library import library
from .axial_preload import axial_preload
from .compliant_support import compliant_support
from .cubic_stiffness import cubic_stiffness
from .gain_error import gain_error
from .ground_dashpot import ground_dashpot
from .ground_spring import ground_spring
from .hysteretic_damping import hysteretic_damping
from .local_stiffness_loss import local_stiffness_loss
from .member_preload import member_preload
from .misplaced_sensor import misplaced_sensor
from .mount_resonance import mount_resonance
from .point_mass import point_mass
from .region_stiffness_loss import region_stiffness_loss
from .residual_modes import residual_modes
from .sensor_mass import sensor_mass
from .shear_and_rotary_inertia import shear_and_rotary_inertia
from .soft_support import soft_support
from .time_delay import time_delay
from .tuned_absorber import tuned_absorber
from .viscoelastic_modulus import viscoelastic_modulus

__all__ = [
    "Attachment",
    "CubicAttachment",
    "Effect",
    "GlobalChange",
    "Hinged",
    "InstrumentEffect",
    "Modulus",
    "axial_preload",
    "compliant_support",
    "cubic_stiffness",
    "gain_error",
    "ground_dashpot",
    "ground_spring",
    "hysteretic_damping",
    "library",
    "local_stiffness_loss",
    "member_preload",
    "misplaced_sensor",
    "mount_resonance",
    "point_mass",
    "region_stiffness_loss",
    "residual_modes",
    "sensor_mass",
    "shear_and_rotary_inertia",
    "soft_support",
    "time_delay",
    "tuned_absorber",
    "viscoelastic_modulus",
]
