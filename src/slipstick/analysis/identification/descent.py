"""Least squares from one start, and with weights from the noise of an earlier fit."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.identification.fit_request import FitRequest
from slipstick.analysis.identification.noise import Noise, found_noise, given_noise, too_large
from slipstick.analysis.identification.predicted import Predictor
from slipstick.errors import InputError
from slipstick.typing import Array

_TOLERANCE = {"xtol": 1e-13, "ftol": 1e-15, "gtol": 1e-15}
_TOLERANCE_IN_TIME = {"xtol": 1e-8, "ftol": 1e-10, "gtol": 1e-12}
"""Tolerances of least squares, the second for motions that are integrated."""
_CHOICES = 5
"""Largest number of descents, each with the motions nearest to the measurement at the last parameters."""
FAR = 0.1
"""Misfit above which a fit ended far from the measurement."""
_LEAST_NOISE = 2e-4
"""Misfit below which residuals are errors of the model and its harmonics, and give no weights."""
_WEIGHTED = 8
"""Largest number of reweighted fits."""
_SAME_NOISE = 1e-2
"""Relative change of the noise, below which the weights are final."""


class End(NamedTuple):
    """The end of a descent."""

    p: Array
    cost: float
    left: Array
    """Weighted residuals (m,)."""
    J: Array
    """Their derivatives by the parameters (m, n_p)."""
    at_bound: NDArray[np.bool_]
    converged: bool
    predicted: Array
    evaluations: int
    predictor: Predictor
    misfit: float
    """Root mean square of the residuals over that of the measurement."""

    @property
    def far(self) -> bool:
        """Whether it is far from the measurement; a misfit that is no number is."""
        return not self.misfit <= FAR


class Descent:
    """Least squares from one start."""

    def __init__(
        self,
        request: FitRequest,
        start: Array,
        predictor: Predictor | None = None,
        *,
        most: int | None = None,
        place: int | None = None,
    ) -> None:
        self.place = place
        self.request, self.start, self.predictor = request, start, predictor or request.predictor()
        self.most = most or request.most
        self.unit = np.where(start != 0.0, np.abs(start), 1.0)
        self.evaluations = 0
        self.latest: tuple[Array, Array] | None = None
        self.step: End | None = None
        """The last accepted step, in the form of an end."""

    def run(self) -> End:
        """Descend with renewed choices of motions until they stay the same.

        After a bad end, a second descent gives less weight to points far from the measurement: at the start, the
        measured motion may not exist there. The full weights follow from the parameters that it finds.
        """
        best = self.choose_and_descend(self.start)
        if best.misfit > 2.0 * FAR and not self.request.measured.in_time:
            far = self.request.predictor()
            other = Descent(self.request, self.start, far, place=self.place)
            near = other.choose_and_descend(self.start, loss="cauchy")
            if np.isfinite(near.cost):
                near = other.choose_and_descend(near.p)
                near = near._replace(evaluations=best.evaluations + near.evaluations)
                best = min(best, near, key=lambda end: end.cost)
        return best

    def choose_and_descend(self, p: Array, loss: str = "linear") -> End:
        """Descend from parameters with renewed choices of motions until they stay the same."""
        best = None
        for _ in range(_CHOICES):
            if not self.predictor.begin(p) and best is not None:
                break
            end = self.descend(p, loss)
            if best is not None and loss == "linear" and not end.cost < best.cost * (1.0 - 1e-9):
                break
            best, p = end, end.p
            if not np.isfinite(end.cost):
                break
        assert best is not None
        return best

    def descend(self, start: Array, loss: str) -> End:
        """Descend from parameters with the present choice of motions."""
        from scipy.optimize import least_squares

        request, unit = self.request, self.unit
        first = self.left(start / unit)
        if not np.all(np.isfinite(first)):
            empty = np.full((first.size, start.size), np.nan)
            none = np.zeros(start.size, dtype=bool)
            return End(
                p=start, cost=np.inf, left=first, J=empty, at_bound=none, converged=False,
                predicted=request.measured.values, evaluations=self.evaluations, predictor=self.predictor,
                misfit=np.inf,
            )  # fmt: skip
        found = least_squares(
            self.left, start / unit, jac=self._slopes, bounds=(request.low / unit, request.high / unit),
            max_nfev=self.most, loss=loss, f_scale=max(float(np.median(np.abs(first))), 1e-9),
            **(_TOLERANCE_IN_TIME if request.measured.in_time else _TOLERANCE),
        )  # fmt: skip
        self._slopes(found.x)
        assert self.step is not None
        return self.step._replace(at_bound=found.active_mask != 0, converged=found.status > 0)

    def left(self, z: Array) -> Array:
        """Residuals over the noise; nan where there is no motion, so that least squares takes a smaller step."""
        request = self.request
        if self.latest is None or not np.array_equal(self.latest[0], z):
            self.evaluations += 1
            request.tell(self.place, self.evaluations)
            try:
                predicted = self.predictor.values(z * self.unit)
            except InputError:  # values that the problem cannot have
                predicted = np.full(request.measured.values.shape, np.nan)
            self.latest = z.copy(), predicted
        return request.left(self.latest[1])

    def _slopes(self, z: Array) -> Array:
        """Derivatives of the residuals, which least squares evaluates at accepted steps."""
        request, left = self.request, self.left(z)
        assert self.latest is not None
        rates = self.predictor.slopes(z * self.unit)[:, request.used]
        J = np.asarray((rates / request.scale).T * self.unit)
        p = z * self.unit
        self.step = End(
            p=p, cost=float(left @ left), left=left, J=J / self.unit, at_bound=(p <= request.low) | (p >= request.high),
            converged=False, predicted=self.latest[1], evaluations=self.evaluations, predictor=self.predictor,
            misfit=request.misfit(left),
        )  # fmt: skip
        if not request.kept or request.kept[0][0] is not request or self.step.cost < request.kept[0][1].cost:
            request.kept[:] = [(request, self.step)]
        return J


def explained(request: FitRequest, end: End) -> bool:
    """Whether the given noise explains the residuals."""
    freedom = end.left.size - len(request.names)
    known = request.known and freedom > 0 and bool(np.isfinite(end.cost))
    return known and not too_large(end.cost / freedom, freedom)


def weighted(request: FitRequest, end: End) -> tuple[FitRequest, End, Noise | None]:
    """The fit with weights from noise that depends on it: given relative noise, or noise found in the residuals."""
    weights: Noise | None = None
    if not request.relative and (request.known or not _LEAST_NOISE < end.misfit < FAR):
        return request, end, None  # given noise of each number, or residuals that are not noise
    for _ in range(_WEIGHTED):
        if request.relative:
            noise: Noise | None = given_noise(request.measured, end.predicted, request.absolute, request.relative)
        else:
            left, J = end.left * request.scale, end.J * request.scale[:, None]
            noise = found_noise(request.measured, end.predicted, left, J, request.used)
        if noise is None:
            break
        before, weights = request.noise, noise if weights is None or noise.relative > 0.0 else weights
        if before is not None:
            ratio = noise.deviations[request.used] / before[request.used]
            if np.max(np.abs(np.log(ratio))) < _SAME_NOISE:
                break
        other = replace(request, noise=noise.deviations, found=not request.relative)
        descent = Descent(other, end.p, end.predictor)
        again = descent.descend(end.p, "linear")
        if not np.isfinite(again.cost):
            break
        request, end = other, again._replace(evaluations=end.evaluations + again.evaluations)
    return request, end, weights
