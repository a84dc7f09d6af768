"""The unknowns of a retargeting problem: spline coefficients, and the offsets of all motors that follow from them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array, IntArray
from calmotion.model.limits.base import CurveLimit
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.retargeting.problem.offset_basis import OffsetBasis
from calmotion.simulation.inputs.curves import Curves


@dataclass(frozen=True, eq=False)
class BaseOffsets:
    """Offsets that the curves of a problem already contain, and that its regulariser counts with the unknown ones.

    Attributes:
        values, accelerations: Shape [T, M].
        h: Step [s].
    """

    values: Array
    accelerations: Array
    h: float


@dataclass(frozen=True, eq=False)
class OffsetSpace:
    """Coefficients x ordered by basis function, then motor, P functions and m motors; offsets of all M motors.

    Attributes:
        basis: Offset splines.
        motors: Motors that may change, shape [m].
        coupling: By how much each motor changes with each of `motors`, shape [M, m].
        smoothness: Weight of the curvature penalty int |offset''|^2 / 2 of each motor.
        closeness: Weight of int |offset|^2 / 2 for each motor.
        base: Further offsets that both penalties count; None where there are none.
    """

    basis: OffsetBasis
    motors: IntArray
    coupling: Array
    smoothness: float
    closeness: float
    base: BaseOffsets | None = None

    @staticmethod
    def uncoupled(basis: OffsetBasis, motors: IntArray, every: int, smoothness: float, closeness: float) -> OffsetSpace:
        """The space in which each of some motors, out of `every` motor, changes alone."""
        return OffsetSpace(basis, motors, np.eye(every)[:, motors], smoothness, closeness)

    @property
    def size(self) -> int:
        """Number of unknowns, P * m."""
        return self.basis.count * len(self.motors)

    @cached_property
    def penalty(self) -> csr_matrix:
        """Matrix of the regulariser for one motor, shape [P, P]."""
        return self.smoothness * self.basis.curvature_gram + self.closeness * self.basis.closeness

    @property
    def orders(self) -> dict[str, int]:
        """Orders of the derivatives of the curves that may have limits, by the name of the kind of limit."""
        return {name: kind.order for name, kind in kinds_of_limits().items() if isinstance(kind, CurveLimit)}

    @cached_property
    def splines(self) -> dict[str, csr_matrix]:
        """Spline matrices [T, P] of these derivatives."""
        return {name: self.basis.derivatives[order] for name, order in self.orders.items()}

    def on_basis(self, basis: OffsetBasis) -> OffsetSpace:
        """The same motors over other splines."""
        return replace(self, basis=basis)

    def spread(self, spline: csr_matrix, x: Array) -> Array:
        """Rows of a spline matrix times the coefficients, for all motors, shape [T, M]."""
        return np.asarray(spline @ (x.reshape(self.basis.count, len(self.motors)) @ self.coupling.T))

    def gather(self, spline: csr_matrix, by_motor: Array) -> Array:
        """The transpose of `spread`: from shape [T, M] to the unknowns."""
        return np.asarray(spline.T @ (by_motor @ self.coupling)).ravel()

    def offsets(self, x: Array) -> tuple[Array, Array]:
        """Offsets and their rates for all motors, shape [T, M]."""
        return self.spread(self.basis.values, x), self.spread(self.basis.rates, x)

    def changed(self, curves: Curves, x: Array) -> Curves:
        """Curves of the motors with their offsets."""
        return curves.plus([self.spread(spline, x) for spline in self.basis.derivatives])

    @cached_property
    def pull(self) -> Array:
        """Gradient of the regulariser where the unknowns are zero, shape [n]."""
        if self.base is None:
            return np.zeros(self.size)
        weighted = (
            self.base.h * self.closeness * self.base.values,
            self.base.h * self.smoothness * self.base.accelerations,
        )
        return self.gather(self.basis.values, weighted[0]) + self.gather(self.basis.accelerations, weighted[1])

    @cached_property
    def base_penalty(self) -> float:
        """The regulariser where the unknowns are zero."""
        if self.base is None:
            return 0.0
        sums = [float(np.sum(part**2)) for part in (self.base.values, self.base.accelerations)]
        return 0.5 * self.base.h * (self.closeness * sums[0] + self.smoothness * sums[1])

    def closeness_product(self, x: Array) -> Array:
        """Gram matrix of the offsets over time, times x: x^T of it is int |offset|^2 [rad^2 s]."""
        return np.asarray(self.basis.closeness @ x.reshape(self.basis.count, len(self.motors))).ravel()

    def penalty_product(self, x: Array) -> Array:
        """Matrix of the regulariser times x."""
        return np.asarray(self.penalty @ x.reshape(self.basis.count, len(self.motors))).ravel()

    def penalty_gradient(self, x: Array) -> Array:
        """The gradient of smoothness and closeness."""
        return self.penalty_product(x) + self.pull

    def penalty_value(self, x: Array) -> float:
        """Smoothness and closeness."""
        return self.base_penalty + float(x @ (0.5 * self.penalty_product(x) + self.pull))


@dataclass(frozen=True, eq=False)
class DampedRegulariser:
    """The regulariser of a space, and a pull towards a point.

    Attributes:
        space: The unknowns.
        damping: Weight of half the squared change of the offsets over time.
        center: From which they change, shape [n].
    """

    space: OffsetSpace
    damping: float
    center: Array

    def penalty_product(self, x: Array) -> Array:
        """Its matrix times x."""
        product = self.space.penalty_product(x)
        return product + self.damping * self.space.closeness_product(x) if self.damping else product

    def penalty_gradient(self, x: Array) -> Array:
        """Its gradient."""
        pull = self.damping * self.space.closeness_product(x - self.center) if self.damping else 0.0
        return self.space.penalty_gradient(x) + pull

    def penalty_value(self, x: Array) -> float:
        """Its value."""
        d = x - self.center
        return self.space.penalty_value(x) + 0.5 * self.damping * float(d @ self.space.closeness_product(d))
