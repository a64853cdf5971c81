"""Time records of force and motion as FRFs with coherence and variance."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "continuous": ["Continuous"],
        "estimate": ["Estimate", "EstimateWarning"],
        "estimation": ["frf", "frf_of"],
        "files": ["read"],
        "impacts": ["Impacts"],
        "merging": ["merged"],
        "recording": ["Recording", "Signal"],
    },
)
