"""What a page of the lab can choose: the scene, the chain, the method and the sliders; the same as a program and as a file."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from compare.lump import lump
from continuum import Scene
from continuum.scenes import SCENES, steered_rod
from discs import Problem, checks
from discs.chains.rolling import ROLLING
from discs.chains.twist import PAPER, STEERED
from discs.integrators import METHODS
from discs.loads import Custom, Damping, OnRod, Rest, Slope
from discs.loads.tables import table_of

OWN = "own scene"
FIXED = tuple(name for name, method in METHODS.items() if not method.adaptive)
FREE_ENDS = ("springs", "consistent", "paper")


@dataclass(frozen=True)
class Slider:
    """A number that can be changed as the discs move.

    value : at first. again : whether the motion starts again when it changes, as the initial state does.
    """

    name: str
    label: str
    low: float
    high: float
    value: float
    again: bool = False


LABELS = {
    "twist": "twist (turns)",
    "omega": "rate of roll ω",
    "torsion_stiffness": "torsion stiffness β",
    "bending_stiffness": "bending stiffness K",
    "stretch_stiffness": "stretch stiffness A",
    "shear_stiffness": "shear stiffness G",
    "radius": "radius R",
    "damping": "damping of the roll",
    "slope": "slope, gravity along y",
    "rest_curvature": "rest curvature κ₀",
    "mounting_angle": "mounting angle ψ (rad)",
}
HIGHEST = {"stretch_stiffness": 50.0, "shear_stiffness": 50.0, "radius": 2.0, "damping": 1.0}  # of others 3
AGAIN = ("twist", "omega", "mounting_angle")
INITIAL = {  # what the scenes' functions take besides the rod's parameters
    "untwisting_rod": {"twist": (0.0, 2.0, 0.5)},
    "steered_rod": {"twist": (0.0, 2.0, 0.5), "mounting_angle": (-1.57, 1.57, 0.0)},
    "rolling_rod": {"omega": (-2.0, 2.0, 1.0)},
    "breathing_ring": {"omega": (-2.0, 2.0, 0.4)},
}
LOADS = {"damping": (0.0, 1.0, 0.0), "slope": (-1.0, 1.0, 0.0), "rest_curvature": (-1.0, 1.0, 0.0)}


@dataclass(frozen=True)
class Settings:
    """The choices of a page. ValueError for a choice that does not exist; what does not fit is found when the scene is made.

    Attributes
    ----------
    own : the scene that `compare.lab(scene)` was given; None for none.
    values : of sliders that were moved, by name.
    """

    own: Scene | None = None
    scene: str = "untwisting_rod"
    rolling: str = "field"
    n: int = 32
    ends: str = "springs"
    method: str = "midpoint"
    dt: float = 0.01
    values: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        checks.choice("scene", self.scene, self.scenes)
        checks.choice("rolling", self.rolling, ROLLING)
        checks.choice("ends", self.ends, FREE_ENDS)
        checks.choice("method", self.method, FIXED)
        for name in self.values:
            checks.choice("slider", name, [slider.name for slider in self.sliders])

    @staticmethod
    def of(scene: Scene | None, n: int = 32) -> "Settings":
        """The settings to begin with. ValueError for a scene that the lab cannot show."""
        if scene is None:
            return Settings(n=n)
        if not isinstance(scene, Scene):
            raise ValueError(f"lab takes a Scene, such as untwisting_rod(); got {checks.shown(scene)}")
        for load in scene.loads:
            if isinstance(load, Custom):
                raise ValueError(
                    "the lab takes no Custom load: when a slider moves, the run goes on from a new start, and a function of t "
                    "cannot be told so; take a Torque or Force with a signal"
                )
        return Settings(own=scene, scene=OWN, rolling=scene.rolling, n=n)

    @property
    def scenes(self) -> tuple[str, ...]:
        return (*SCENES, OWN) if self.own is not None else tuple(SCENES)

    @property
    def steered(self) -> bool:
        """Whether the discs have headings of their own."""
        return self.own.steered if self.scene == OWN and self.own is not None else self.scene == steered_rod.__name__

    @property
    def laws(self) -> tuple[str, ...]:
        """The laws of rolling that the scene can have."""
        return ("unit",) if self.steered else tuple(ROLLING)

    @property
    def kinds_of_ends(self) -> tuple[str, ...]:
        """The ends that the scene can have."""
        closed = self.own.closed if self.scene == OWN and self.own is not None else self.scene in ("rolling_rod", "breathing_ring")
        return ("ring",) if closed else ("springs",) if self.steered else FREE_ENDS

    @property
    def sliders(self) -> tuple[Slider, ...]:
        """The sliders of the scene."""
        rod: dict[str, Any] = {**PAPER, **(STEERED if self.steered else {})}
        initial = INITIAL.get(self.scene, {})
        if self.scene == OWN and self.own is not None:
            rod = {name: getattr(self.own.rod, name, None) for name in rod}
        moved = [name for name in LABELS if isinstance(rod.get(name), float)]
        ranges = {name: (0.0, max(HIGHEST.get(name, 3.0), 2 * rod[name]), rod[name]) for name in moved}
        ranges = initial | ranges | LOADS
        return tuple(Slider(name, label, *ranges[name], name in AGAIN) for name, label in LABELS.items() if name in ranges)

    def value(self, name: str) -> float:
        """The value of a slider."""
        return self.values.get(name, next(slider.value for slider in self.sliders if slider.name == name))

    def chosen(self, **changes: Any) -> "Settings":
        """Other choices. Law and sliders of another scene are at first its own."""
        if changes.get("scene", self.scene) != self.scene:
            own = self.own if changes["scene"] == OWN else None
            changes = {"rolling": "field" if own is None else own.rolling, "values": {}} | changes
        return replace(self, **changes)

    def moved(self, name: str, value: float) -> "Settings":
        """With a slider moved."""
        slider = next(s for s in self.sliders if s.name == checks.choice("slider", name, [s.name for s in self.sliders]))
        if not slider.low <= value <= slider.high:
            raise ValueError(f"{slider.label} must be from {slider.low:g} to {slider.high:g}; got {value:g}")
        return replace(self, values=self.values | {name: value})

    # ---- what they make

    @property
    def _arguments(self) -> dict[str, Any]:
        """The arguments of the scene's function, those that differ from its defaults."""
        law = {} if self.steered or self.rolling == "field" else {"rolling": self.rolling}
        return law | {name: value for name, value in self.values.items() if name not in LOADS}

    @property
    def _loads(self) -> tuple[OnRod, ...]:
        given = {name: value for name in LOADS if (value := self.values.get(name))}
        make: dict[str, Callable[[float], OnRod]] = {
            "damping": lambda c: Damping(rolling=c),
            "slope": lambda g: Slope(gy=g),
            "rest_curvature": lambda curvature: Rest(curvature=curvature),
        }
        return tuple(make[name](value) for name, value in given.items())

    def make_scene(self) -> Scene:
        """The scene, with the loads of the sliders."""
        if self.scene == OWN and self.own is not None:
            moved: dict[str, Any] = {name: value for name, value in self.values.items() if name not in LOADS}
            scene = replace(self.own, rod=replace(self.own.rod, **moved), rolling=self.rolling)
        else:
            scene = SCENES[self.scene](**self._arguments)
        return replace(scene, loads=scene.loads + self._loads)

    def make_problem(self) -> Problem:
        """The discs."""
        return lump(self.make_scene(), self.n, self.free_ends)

    @property
    def free_ends(self) -> str:
        """The ends, or "springs" where the scene has no choice: closed rods, and discs with headings of their own."""
        return self.ends if self.ends in self.kinds_of_ends else "springs"

    @property
    def of_field(self) -> tuple[object, ...]:
        """What the field depends on, and the places where it is compared."""
        return self.scene, self.rolling, self.n, tuple(sorted(self.values.items()))

    def python(self) -> str:
        """A program that makes the scene and runs it."""
        loads = ", ".join(_call(load) for load in self._loads)
        names = ", ".join(sorted({type(load).__name__ for load in self._loads}))
        head = ["from dataclasses import replace"] if loads or self.scene == OWN else []
        head += ["from compare import lump"]
        own = self.scene == OWN
        head += [] if own else [f"from continuum import {self.scene}"]
        head += ["from discs import simulate"] + ([f"from discs.loads import {names}"] if loads else [])
        values = ", ".join(f"{name}={value!r}" for name, value in self._arguments.items())
        body = [f"scene = {self.scene}({values})"]
        if own:
            rod = ", ".join(f"{name}={value!r}" for name, value in self._arguments.items() if name != "rolling")
            rod = f", rod=replace(scene.rod, {rod})" if rod else ""
            body = [f"scene = replace(scene, rolling={self.rolling!r}{rod})  # scene: your own, as you gave it to the lab"]
        if loads:
            body.append(f"scene = replace(scene, loads=(*scene.loads, {loads}))")
        body.append(f"problem = lump(scene, n={self.n}, ends={self.free_ends!r})")
        body.append(f"run = simulate(problem, {self.method!r}, dt={self.dt!r})")
        body.append("print(run)")
        return "\n".join([*head, "", *body]) + "\n"

    def toml(self) -> str:
        """A scene file, which `continuum.files.read_scene` reads. ValueError for a scene of one's own."""
        if self.scene == OWN:
            raise ValueError("a scene of your own is functions of your program, which a TOML file cannot hold; copy it as Python")
        lines = [f'scene = "{self.scene}"'] + [f"{name} = {_toml(value)}" for name, value in self._arguments.items()]
        for load in self._loads:
            given = {name: value for name, value in table_of(load).items() if value not in (0.0, None)}
            lines += ["", "[[loads]]", *(f"{name} = {_toml(value)}" for name, value in given.items())]
        about = f"# {self.n} discs: python -m continuum discs --scene FILE.toml --n {self.n} --ends {self.free_ends}"
        return "\n".join([about, *lines]) + "\n"


def _call(load: OnRod) -> str:
    given: Sequence[tuple[str, Any]] = [(name, value) for name, value in table_of(load).items() if name != "load"]
    return f"{type(load).__name__}({', '.join(f'{name}={value!r}' for name, value in given if value not in (0.0, None))})"


def _toml(value: float | str) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(float(value))
