"""A law that is known line by line: measured, or from a catalogue."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from .._shared.arguments import as_array, shown
from .._shared.dimensions import Parameter
from .._shared.errors import InputError
from .._shared.sites import unit
from .law import Element, Omega, Scaled, Stiffness

if TYPE_CHECKING:
    import pandas as pd

ALIKE = 1e-6
"""Relative difference of two lines that are one: files hold seven digits."""

COMPLIANCES = ("m/N", "rad/(N m)")
"""Units of tables of a compliance, as a law in a cut is measured."""


def _lines(values: object) -> tuple[float, ...]:
    return tuple(_row("frequency", values, "iuf").astype(float).tolist())


def _complex_numbers(values: object) -> tuple[complex, ...]:
    return tuple(_row("stiffness", values, "iufc").astype(complex).tolist())


def _row(name: str, values: object, kinds: str) -> np.ndarray:
    """Values as an array of one axis."""
    array = as_array(values)
    if array.dtype.kind not in kinds or array.ndim != 1:
        raise InputError(
            f"{name}={shown(values)} was given; a list of numbers is needed, since a table has one "
            "for each line: effects.Tabulated([10.0, 100.0], [1e4 + 5e2j, 1.1e4 + 2e3j])."
        )
    return array


class Tabulated(Element):
    """A dynamic stiffness in a table, times a strength that may be unknown.

    Between lines real and imaginary part are linear in the logarithm of frequency: a mean of two
    passive values is passive, and nothing overshoots. Lines of an experiment must lie within the
    table. What is evaluated elsewhere all the same, such as lines that drift, has the value of the
    nearest end; off the frequency axis, as of an exponential window, that of the same frequency.

    Parameters
    ----------
    frequency
        Lines [Hz], ascending.
    stiffness
        Complex dynamic stiffness at each line [N/m], of a rotation [N m/rad].
    strength
        Factor on the table [1].

    Raises
    ------
    InputError
        If there are fewer than two lines, they do not ascend, or a value is missing.

    Examples
    --------
    >>> mount = bp.effects.Tabulated([10.0, 100.0, 1000.0], [1e4 + 5e2j, 1.1e4 + 2e3j, 2e4 + 9e3j])
    >>> softer_or_stiffer = dist.LogUniform(0.5, 2.0) * mount
    >>> mount
    Tabulated(3 lines, 10 to 1000 Hz)
    """

    letter: ClassVar[str] = "t"
    symbols: ClassVar[tuple[str, ...]] = ("lambda",)
    formula: ClassVar[str] = r"{0} Z(\omega)"
    frequency: Sequence[float] = eqx.field(static=True, converter=_lines)
    stiffness: Sequence[complex] = eqx.field(static=True, converter=_complex_numbers)
    strength: Parameter = eqx.field(metadata=unit("1"), default=1.0)

    def __check_init__(self) -> None:
        lines, values = np.array(self.frequency), np.array(self.stiffness)
        ascend = lines.size > 1 and lines[0] > 0 and np.all(np.diff(lines) > 0)
        if not (ascend and lines.shape == values.shape and np.isfinite([lines, values]).all()):
            raise InputError(
                f"{lines.size} lines with {values.size} values were given as a table; two lines or "
                "more are needed [Hz], above zero and ascending, each with a finite complex "
                "stiffness, since what is between them is interpolated: "
                "effects.Tabulated([10.0, 100.0], [1e4 + 5e2j, 1.1e4 + 2e3j])."
            )

    @classmethod
    def from_table(cls, table: "pd.DataFrame") -> "Tabulated":
        """Return the law of a table such as `Reach.law_as_measured` gives.

        Parameters
        ----------
        table
            Columns `frequency` [Hz], `real` and `imaginary`, and perhaps `unit`, by which a
            compliance (m/N, rad/(N m)) is told from a dynamic stiffness; without it is one.

        Raises
        ------
        InputError
            If a column is missing, or the lines are no table.

        Examples
        --------
        >>> table = pd.DataFrame({"frequency": [5.0, 9.0], "real": [1.0, 2.0], "imaginary": 0.5})
        >>> bp.effects.Tabulated.from_table(table.assign(unit="m/N")).stiffness[0]
        (0.8-0.4j)
        """
        missing = [name for name in ("frequency", "real", "imaginary") if name not in table]
        if missing:
            raise InputError(
                f"A table without the column {missing[0]} was given; frequency [Hz], real and "
                "imaginary are needed, since they are the law: "
                "table.rename(columns={'f': 'frequency'})."
            )
        values = table["real"].to_numpy(float) + 1j * table["imaginary"].to_numpy(float)
        is_compliance = "unit" in table and table["unit"].isin(COMPLIANCES).all()
        with np.errstate(divide="ignore", invalid="ignore"):
            values = 1 / values if is_compliance else values
        return cls(table["frequency"].tolist(), values.tolist())

    def stiffness_at(self, omega: Omega) -> Stiffness:
        """Dynamic stiffness [N/m], between the lines linear in the logarithm of frequency."""
        real = jnp.real(omega)
        if not isinstance(real, jax.core.Tracer):
            self.check_lines(np.abs(real) / (2 * np.pi))
        logarithm = jnp.log(jnp.maximum(jnp.abs(real) / (2 * jnp.pi), self.frequency[0]))
        lines, values = np.log(self.frequency), np.array(self.stiffness)
        elastic, lossy = (jnp.interp(logarithm, lines, part) for part in (values.real, values.imag))
        return self.strength * (elastic + 1j * jnp.sign(real) * lossy)

    def check_lines(self, frequency: object) -> None:
        """Refuse lines that the table does not reach.

        Parameters
        ----------
        frequency
            Lines [Hz].

        Raises
        ------
        InputError
            If there is one.
        """
        needed = np.asarray(frequency, float)
        first, last = self.frequency[0], self.frequency[-1]
        outside = (needed < first * (1 - ALIKE)) | (needed > last * (1 + ALIKE))
        if outside.any():
            raise InputError(
                f"{self!r} was given; a table from {needed.min():g} to {needed.max():g} Hz is "
                "needed, since nothing is known of a law beyond its table: measure it there, or "
                "leave lines out, frequency=frequency[(frequency >= "
                f"{first:g}) & (frequency <= {last:g})]."
            )

    def __repr__(self) -> str:
        if not (isinstance(self.strength, float) and self.strength == 1.0):
            return repr(Scaled(Tabulated(self.frequency, self.stiffness), self.strength))
        first, last = self.frequency[0], self.frequency[-1]
        return f"Tabulated({len(self.frequency)} lines, {first:g} to {last:g} Hz)"


def tables_in(tree: object) -> list[Tabulated]:
    """Laws of a tree that are tables."""
    leaves = jax.tree.leaves(tree, is_leaf=lambda leaf: isinstance(leaf, Tabulated))
    return [leaf for leaf in leaves if isinstance(leaf, Tabulated)]
