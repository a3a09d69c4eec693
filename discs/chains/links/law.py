"""The interface of a link law; see `discs.chains.links`."""

from typing import TYPE_CHECKING, ClassVar, Protocol

from discs.arrays import Complex, Float
from discs.chains.rolling_discs import Strains
from discs.skew import Parameters, Secant

if TYPE_CHECKING:
    from discs.chains.chain import Chain


class LinkLaw(Protocol):
    """The springs of a chain with slaved headings: V as a function of links d, (3, n_links), rows x, y, theta.

    Attributes
    ----------
    name : as given to `Chain(curvature=...)` and `Rod(curvature=...)`.
    quadratic : whether V is quadratic; secants then do not depend on the step.
    end_bends : whether "consistent" ends have a bending spring.
    stretches : whether it takes a `stretch_stiffness`.
    directed : whether it needs d != 0.

    `rest`, a rest curvature (n_bends,), is given to laws that are not quadratic; to the others `discs.loads.bends` adds it.
    """

    name: ClassVar[str]
    quadratic: ClassVar[bool]
    end_bends: ClassVar[bool]
    stretches: ClassVar[bool]
    directed: ClassVar[bool]

    def __init__(self, chain: "Chain", rest: Float | float = 0.0) -> None: ...

    @staticmethod
    def density(bending: Float, stretching: Float, z: Complex, z1: Complex) -> Float:
        """Twice the energy of bending and stretch per length, for r' = z and r'' = z1, complex numbers x + i y of any shape.

        The stiffnesses have this shape, or no dimensions."""

    @property
    def parameters(self) -> Parameters:
        """For the compiled form: a NamedTuple whose type the stubs `elastic`, `tension` and `assemble` of `discs.kernels.protocol`
        are filled in for. None if there is none: runs then take the plain engine."""

    def potential(self, d: Float) -> float:
        """V of links."""

    def energies(self, d: Float) -> dict[str, float]:
        """V of links by kind of spring: "bending", "torsion" and, for laws that stretch, "stretch"."""

    def polarised(self, d: Float, other: Float) -> float:
        """The symmetric bilinear form V(d, d') with V(d, d) = V(d); ValueError unless V is quadratic."""

    def secant(self, d: Float, change: Float) -> Secant:
        """The mean geometry of a step that changes the links."""

    def tension(self, secant: Secant) -> Float:
        """A discrete gradient of V over the step, (3, n_links): tension . change is the change of V."""

    def strains(self, d: Float) -> Strains:
        """The strains of all springs and their derivatives by q, as `RollingDiscs.strains` returns them."""

    def stiffness(self, secant: Secant, c: Float) -> Float:
        """Bands of C^T B^T (stiffness) B C, as `RollingDiscs.stiffness` returns them. They affect only the convergence of
        sweeps."""
