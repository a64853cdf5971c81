"""Placement integrated by a kernel density estimate, as in the paper."""

import equinox as eqx

from ..._shared.arguments import check_count, check_fields
from ..._shared.dimensions import Key
from ..._shared.errors import InputError
from ..._shared.sites import Unknown
from ...experiment.experiment import Experiment
from ...experiment.noise import Data
from ..engines.engine import Settings
from ..record import jax_key
from .kernel_density import KERNELS, KernelDensity
from .marginal import DrawPlacement, IntegratedModel, Marginal, Model, integrated


class KDE(Marginal):
    """Placement integrated by a kernel density estimate of z given h, Eqs. (29) and (31).

    A way to treat placement when data are inferred from; the estimator of expected information that
    uses the same kernels is `information.KernelGain`.

    Parameters
    ----------
    placement_draws
        Draws of the placement, n_sim,p of the paper.
    kernel
        `soize` (kernel centres shrunk so that the estimate keeps the variance of the draws) or
        `silverman`; one bandwidth for each component of z.
    noise_draws
        None: Gaussian kernel plus Gaussian noise in closed form. A number: Eq. (29) literally,
        by that many draws of the noise.
    common
        True: the same placement draws for every h, so that the likelihood is smooth in h. False:
        independent draws for every h, as in the paper's Table 1.

    Raises
    ------
    InputError
        If there is no such kernel, or there are fewer than two draws.

    Examples
    --------
    >>> bp.marginals.KDE(placement_draws=400, kernel="silverman").settings()["marginal_kernel"]
    'silverman'
    """

    samples_placement = False
    placement_draws: int = eqx.field(static=True, default=800)
    kernel: str = eqx.field(static=True, default="soize")
    noise_draws: int | None = eqx.field(static=True, default=None)
    common: bool = eqx.field(static=True, default=True)

    def __check_init__(self) -> None:
        check_fields(self)
        check_count("noise_draws", self.noise_draws or 1, 1, "marginals.KDE(noise_draws=10)")
        check_count(
            "placement_draws", self.placement_draws, 1, "marginals.KDE(placement_draws=800)"
        )
        if self.kernel not in KERNELS:
            raise InputError(
                f"marginals.KDE has no kernel {self.kernel!r}. The kernels are "
                f"{' and '.join(KERNELS)}: KDE(kernel='soize')."
            )
        if self.placement_draws < 2:
            raise InputError(
                f"marginals.KDE(placement_draws={self.placement_draws}) was given; a spread needs "
                "at least two draws, and an estimate hundreds: KDE(placement_draws=800)."
            )

    def integrates(self, unknown: Unknown) -> bool:
        """All placement is."""
        return unknown.is_of_transducer

    def _estimate(self, experiment: Experiment, data: Data, key: Key) -> KernelDensity:
        if not integrated(self, experiment):
            raise InputError(
                "marginals.KDE estimates the spread that unknown placement gives to z, but no "
                "position or angle is a distribution. Declare one, at=positions.Segment(0.25, "
                "within=0.04), or use marginals.Latent()."
            )
        return KernelDensity(
            data, jax_key(key), self.placement_draws, self.kernel, self.noise_draws, self.common
        )

    def model(self, experiment: Experiment, data: Data, key: Key) -> Model:
        """Return a model in which only parameters and output error are sampled."""
        estimate = self._estimate(experiment, data, key)
        return IntegratedModel(self, experiment, estimate)

    def placement(self, experiment: Experiment, data: Data, key: Key) -> DrawPlacement:
        """Draw placements in proportion to the share of their kernels in the likelihood."""
        return self._estimate(experiment, data, key).draw_placement

    def settings(self) -> Settings:
        """Name, sizes and options."""
        return {
            "marginal": "KDE",
            "marginal_placement_draws": self.placement_draws,
            "marginal_kernel": self.kernel,
            "marginal_noise_draws": self.noise_draws or 0,
            "marginal_common": int(self.common),
        }
