"""Instruments and effects of a run, one by one."""

import xarray as xr


def placed_items(places: xr.Dataset | None) -> list[xr.Dataset]:
    """Each instrument and effect; a sensor and an actuator may have one name."""
    if places is None:
        return []
    return [places.isel(item=number) for number in range(places.sizes["item"])]


def name_of(item: xr.Dataset) -> str:
    """Name of an instrument or an effect."""
    return str(item["item"].item())
