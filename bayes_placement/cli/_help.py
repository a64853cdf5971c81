"""What `--help` shows below the options: examples, and effects by group."""

import re
from pathlib import Path


def examples(*lines: str) -> str:
    """List commands as they are typed, without the name of the program."""
    typed = [f"- `bayes-placement {line}`" for line in lines]
    return "\n".join(["Examples:", "", *typed, "", ""])


REGISTRY = Path(__file__).parents[1] / "effects" / "registry.py"
"""Names are read from it as text, since effects load JAX."""

GROUPS = {
    "attached": "point_mass segment_mass rotary_inertia eccentric_mass tuned_absorber "
    "ground_spring ground_dashpot rotational_spring strut foundation maxwell_mount "
    "fractional_mount damping_layer cubic_stiffness coulomb_friction gap",
    "structure": "local_stiffness_loss region_stiffness_loss hysteretic_damping "
    "viscoelastic_modulus axial_preload member_preload shear_and_rotary_inertia residual_modes "
    "further_mode dimension_error beyond_prior",
    "supports": "compliant_support soft_support",
    "sensors and actuators": "gain_error misplaced_sensor misplaced_actuator reversed_sensor "
    "reversed_channel swapped_sensors swapped_actuators sensor_mass actuator_mass stinger "
    "mount_resonance low_pass high_pass channel_delay cross_axis",
    "record": "time_delay exponential_window frequency_drift frequency_scale phase_drift mains_hum",
}
"""Names of effects by what they are part of."""

LAWS = {"attached", "inserted", "over", "modulus"}
"""They hold a law that is typed in Python, and no search suggests one."""


def effects_by_group() -> str:
    """List all effects that `--effects` takes, a line for each group."""
    names = re.findall(r"^from \.\w+ import \w+ as (\w+)$", REGISTRY.read_text(), re.MULTILINE)
    groups = {title: words.split() for title, words in GROUPS.items()}
    known = {name for words in groups.values() for name in words} | LAWS
    others = [name for name in names if name not in known]
    listed = groups | ({"others": others} if others else {})
    lines = [f"- {title}: {', '.join(words)}" for title, words in listed.items()]
    return "\n".join(["Effects:", "", *lines])
