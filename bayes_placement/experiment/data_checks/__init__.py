"""data_checks: what is wrong with a measurement before any inference."""

from .check_data import CHECKS, DataCheck, DataChecks, check_data

__all__ = ["CHECKS", "DataCheck", "DataChecks", "check_data"]
