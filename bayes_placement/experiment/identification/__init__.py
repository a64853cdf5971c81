"""Modal parameters from measured FRFs, without a model."""
