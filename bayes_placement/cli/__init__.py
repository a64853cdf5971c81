"""Commands of `bayes-placement`, for engineers who write no Python."""
