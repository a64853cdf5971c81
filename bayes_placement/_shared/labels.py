"""Names by which rooms find in labelled arrays what others have put there."""

FORCE_LEVEL = "force_level"
"""Dimension of the force amplitudes [N], which outputs have where the experiment states them."""

AS_DRAWN, AS_GIVEN = "as drawn", "as given"
"""Names of the model at recorded positions and means of priors, and of the same once fitted."""

ABOUT = "about"
"""Attribute of the findings of a run: words on it, as JSON."""
