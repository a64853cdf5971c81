"""What models predict: of a ledger, or by their names."""

from collections.abc import Mapping
from typing import TypeAlias

import xarray as xr

from ..criticism.missing.ledger import Ledger

Fits: TypeAlias = Ledger | Mapping[str, xr.Dataset]
"""A ledger, or what its models predict by their names."""


def fits_of(result: Fits) -> Mapping[str, xr.Dataset]:
    """What models predict, by their names."""
    return result.fits if isinstance(result, Ledger) else result
