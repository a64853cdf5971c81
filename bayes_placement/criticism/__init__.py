"""criticism: where a fitted model fails, and which physical effect is missing."""
