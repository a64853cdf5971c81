"""A report to hand on: one HTML file that needs no network, and the same as JSON beside it."""

from .report import SECTIONS, Report
from .write import write_report

__all__ = ["SECTIONS", "Report", "write_report"]
