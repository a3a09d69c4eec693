"""The rod: its parameters, and a scene, which adds the initial fields."""

from collections.abc import Callable
from dataclasses import dataclass, field
from dataclasses import fields as dataclass_fields

import numpy as np

from continuum.parameters import CHECKED, POSITIVE, Function, Parameter, Section, sample
from discs import checks
from discs.arrays import Float
from discs.chains import links
from discs.chains.rolling import ROLLING
from discs.loads import OnRod

Fields = Callable[[Float], tuple[Float, ...]]
PARAMETERS = tuple(f.name for f in dataclass_fields(Section))
TOLD = 33  # values of a function of s in `Scene.description`


@dataclass(frozen=True, kw_only=True)
class Rod:
    """A nonholonomic Cosserat rod (section 3 of the paper), in any consistent unit system.

    Kinetic energy per length rho |r.|**2/2 + alpha omega**2/2, potential beta theta'**2/2 + K |r''|**2/2.

    A parameter that is not the same everywhere is a function of s: it takes places (m,) and returns (m,) numbers, or one.
    `continuum.parameters` has some by name, which scene files can hold. The equations have them inside the derivatives,

        rho r.. = -(K r'')'' + lambda,   alpha theta.. = (beta theta')' - e . lambda,   e = R J r' or R J r'/|r'|.

    At a free end there is no curvature, beta theta' = e . (K r'')' = K e . r''' and |r'| stays 1, as for a uniform rod.

    Parameters
    ----------
    length : length of the rod, > 0.
    density : rho, mass per length, > 0.
    spin_inertia : alpha, moment of inertia about the axle of the discs per length, >= 0; > 0 if R = 0.
    torsion_stiffness : beta, >= 0.
    bending_stiffness : K, >= 0.
    radius : R, radius of the discs, >= 0. With R = 0 the centre line does not move and theta obeys the wave equation.
    curvature : "linear" for the bending energy K |r''|**2/2, the paper's; "true" for K phi'**2/2 with phi the direction of the
        line.
    stretch_stiffness : A, >= 0, adds A (|r'| - 1)**2/2; only with the true curvature.

    Raises
    ------
    ValueError : for a parameter outside its range. A function of s is read at 1025 places, and checked wherever it is read later.
    """

    length: float
    density: Parameter
    spin_inertia: Parameter
    torsion_stiffness: Parameter
    bending_stiffness: Parameter
    radius: Parameter
    curvature: str = "linear"
    stretch_stiffness: Parameter = 0.0

    def __post_init__(self) -> None:
        _check_and_store(
            self, ("length", "density", "radius", "spin_inertia", "torsion_stiffness", "bending_stiffness", "stretch_stiffness")
        )
        if not self.varying and not self.inertia:
            raise ValueError("spin_inertia must be positive where radius = 0; got 0 for both")
        if self.varying:
            s = np.linspace(0.0, self.length, CHECKED)
            with np.errstate(over="ignore"):  # refused with the energy of a problem
                inertia = np.broadcast_to(self.at(s).inertia, s.shape)
            if not inertia.all():
                raise ValueError(f"spin_inertia must be positive where radius = 0; got 0 for both at s = {s[np.argmin(inertia)]:g}")
        self._check_law()

    def _check_law(self) -> None:
        links.find(self.curvature, callable(self.stretch_stiffness) or self.stretch_stiffness)

    @property
    def varying(self) -> dict[str, Function]:
        """The parameters that are functions of s, by name."""
        return {name: value for name in PARAMETERS if callable(value := getattr(self, name, 0.0))}

    def at(self, s: Float) -> Section[Float]:
        """The parameters at places s along the rod, of any shape."""
        return Section(**{name: sample(name, getattr(self, name, 0.0), s) for name in PARAMETERS})

    def uniform(self, what: str) -> Section[float]:
        """The parameters as numbers. ValueError if some are functions of s, as `what` is for uniform rods."""
        if self.varying:
            raise ValueError(f"{what}: for rods whose parameters are numbers; along this one vary {', '.join(self.varying)}")
        return Section(**{name: getattr(self, name, 0.0) for name in PARAMETERS})

    @property
    def inertia(self) -> float:
        """M = alpha + rho R**2 of a uniform rod, the inertia of rolling per length while |r'| = 1; of others, `at(s).inertia`."""
        return self.uniform("inertia").inertia


@dataclass(frozen=True, kw_only=True)
class SteeredRod(Rod):
    """A rod whose sections have headings phi of their own: the planar Simo-Reissner rod, rolling; see `continuum.elements`.

    The bending energy is K phi'**2/2. Further parameters are those of `Rod`.

    Parameters
    ----------
    heading_inertia : J, moment of inertia about the vertical per length, > 0.
    stretch_stiffness, shear_stiffness : A, G >= 0, force per stretch and per shear angle.
    """

    shear_stiffness: Parameter
    heading_inertia: Parameter
    curvature: str = "true"

    def __post_init__(self) -> None:
        _check_and_store(self, ("length", "shear_stiffness", "heading_inertia"))
        super().__post_init__()

    def _check_law(self) -> None:
        checks.choice("curvature (own headings)", self.curvature, ("true",))


