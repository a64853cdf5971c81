"""What a run leaves for figures and reports: draws, fits, positions and mode shapes as arrays."""
