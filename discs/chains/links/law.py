"""What a link law is; see `discs.chains.links`."""

from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from numpy.typing import NDArray

if TYPE_CHECKING:
    from discs.chains.chain import Chain


class LinkLaw(Protocol):
    """The springs of a chain with slaved headings: V as a function of links d, (3, n_links), rows x, y, theta.

    Attributes
    ----------
    name : as given to `Chain(curvature=...)` and `Rod(curvature=...)`.
    quadratic : whether V is, so that secants do not depend on the step.
    end_bends : whether "consistent" ends carry a bend.
    stretches : whether it takes a `stretch_stiffness`.
    directed : whether links need a direction, d != 0.
    """

    name: ClassVar[str]
    quadratic: ClassVar[bool]
    end_bends: ClassVar[bool]
    stretches: ClassVar[bool]
    directed: ClassVar[bool]

    def __init__(self, chain: "Chain") -> None: ...

    @staticmethod
    def density(bending: float, stretching: float, z: NDArray, z1: NDArray) -> NDArray:
        """Twice the energy per length of bending and stretch for r' = z and r'' = z1, complex numbers x + i y of any shape."""

    @property
    def parameters(self) -> Any:
        """For the compiled form: a NamedTuple that stubs of `discs.kernels.protocol` are filled for. None if there is none: runs
        then take the plain engine."""

    def potential(self, d: NDArray) -> float:
        """V."""

    def polarised(self, d: NDArray, other: NDArray) -> float:
        """The symmetric bilinear form of which V is the square; ValueError unless V is quadratic."""

    def secant(self, d: NDArray, change: NDArray) -> Any:
        """The mean geometry of a step that changes the links."""

    def tension(self, secant: Any) -> NDArray:
        """A discrete gradient over the step, (3, n_links): tension . change is the change of V."""

    def stiffness(self, secant: Any, c: NDArray) -> NDArray:
        """Bands of C^T B^T (stiffness) B C as `RollingDiscs.stiffness` gives them. Only how soon sweeps converge depends on
        them."""
