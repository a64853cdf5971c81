"""Whether a fitted model explains the data, and where it fails."""
