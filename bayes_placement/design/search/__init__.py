"""search: ways to look for the best placement, one a file."""
