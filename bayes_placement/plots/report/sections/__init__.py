"""Sections of a report, each made from what a run saved."""
