"""Computing information at many placements: in this process, in several, or on a cluster."""
