"""Modes of a structure from its mode shapes at the nodes of a finite element model."""

import itertools
from collections.abc import Mapping, Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Inexact

from ..._shared.arguments import arguments_checked, check_positive
from ..._shared.compiled import of_jax
from ..._shared.dimensions import Parameter
from ..._shared.errors import InputError
from ..._shared.ranges import POSITIVE
from ..._shared.sites import is_open, unit
from ...positions.places import Place, mean
from ...positions.tolerances import Box, Tolerance
from ...positions.vectors import CartesianComponents, triple
from ..modes import Modes, moved_mass
from ._part_factors import NamedMatrices, checked_cell_masses
from .interpolation import Interpolation
from .modal_model import ModalModel
from .static_shapes import StaticShapes, no_static_shapes

Corners = tuple[CartesianComponents, CartesianComponents]
Between = Float[Array, "axis axis"] | None

Point = Float[Array, "3"]


class NodalModes(Modes):
    """Modes known at nodes, from a finite element code; made by `modes_from_shapes`.

    Young's modulus and density scale the stiffness and the mass of the entire structure: shapes
    stay, natural frequencies are multiplied by the root of their ratio.

    Examples
    --------
    >>> np.asarray(plate.natural_frequency), plate.bounds()
    (array([120., 300.]), ((0.0, 0.0, 0.0), (1.0, 0.8, 0.0)))
    """

    interpolation: Interpolation = eqx.field(repr=False)
    shape: Inexact[Array, "row mode"]
    eigenvalues: Float[np.ndarray, "mode"] = eqx.field(repr=False)
    flexibility: Float[Array, "row row"] | None = eqx.field(repr=False)
    youngs_modulus: Parameter = eqx.field(metadata=unit("Pa", within=POSITIVE))
    density: Parameter = eqx.field(metadata=unit("kg/m3", within=POSITIVE))
    regions: NamedMatrices
    cell_masses: Float[np.ndarray, "cell mode mode"] = eqx.field(repr=False)
    members: NamedMatrices
    static_shapes: StaticShapes = eqx.field(repr=False)
    nominal: tuple[float, float] = eqx.field(static=True, repr=False)
    mass: float = eqx.field(static=True, metadata=unit("kg"))
    extent: Corners = eqx.field(static=True, repr=False)
    pieces: tuple[Tolerance, ...] = eqx.field(static=True, repr=False)
    centres: tuple[tuple[str, CartesianComponents], ...] = eqx.field(static=True, repr=False)
    axes: tuple[int, ...] = eqx.field(static=True, repr=False)
    rigid_body_modes: int = eqx.field(static=True, repr=False)

    def stiffness_scale(self) -> Float[Array, ""]:
        """Stiffness over that of the given model [1]."""
        return jnp.asarray(self.youngs_modulus, float) / self.nominal[0]

    def mass_scale(self) -> Float[Array, ""]:
        """Mass over that of the given model [1]."""
        return jnp.asarray(self.density, float) / self.nominal[1]

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies [rad/s]."""
        return jnp.sqrt(self.eigenvalues) * jnp.sqrt(self.stiffness_scale() / self.mass_scale())

    def shapes(self, position: Point, derivative: int = 0) -> Float[Array, "axis mode"]:
        """Mass-normalised mode shapes [kg^-1/2].

        Raises
        ------
        InputError
            For a derivative, which no effect on a structure in space needs.
        """
        if derivative:
            raise InputError(
                f"The derivative of order {derivative} of nodal mode shapes was asked for; only "
                "the shapes themselves are known everywhere on a structure in space. Use "
                "jax.jacfwd(modes.shapes)."
            )
        reading = self.interpolation.at(position)
        return reading.weight @ self.shape[reading.rows] / jnp.sqrt(self.mass_scale())

    def static_flexibility(
        self, position: Point, other: Point, orders: tuple[int, int] = (0, 0)
    ) -> Between:
        """Static flexibility [m/N] of all elastic modes; None without stiffness matrix."""
        if self.flexibility is None:
            return None
        response, reference = self.interpolation.at(position), self.interpolation.at(other)
        between = self.flexibility[response.rows[:, None], reference.rows]
        return response.weight @ between @ reference.weight.T / self.stiffness_scale()

    def bounds(self) -> Corners:
        """Return the least and the greatest coordinates [m]."""
        return self.extent

    def anywhere(self) -> list[Place]:
        """Return the uniform distribution of a position on each member or surface [m]."""
        return [piece.on(self.extent) for piece in self.pieces]


class DerivedNodalModes(Modes):
    """Modes derived from those of a model: they extend as far as these.

    Examples
    --------
    >>> issubclass(bp.finite_elements.UnknownModes, bp.finite_elements.DerivedNodalModes)
    True
    """

    nodal: eqx.AbstractVar[NodalModes]

    def bounds(self) -> Corners:
        """Return the least and the greatest coordinates [m]."""
        return self.nodal.bounds()

    def anywhere(self) -> list[Place]:
        """Return the uniform distribution of a position on each member or surface [m]."""
        return self.nodal.anywhere()


class UnknownModes(DerivedNodalModes):
    """Modes of known shapes, each natural frequency and modal mass a number or a distribution.

    For models that give shapes only, or whose frequencies are not to be trusted. Numbers count the
    elastic modes from 1 and belong to the shapes: where distributions overlap, natural frequencies
    may cross, and each shape keeps its damping ratio. Rigid-body modes stay as they are.

    Parameters
    ----------
    nodal
        The shapes; the natural frequencies of elastic modes are not used.
    frequency
        Natural frequency of each elastic mode [Hz], in ascending order of their means.
    modal_mass
        Modal mass [kg] of the shape of each elastic mode as it is scaled in `nodal`; by default
        1, for mass-normalised shapes.

    Raises
    ------
    InputError
        If there is not one of each for every elastic mode, or they are not in order.

    Examples
    --------
    >>> guessed = [dist.Normal(120.0, 2.0), dist.Normal(300.0, 5.0)]
    >>> free = bp.finite_elements.UnknownModes(plate, frequency=guessed)
    >>> bp.Structure(free, damping=bp.damping.Modal(0.02))
    Structure: UnknownModes, Modal damping
    """

    nodal: NodalModes
    frequency: tuple[Parameter, ...] = eqx.field(metadata=unit("Hz"))
    modal_mass: tuple[Parameter, ...] = eqx.field(metadata=unit("kg", within=POSITIVE))
    axes: tuple[int, ...] = eqx.field(static=True, repr=False)
    rigid_body_modes: int = eqx.field(static=True, repr=False)

    @arguments_checked
    def __init__(
        self,
        nodal: NodalModes,
        *,
        frequency: Sequence[Parameter],
        modal_mass: Sequence[Parameter] | None = None,
    ):
        self.nodal, self.axes = nodal, nodal.axes
        self.rigid_body_modes = nodal.rigid_body_modes
        count = nodal.shape.shape[1] - self.rigid_body_modes
        self.frequency = tuple(frequency)
        self.modal_mass = (1.0,) * count if modal_mass is None else tuple(modal_mass)
        if not len(self.frequency) == len(self.modal_mass) == count:
            raise InputError(
                f"UnknownModes was given {len(self.frequency)} natural frequencies and "
                f"{len(self.modal_mass)} modal masses for {count} elastic mode shapes; one of each "
                "is needed for every shape. Keep fewer shapes with model.count(...)."
            )
        for value in (*self.frequency, *self.modal_mass):
            if not is_open(value):
                check_positive("a frequency or a modal mass", value, "frequency=[110.0, 310.0]")
        _check_order([mean(value) for value in self.frequency])

    def angular_frequency(self) -> Float[Array, "mode"]:
        """Natural angular frequencies [rad/s], in the order of the shapes."""
        rigid = jnp.zeros(self.rigid_body_modes)
        return jnp.concatenate([rigid, 2 * jnp.pi * _stacked(self.frequency)])

    def shapes(self, position: Point, derivative: int = 0) -> Float[Array, "axis mode"]:
        """Mode shapes over the roots of their modal masses [kg^-1/2]."""
        return self.nodal.shapes(position, derivative) / jnp.sqrt(self.masses())

    def masses(self) -> Float[Array, "mode"]:
        """Modal masses [kg], 1 for rigid-body modes."""
        return jnp.concatenate([jnp.ones(self.rigid_body_modes), _stacked(self.modal_mass)])

    def static_flexibility(
        self, position: Point, other: Point, orders: tuple[int, int] = (0, 0)
    ) -> None:
        """Unknown, since other modes are; see `effects.residual_modes`."""
        return


@arguments_checked
def modes_from_shapes(
    model: ModalModel,
    interpolation: Interpolation,
    *,
    pieces: Sequence[Tolerance] = (),
    youngs_modulus: Parameter = 1.0,
    density: Parameter = 1.0,
    nominal: tuple[float, float] = (1.0, 1.0),
    flexibility: Float[np.ndarray, "row row"] | None = None,
    regions: Mapping[str, np.ndarray] | None = None,
    cell_masses: Float[np.ndarray, "cell mode mode"] | None = None,
    members: Mapping[str, np.ndarray] | None = None,
    centres: Mapping[str, CartesianComponents] | None = None,
    static_shapes: StaticShapes | None = None,
    mass: float | None = None,
) -> NodalModes:
    """Modes of a structure from its mode shapes at nodes.

    Parameters
    ----------
    model
        Nodes, mass-normalised shapes, natural frequencies.
    interpolation
        How shapes are read between nodes, for example `interpolation.scattered(model)`. Only the
        rows that it reads are kept.
    pieces
        Members and surfaces of the structure, `positions.Member` or `positions.Patch`: where
        effects may sit. By default the box around all nodes, read at the closest position.
    youngs_modulus, density
        Young's modulus [Pa] and density [kg/m3] of the entire structure, numbers or distributions;
        by default relative to the model [1].
    nominal
        Their values in the given model.
    flexibility
        Static flexibility [m/N] between the rows that the interpolation reads, of all elastic
        modes; None if not known, which leaves a plain modal sum.
    regions
        Stiffness [(rad/s)^2] of each region over the modes, by name.
    cell_masses
        Mass [1] of each cell of nodes over the modes; by default all is one cell.
    members
        Geometric stiffness [(rad/s)^2 / N] of each member under a unit tension over the modes.
    centres
        Centres of regions, members and soft supports [m], by name, for figures.
    static_shapes
        Static shapes of the flexible parts; None if they are not known.
    mass
        Mass of the structure [kg]; by default estimated from its modes.

    Returns
    -------
    NodalModes
        Modes of a structure.

    Raises
    ------
    InputError
        If the interpolation reads rows that the model does not have.

    Examples
    --------
    >>> across = bp.finite_elements.interpolation.scattered(plane, axes=(3,))
    >>> plate = bp.finite_elements.modes_from_shapes(plane, across)
    >>> bp.Structure(plate, damping=bp.damping.Modal([0.02, 0.03]))
    Structure: NodalModes, Modal damping
    """
    _check_scales(youngs_modulus, density, nominal, mass)
    rows = interpolation.used_rows()
    if len(rows) and rows[-1] >= len(model.dof):
        raise InputError(
            f"The interpolation reads row {rows[-1]}, but the model has {len(model.dof)} degrees "
            "of freedom. Build it from the same model: interpolation.scattered(model)."
        )
    _check_flexibility(flexibility, len(rows))
    shape = jnp.asarray(model.shape[rows])
    count = shape.shape[1]
    extent = triple(model.position.min(axis=0)), triple(model.position.max(axis=0))
    return NodalModes(
        interpolation=interpolation.renumbered(rows),
        shape=shape,
        eigenvalues=np.asarray((2 * np.pi * model.natural_frequency) ** 2, dtype=float),
        flexibility=of_jax(flexibility),
        youngs_modulus=youngs_modulus,
        density=density,
        regions=NamedMatrices.of(regions or {}, count),
        cell_masses=checked_cell_masses(cell_masses, count),
        members=NamedMatrices.of(members or {}, count),
        static_shapes=of_jax(static_shapes or no_static_shapes(*shape.shape)),
        nominal=nominal,
        mass=mass or _mass(model, rows),
        extent=extent,
        pieces=tuple(pieces) or (_box_about(extent),),
        centres=tuple((centres or {}).items()),
        axes=interpolation.axes,
        rigid_body_modes=model.rigid_body_modes,
    )


def nodal_of(modes: Modes) -> NodalModes | None:
    """Return the modes of a model, or those beneath derived ones; None if there are none."""
    if isinstance(modes, DerivedNodalModes):
        return modes.nodal
    return modes if isinstance(modes, NodalModes) else None


def _check_scales(
    youngs_modulus: Parameter, density: Parameter, nominal: tuple[float, float], mass: float | None
) -> None:
    """Refuse numbers that are no single ones above zero; distributions are checked with priors."""
    numbers = {"youngs_modulus": youngs_modulus, "density": density, "mass": mass or None}
    numbers |= {f"nominal[{place}]": value for place, value in enumerate(nominal)}
    for name, value in numbers.items():
        if value is not None and not is_open(value):
            check_positive(name, value, f"modes_from_shapes(..., {name.partition('[')[0]}=...)")


def _check_flexibility(flexibility: np.ndarray | None, rows: int) -> None:
    """Refuse a flexibility of other rows than those that are read."""
    if flexibility is not None and np.shape(flexibility) != (rows, rows):
        raise InputError(
            f"flexibility of shape {np.shape(flexibility)} was given; {rows} rows and columns "
            "are needed, one for each row that the interpolation reads: flexibility["
            "np.ix_(rows, rows)] with rows = interpolation.used_rows()."
        )


def _stacked(values: tuple[Parameter, ...]) -> Float[Array, "mode"]:
    return jnp.stack([jnp.asarray(value, float) for value in values])


def _check_order(frequency: Sequence[float]) -> None:
    for number, (lower, upper) in enumerate(itertools.pairwise(frequency), start=1):
        if lower > upper:
            raise InputError(
                f"UnknownModes was given mode {number} at {lower:g} Hz and mode {number + 1} at "
                f"{upper:g} Hz; means that ascend are needed, since shapes and damping ratios are "
                "counted so. Sort them together with the columns of the shapes."
            )


def _box_about(extent: Corners) -> Box:
    low, high = np.array(extent)
    return Box(tuple((low + high) / 2), within=tuple((high - low) / 2))


def _mass(model: ModalModel, rows: np.ndarray) -> float:
    """Mass that the modes move [kg], as if each place moved alike along every axis that is read."""
    translations = rows[model.dof[rows, 1] <= 3]
    axes, shape = len(np.unique(model.dof[translations, 1])), model.shape[translations]
    # Shapes are large: their squares are added without a further array.
    return moved_mass(axes * np.einsum("rm,rm->m", shape, shape, dtype=float)[None] / len(shape))
