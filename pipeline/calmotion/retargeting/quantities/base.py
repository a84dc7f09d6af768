"""What follows from the motion of one robot: residuals, of which a search makes the squares small, and quantities that
it keeps within limits. A new kind is a new module beside this one, with a test of its derivatives by differences."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Protocol

from scipy.sparse import csr_matrix

from calmotion.arrays import Array
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.simulation.forward import ForwardRun


@dataclass(eq=False)
class RobotChange:
    """A change of what a robot does, or the derivatives of a number by it.

    Attributes:
        motion: Of the coordinates of the components (R^T dc, dphi, du), shape [T, B, N].
        efforts: Of the motors [N m or N], shape [T, M]; None where no quantity needs them.
        loads: Of the multipliers of the joints, shape [T, J, 6]; None where no quantity needs them.
        commands: Of the motors' curves [rad or m], shape [T, M].
    """

    motion: Array
    efforts: Array | None = None
    loads: Array | None = None
    commands: Array | None = None


class Slopes(Protocol):
    """The derivatives of a quantity about a run."""

    def change(self, by: RobotChange) -> Array:
        """Its change with that of what the robot does, shape [T, R]."""

    def pull(self, values: Array, onto: RobotChange) -> None:
        """The transpose of `change`: adds to the derivatives by what the robot does those by the quantity."""


class Quantity(ABC):
    """R numbers at each of T instants of a run.

    Attributes:
        is_stiff: Whether few of its limits act, each of which is far stiffer than all else and no matrix that is banded
            in time knows it: what a foot asks follows from all that the motors did before.
    """

    is_stiff: ClassVar[bool] = False

    @property
    def by_efforts(self) -> bool:
        """Whether its derivatives need the change of the efforts."""
        return False

    @property
    def by_loads(self) -> bool:
        """Whether its derivatives need the change of the multipliers."""
        return False

    @abstractmethod
    def values(self, run: ForwardRun) -> Array:
        """The numbers, shape [T, R]."""

    @abstractmethod
    def slopes(self, run: ForwardRun) -> Slopes:
        """Their derivatives about the run."""

    def rigid_metric(
        self, weights: Array, run: ForwardRun, inertia: Array, space: OffsetSpace
    ) -> tuple[csr_matrix, Array] | None:
        """A spline matrix and metrics of shape [T, m, m], whose sum over instants approximates the squares of changes
        times weights on the rigid robot, for a preconditioner; None where there is none.

        Args:
            weights: Shape [T, R].
            inertia: Of the rigid robot: efforts by accelerations of the unknowns' motors, shape [T, M, m].
        """
        return None
