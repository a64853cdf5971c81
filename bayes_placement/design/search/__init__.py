"""Strategies to search for the best placement, one a file."""
