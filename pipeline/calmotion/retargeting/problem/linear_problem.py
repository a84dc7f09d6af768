"""A retargeting problem linearised at a point: gradients, products of the Gauss-Newton matrix, and preconditioners."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array, BoolArray
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.problem.offset_space import DampedRegulariser, OffsetSpace
from calmotion.retargeting.problem.response_gram import response_preconditioner
from calmotion.retargeting.problem.responses import Responses
from calmotion.retargeting.problem.rigid_robot import RigidRobot
from calmotion.retargeting.problem.robot import EFFORT, of_robot
from calmotion.retargeting.problem.sweeps import Sweeps
from calmotion.retargeting.solver.dense_preconditioner import DensePreconditioner
from calmotion.retargeting.solver.few_rows import with_rows
from calmotion.retargeting.solver.norm import Norm, SumOfSquares
from calmotion.retargeting.solver.preconditioner import Preconditioner, RigidPreconditioner, Sharpened

Place = tuple[str, int, int]
STIFF_ROWS = 64  # rows of stiff limits in a preconditioner; each costs an adjoint sweep, half a product, once


@dataclass(frozen=True, eq=False)
class LinearProblem:
    """A problem at a point.

    Attributes:
        space, norm, rigid: Of the problem.
        sweeps: The derivatives of all robots there.
        x, residuals: The point and the weighted residuals there, shapes [n] and [S T, R].
        limits: Those that are part of the merit; None where none are.
        limited: Values of their quantities there.
        continuous: Whether the gradient is that of the continuous adjoint.
        damping: Of steps, see `offset_space.DampedRegulariser`.
        pull: What the gradient has beside that by the sweeps, shape [n]: of responses at another point.
    """

    space: OffsetSpace
    norm: Norm
    rigid: RigidRobot
    sweeps: Sweeps
    x: Array
    residuals: Array
    limits: LimitTerms | None
    limited: dict[str, Array]
    continuous: bool = False
    damping: float = 0.0
    pull: Array | float = 0.0
    _stiff: dict[Place, Array] = field(default_factory=dict)  # rows that were worked out

    def over(self, space: OffsetSpace, x: Array, rigid: RigidRobot | None = None) -> LinearProblem:
        """The same point by other unknowns; of other motors, which have no limits, with their rigid robot."""
        limits, limited = (self.limits, self.limited) if rigid is None else (None, {})
        return replace(
            self, space=space, x=x, sweeps=self.sweeps.of(space), rigid=rigid or self.rigid, limits=limits,
            limited=limited, _stiff={},
        )  # fmt: skip

    @property
    def regulariser(self) -> DampedRegulariser:
        """That of the unknowns, and the damping of steps from here."""
        return DampedRegulariser(self.space, self.damping, self.x)

    @cached_property
    def gradient(self) -> Array:
        """Gradient of the merit, shape [n]."""
        limits = self.limits
        pulls = {} if limits is None else {name: limits.gradient(name, v) for name, v in self.limited.items()}
        if self.continuous:
            pulled = self.sweeps.continuous_adjoint(pulls)
        else:
            pulled = self.sweeps.vjp(self.norm.gradient(self.residuals), pulls)
        return pulled + self.space.penalty_gradient(self.x) + self.pull

    def jvp(self, direction: Array) -> tuple[Array, dict[str, Array]]:
        """Change of the weighted residuals along a direction, shape [S T, R], and of limited quantities."""
        return self.sweeps.jvp(direction, {} if self.limits is None else self.limits.bounds)

    def vjp(self, residuals: Array, limited: Mapping[str, Array]) -> Array:
        """The transpose of `jvp`."""
        return self.sweeps.vjp(residuals, limited)

    def product(self, direction: Array) -> Array:
        """Gauss-Newton matrix times a direction: one tangent and one adjoint sweep."""
        residuals, changes = self.jvp(direction)
        if self.limits is not None:
            changes = {name: self.limits.curvature(name, self.limited[name]) * v for name, v in changes.items()}
        curved = self.norm.product(self.residuals, residuals)
        return self.vjp(curved, changes) + self.regulariser.penalty_product(direction)

    def precondition(
        self,
        fixed: BoolArray,
        sharpened: Sharpened | None = None,
        limits: LimitTerms | None = None,
        values: dict[str, Array] | None = None,
    ) -> Callable[[Array], Array]:
        """The rigid robot's Gauss-Newton matrix, or a better one, inverted over the entries that are not fixed.

        Args:
            limits, values: Limits and the values of their quantities, which say which of them act; None: those here.
        """
        limits, values = limits or self.limits, values or self.limited
        weights = {} if limits is None else limits.curvatures(values)
        own = sharpened or self._preconditioner
        acting = {name: w for name, w in weights.items() if np.any(w)}
        if isinstance(self.sweeps, Responses) and isinstance(own, DensePreconditioner):
            curves = {name: w for name, w in acting.items() if name in self.space.splines}
            own.factor(fixed, self._terms(curves), self.sweeps.roots(acting))
            return own.solve
        own.factor(fixed, self._terms(acting))
        return self._with_stiff_rows(own.solve, weights, limits, values, fixed)

    def by_responses(self, known: Responses | None = None) -> LinearProblem | None:
        """The same problem by the responses to all unknowns, with the gradient of the sweeps; None where there are
        none.

        Args:
            known: Of another point, which are taken where they fit.
        """
        if isinstance(self.sweeps, Responses):
            return self
        robots = self.sweeps.robots
        motors = () if self.limits is None else self.limits.bounded(EFFORT)
        if known is None or not known.fits(robots, self.space, motors):
            if not Responses.can_be(robots, self.space, motors):
                return None
            known = Responses(robots, self.space, motors)
        exact = replace(self, continuous=False) if self.continuous else self
        model = replace(exact, sweeps=known, _stiff={})
        return replace(model, pull=exact.gradient - model.gradient)

    def patience(self, sharpened: Sharpened | None) -> int | None:
        """Number of products of one system from which `sharpened` pays; None where it is of no use here."""
        if sharpened is not None and np.array_equal(sharpened.point, self.x):
            return None
        return self.sweeps.patience(first=sharpened is None)

    def sharpened(self) -> Sharpened:
        """A preconditioner from the responses of the flexible robots here."""
        return Sharpened(self.x, response_preconditioner(self.sweeps.robots, self.space))

    @cached_property
    def _preconditioner(self) -> Preconditioner:
        """From the responses, where these are known; else that of the rigid robot."""
        if isinstance(self.sweeps, Responses):
            return self.sweeps.preconditioner(self.norm, self.residuals, self.damping)
        robots, weights = self.sweeps.robots, self.sweeps.robots[0].at.robot.objective.weights
        if isinstance(self.norm, SumOfSquares):
            return self.rigid.preconditioner(self.space, weights)
        # the root of the mean second derivatives over the robots
        squares = np.sum(self.norm.roots(self.residuals[:, : weights[0].size]) ** 2, axis=2)
        shares = np.array([robot.at.robot.weight for robot in robots])
        mean = np.einsum("s,stki->tki", shares, squares.reshape(len(robots), *weights.shape))
        return RigidPreconditioner(self.rigid.response, weights * np.sqrt(mean), self.space.basis, self.space.penalty)

    def _terms(self, weights: dict[str, Array]) -> list[tuple[csr_matrix, Array]]:
        """Limits that act, and residuals beside the errors, as the rigid robot has them."""
        space, inertia, coupling = self.space, self.rigid.response.inertia, self.space.coupling
        found: list[tuple[csr_matrix, Array] | None] = [
            (spline, np.einsum("ma,nm,mb->nab", coupling, weights[name], coupling))
            for name, spline in space.splines.items()
            if name in weights
        ]
        for k, robot in enumerate(self.sweeps.robots):
            own, run = robot.at.robot, robot.at.run
            for name, limited in own.limited.items():
                if of_robot(name, k) in weights:
                    found.append(limited.rigid_metric(weights[of_robot(name, k)], run, inertia, space))
            for residual, part in zip(own.residuals, robot.at.parts[1:], strict=True):
                found.append(residual.rigid_metric(np.full(part.shape, own.weight), run, inertia, space))
        return [term for term in found if term is not None]

    def _with_stiff_rows(
        self, inverse: Callable[[Array], Array], weights: dict[str, Array], limits: LimitTerms | None,
        values: dict[str, Array], fixed: BoolArray,
    ) -> Callable[[Array], Array]:  # fmt: skip
        """A preconditioner with the stiff limits that act; of many, those that pull most.

        Conjugate gradients without them took hundreds of products and did not keep the limits.
        """
        acting: list[tuple[float, Place]] = []
        for k, robot in enumerate(self.sweeps.robots if limits is not None else ()):
            for name in (of_robot(name, k) for name, limited in robot.at.robot.limited.items() if limited.is_stiff):
                if name in weights and limits is not None:
                    pulls = np.abs(limits.gradient(name, values[name]))
                    acting += [(pulls[n, i], (name, int(n), int(i))) for n, i in np.argwhere(weights[name] > 0.0)]
        places = [place for _, place in sorted(acting, key=lambda each: -each[0])[:STIFF_ROWS]]
        for place in places:
            if place not in self._stiff:
                one = np.zeros_like(values[place[0]])
                one[place[1:]] = 1.0
                self._stiff[place] = self.vjp(np.zeros_like(self.residuals), {place[0]: one})
        rows = [np.where(fixed, 0.0, self._stiff[place]) for place in places]
        return with_rows(inverse, np.array(rows), np.array([weights[name][n, i] for name, n, i in places]))
