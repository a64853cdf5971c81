"""Where a fitted model fails, and which physical effect it lacks."""