def _check_and_store(rod: Rod, names: tuple[str, ...]) -> None:
    """Check parameters that are numbers and store them as floats; functions of s are checked when they are read."""
    for name in names:
        given = getattr(rod, name)
        if name != "length" and callable(given):
            continue
        if name != "length" and (isinstance(given, list | tuple) or (isinstance(given, np.ndarray) and given.ndim)):
            raise ValueError(
                f"{name} of a rod must be a number or a function of s; got {checks.shown(given)}: "
                "continuum.parameters.table(s, values) interpolates"
            )
        value = checks.number(name, given, positive=name in ("length", *POSITIVE))
        if value < 0:
            raise ValueError(f"{name} must be at least 0; got {checks.shown(value)}")
        object.__setattr__(rod, name, value)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A rod, its law of rolling, its ends, its initial fields and a duration.

    Parameters
    ----------
    rod : the rod.
    initial : a function of the places s (n,) that returns x, y, theta, omega, each (n,); for a `SteeredRod` also phi and its
        rate.
    duration : duration of the motion, > 0.
    rolling : "field", r. = R omega J r' (the paper's (constraints)), or "unit", r. = R omega J r'/|r'| (constraintsphi).
    closed : whether the fields are periodic in s; otherwise there are two free ends.
    shift : for a closed rod, r(s + length) - r(s): (0, 0) for a ring, (length, 0) for a straight periodic rod.
    turns : for a closed `SteeredRod`, the number of full turns of the heading around it, 1 for a circle.
    name : a name for titles.
    loads : forces besides those of the rod and the ground, `discs.loads`, with patterns that are numbers or functions of s.

    Raises
    ------
    ValueError : for an unknown law, a duration that is not positive, a shift of a rod that is not closed, or loads of discs.
    """

    rod: Rod
    initial: Fields = field(repr=False)
    duration: float
    rolling: str = "field"
    closed: bool = False
    shift: tuple[float, float] = (0.0, 0.0)
    turns: int = 0
    name: str = "scene"
    loads: tuple[OnRod, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.rod, Rod) or not callable(self.initial):
            raise ValueError(
                f"a scene needs a Rod and a function of s; got {checks.shown(self.rod)} and {checks.shown(self.initial)}"
            )
        if not isinstance(self.closed, bool):
            raise ValueError(f"closed must be True or False; got {checks.shown(self.closed)}")
        if self.steered:
            checks.choice("rolling (own headings)", self.rolling, ("unit",))
        checks.choice("rolling", self.rolling, ROLLING)
        object.__setattr__(self, "duration", checks.number("duration", self.duration, positive=True))
        object.__setattr__(self, "turns", checks.whole("turns", self.turns))
        shift = checks.field("shift", self.shift, 2)
        if shift.any() and not self.closed:
            raise ValueError(f"shift belongs to a closed rod; got shift={self.shift} with closed=False")
        object.__setattr__(self, "shift", tuple(np.asarray(shift).tolist()))
        self._check_loads()
        if self.turns and not (self.closed and self.steered):
            raise ValueError(f"turns belong to a closed rod with headings of its own; got turns={self.turns} for another rod")

    def _check_loads(self) -> None:
        if not isinstance(self.loads, tuple) or not all(isinstance(load, OnRod) for load in self.loads):
            raise ValueError(
                f"loads of a scene must be a tuple of loads on a rod, as (Torque(...),); got {checks.shown(self.loads)}"
            )
        for load in self.loads:
            for entry in dataclass_fields(load):  # type: ignore[arg-type]  # all are dataclasses
                if np.ndim(value := getattr(load, entry.name)):
                    raise ValueError(
                        f"{entry.name} of {type(load).__name__} must be a number or a function of s for a scene, as an array "
                        f"belongs to discs; got {checks.shown(value)}"
                    )

    def fields(self, s: Float) -> dict[str, Float]:
        """The initial fields at places s (n,) by name, each (n,). ValueError if `initial` does not return what it should."""
        names = self.unknowns
        places = s.copy()
        values = self.initial(places)
        if not np.array_equal(places, s):
            raise ValueError("the scene's initial function must not change the places that it is given; compute with a copy")
        if not isinstance(values, tuple) or len(values) != len(names):
            given = f"{len(values)} of them" if isinstance(values, tuple) else type(values).__name__
            raise ValueError(f"the scene's initial fields must be the tuple {', '.join(names)}; got {given}")
        return {name: checks.field(f"initial {name}", value, s.size) for name, value in zip(names, values, strict=True)}

    def description(self) -> dict[str, object]:
        """The scene without its initial fields, as numbers and words: `Solution.stats["scene"]`.

        A function of s is stored as its values at 33 equally spaced places, the ends included.
        """
        names = ("name", "rolling", "duration", "closed", "shift", "turns")
        loads = {"loads": [checks.shown(load) for load in self.loads]} if self.loads else {}
        rod, places = self.rod, np.linspace(0.0, self.rod.length, TOLD)
        numbers = {f.name: getattr(rod, f.name) for f in dataclass_fields(rod)}
        sampled = {name: sample(name, function, places).tolist() for name, function in rod.varying.items()}
        return {name: getattr(self, name) for name in names} | numbers | sampled | loads

    @property
    def unknowns(self) -> tuple[str, ...]:
        """The names of the initial fields."""
        return ("x", "y", "theta", "omega", "phi", "phi_rate")[: 6 if self.steered else 4]

    @property
    def law(self) -> str:
        """How the rod rolls, for titles: the law, or that headings are its own."""
        return "own headings" if self.steered else f"{self.rolling} law"

    @property
    def steered(self) -> bool:
        """Whether sections have headings of their own."""
        return isinstance(self.rod, SteeredRod)
