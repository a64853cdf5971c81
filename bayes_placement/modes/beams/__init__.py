"""Modes of uniform bars and Euler-Bernoulli beams in closed form."""

from .beams import UniformBar, UniformBeam, bar, beam

__all__ = ["UniformBar", "UniformBeam", "bar", "beam"]
