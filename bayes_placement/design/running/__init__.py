"""running: many placements in chunks, on several processes, kept in a folder."""
