"""Lines of a group of close resonances, and the fit of poles to them.

FRFs of all pairs share the poles; residues and a cubic, which stands for all that resonates
elsewhere, are free in each pair. About a resonance an FRF of displacement, velocity or acceleration
is of this one form, and no power of i omega is needed.
"""

from typing import NamedTuple, TypeVar

import numpy as np
from jaxtyping import Complex, Float, Inexact
from numpy.polynomial import chebyshev
from scipy.special import chdtrc

ELSEWHERE = 3
"""Order of the polynomial that stands for resonances elsewhere."""

WEIGHTINGS = 6
"""Rounds of linear least squares, each weighted with the last denominator."""

MOST_EVALUATIONS = 60

ROUNDING = 1e-24
"""Share of the squares of FRFs that is rounding."""

Poles = Complex[np.ndarray, "pole"]
Lines = Complex[np.ndarray, "pair frequency"]
Place = TypeVar("Place", complex, Poles)


class Band(NamedTuple):
    """FRFs about some resonances."""

    frequency: Float[np.ndarray, "frequency"]
    """Lines [Hz]."""
    frf: Lines
    """FRFs, each over its standard deviation."""
    weight: Float[np.ndarray, "pair frequency"]
    """Inverse of the standard deviations."""
    is_known: bool
    """Whether these are known; else they are right up to one factor."""

    @property
    def middle(self) -> float:
        """Middle of the lines [Hz]."""
        return float(self.frequency[0] + self.frequency[-1]) / 2

    @property
    def half(self) -> float:
        """Half of the width [Hz]."""
        return float(self.frequency[-1] - self.frequency[0]) / 2

    @property
    def place(self) -> Float[np.ndarray, "frequency"]:
        """Lines over the band: from -1 to 1."""
        return (self.frequency - self.middle) / self.half

    def hertz(self, place: Place) -> Place:
        """Poles at places, over 2 pi i [Hz]: their sizes are the natural frequencies."""
        return self.middle + self.half * place


class PoleFit(NamedTuple):
    """Poles of greatest likelihood, and how errors of them and of the residues belong together.

    All errors are circular complex Gaussian: covariances are E[error conj(error)].
    """

    pole: Poles
    """Poles as places on the lines of the band, of a positive imaginary part where they decay."""
    covariance: Complex[np.ndarray, "pole pole"]
    """Covariance of their errors, if the noise is as stated."""
    residue: Complex[np.ndarray, "pair pole"]
    """Residues, in the unit of the FRFs times the half width."""
    variance: Float[np.ndarray, "pair pole"]
    """Variance of each residue, were the poles known."""
    slope: Complex[np.ndarray, "pair pole pole"]
    """Change of each residue (the first pole) with each pole (the second)."""
    squares: float
    """Sum of |residual|^2 over the variance of the noise."""
    data: int
    unknowns: int
    """Numbers of complex data, and of complex unknowns."""
    least_excess: float
    """Least scatter about the fit over the noise: 1 where the noise is known."""

    @property
    def excess(self) -> float:
        """Variance of the scatter about the fit over that of the noise."""
        return max(self.least_excess, self.squares / (self.data - self.unknowns))

    @property
    def probability(self) -> float:
        """Probability that noise as stated scatters as much."""
        freedom = 2 * (self.data - self.unknowns)
        return float(chdtrc(freedom, 2 * self.squares))

    @property
    def criterion(self) -> float:
        """Bayes information criterion, of noise of the factor that is most likely."""
        mean = self.squares / self.data
        factor = max(self.least_excess, mean)
        misfit = np.log(factor) + mean / factor
        return float(2 * self.data * misfit + 2 * self.unknowns * np.log(2 * self.data))


def fitted(band: Band, count: int) -> PoleFit:
    """Fit a number of poles by greatest likelihood, residues eliminated (Golub and Pereyra, 1973).

    Variable projection, doi:10.1137/0710036; with Kaufman's simpler derivative.
    """
    start = _start(band, count)

    def at(flat: Float[np.ndarray, "twice"]) -> "_Solved":
        return _solved(band, flat[:count] + 1j * flat[count:])

    from scipy.optimize import least_squares  # it takes long to import

    found = least_squares(
        lambda flat: _parts(at(flat).left),
        np.concatenate([start.real, start.imag]),
        lambda flat: np.concatenate([_parts(turn * at(flat).slopes()) for turn in (1, 1j)]).T,
        x_scale="jac",
        max_nfev=MOST_EVALUATIONS,
    )
    return at(found.x).fit()


def _parts(values: np.ndarray) -> np.ndarray:
    """Real parts beside imaginary ones; pairs and lines in one axis."""
    flat = values.reshape(*values.shape[:-2], -1)
    return np.concatenate([flat.real, flat.imag], axis=-1)


class _Solved(NamedTuple):
    """Residues and parabolas of least squares at given poles."""

    band: Band
    pole: Poles
    basis: Complex[np.ndarray, "pair frequency term"]
    triangle: Complex[np.ndarray, "pair term term"]
    terms: Complex[np.ndarray, "pair term"]
    left: Lines

    def _raw_slopes(self) -> Complex[np.ndarray, "pole pair frequency"]:
        """Change of the FRFs over their deviations with each pole."""
        steep = (self.band.place - self.pole[:, None]) ** -2.0
        return self.band.weight * self.terms.T[: self.pole.size, :, None] * steep[:, None]

    def slopes(self) -> Complex[np.ndarray, "pole pair frequency"]:
        """Change of what is left, residues following."""
        raw = self._raw_slopes()
        return np.stack([-_without(self.basis, slope) for slope in raw])

    def fit(self) -> PoleFit:
        """What follows of errors."""
        count = self.pole.size
        slopes = self.slopes().reshape(count, -1)
        inverse = np.linalg.inv(self.triangle)[:, :count]
        raw = np.moveaxis(self._raw_slopes(), 0, -1)
        return PoleFit(
            pole=self.pole,
            covariance=np.linalg.inv(slopes.conj() @ slopes.T),
            residue=self.terms[:, :count],
            variance=np.sum(np.abs(inverse) ** 2, axis=-1),
            slope=-inverse @ (_adjoint(self.basis) @ raw),
            squares=float(np.sum(np.abs(self.left) ** 2)),
            data=self.left.size,
            unknowns=count + self.terms.size,
            least_excess=1.0 if self.band.is_known else ROUNDING,
        )


def _solved(band: Band, pole: Poles) -> _Solved:
    powers = band.place[:, None] ** np.arange(ELSEWHERE + 1)
    design = np.concatenate([1 / (band.place[:, None] - pole), powers], axis=1)
    basis, triangle = np.linalg.qr(band.weight[..., None] * design)
    shares = _adjoint(basis) @ band.frf[..., None]
    terms = np.linalg.solve(triangle, shares)[..., 0]
    return _Solved(band, pole, basis, triangle, terms, _without(basis, band.frf))


def _without(basis: Inexact[np.ndarray, "pair frequency term"], values: Lines) -> Lines:
    """Values less what a basis explains of them."""
    return np.asarray(values - (basis @ (_adjoint(basis) @ values[..., None]))[..., 0])


def _adjoint(matrices: np.ndarray) -> np.ndarray:
    return matrices.conj().swapaxes(-1, -2)


def _start(band: Band, count: int) -> Poles:
    """Poles of a common denominator by linear least squares that are weighted with the last one.

    Sanathanan and Koerner, 1963, doi:10.1109/TAC.1963.1105517, with Chebyshev polynomials.
    """
    powers = chebyshev.chebvander(band.place, count + ELSEWHERE)
    size = np.ones(band.frequency.size)
    for _ in range(WEIGHTINGS):
        basis = np.linalg.qr((band.weight / size)[..., None] * powers)[0]
        left = [_without(basis, band.frf / size * power) for power in powers[:, : count + 1].T]
        columns = np.reshape(left, (count + 1, -1))
        lower = np.linalg.lstsq(columns[:-1].T, -columns[-1], rcond=None)[0]
        denominator = np.append(lower, 1.0)
        size = np.abs(powers[:, : count + 1] @ denominator)
        size = size + 1e-9 * size.max()
    return np.asarray(chebyshev.chebroots(denominator))
