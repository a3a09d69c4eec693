"""The public functions and classes, each with arguments that are right, of which the fuzzer replaces one or two by odd values."""

# ruff: noqa: RUF012  (a line for each function)

import random
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

import continuum
from compare import convergence, lump
from discs import (
    Chain,
    Gauss4,
    LinkageProblem,
    LinkageState,
    Midpoint,
    Problem,
    State,
    SteeredChain,
    first_slip,
    friction_needed,
    lagrange_dalembert,
    load,
    loads,
    simulate,
    simulate_many,
    steps,
    suggest_dt,
)
from discs.analysis import (
    equilibrium,
    gradient,
    growth,
    horizon,
    linearise,
    lyapunov,
    modes,
    relative_equilibria,
    steady,
)
from discs.events import FrictionExceeded, Line, Touch
from discs.loads import signals
from tests.fuzz.made import (
    FOLDER,
    OWN,
    ROD,
    N,
    S,
    _square,
    a_message,
    a_path,
    from_text,
    in_process,
    message,
    moved,
    on_scene,
    parked,
    rod,
    run,
    saved,
    scene_text,
    slaved,
    steered,
    still,
    system,
    trailer,
    with_event,
    with_load,
    with_signal,
)


class Door(NamedTuple):
    """A public function. usual : arguments that are right. use : what is done with the result, so that late faults are seen."""

    name: str
    function: Callable[..., Any]
    usual: Callable[[], dict[str, Any]]
    use: Callable[[Any], Any] = lambda result: result
    odd: dict[str, Callable[[random.Random], Any]] = {}
    weight: int = 1
    raises: tuple[type[Exception], ...] = ()  # besides ValueError, OSError and SimulationError, as its docstring says


def doors() -> Iterator[Door]:
    """All of them."""

    def quiet(**more: Any) -> dict[str, Any]:
        return {"progress": False, "engine": "plain", **more}

    yield Door(
        "simulate",
        lambda **a: simulate(**a, **quiet()),
        lambda: {
            "problem": slaved(),
            "method": "midpoint",
            "dt": 0.1,
            "frames": 2,
            "want": (),
            "tol": None,
            "checkpoint": None,
            "events": (),
        },
        weight=4,
    )
    yield Door(
        "simulate: linkage",
        lambda **a: simulate(**a, progress=False),
        lambda: {
            "problem": LinkageProblem(trailer(), parked(), 0.1),
            "method": None,
            "dt": 0.05,
            "frames": 2,
            "want": (),
            "tol": None,
        },
    )
    yield Door(
        "simulate_many",
        lambda **a: simulate_many(**a, **quiet()),
        lambda: {
            "problems": [slaved(), slaved()],
            "method": "midpoint",
            "dt": 0.1,
            "frames": 2,
            "want": (),
            "tol": None,
            "checkpoint": None,
            "executor": None,
            "threads": 1,
        },
        weight=3,
    )
    yield Door(
        "steps",
        lambda **a: [now.t for now, _ in zip(steps(**a), range(3), strict=False)],
        lambda: {"problem": slaved(), "method": "midpoint", "dt": 0.1, "engine": "plain"},
    )
    yield Door("suggest_dt", suggest_dt, lambda: {"problem": slaved(), "method": "midpoint"})
    yield Door(
        "Chain",
        lambda **a: moved(Problem(Chain(n=N, **a), State(S, 0.02 * S**2, 0.1 * S**2, 0.5), 0.2)),
        lambda: ROD | {"rolling": "field", "ends": "springs", "shift": (0.0, 0.0), "curvature": "linear", "stretch_stiffness": 0.0},
        weight=2,
    )
    yield Door(
        "SteeredChain",
        lambda **a: moved(Problem(SteeredChain(n=N, **a), steered().initial, 0.2)),
        lambda: ROD | OWN | {"ends": "springs", "turns": 0, "degree": 1},
        weight=2,
    )
    yield Door(
        "State",
        lambda **a: moved(Problem(slaved().chain, State(**a), 0.2)),
        lambda: {"x": S, "y": 0.02 * S**2, "theta": 0.1 * S, "omega": 0.5, "phi": None, "phi_rate": 0.0},
        weight=2,
    )
    yield Door(
        "Problem",
        Problem,
        lambda: {"chain": slaved().chain, "initial": slaved().initial, "duration": 0.2, "loads": ()},
        moved,
        weight=2,
    )
    for kind in (Midpoint, Gauss4):
        yield Door(
            kind.__name__,
            lambda k=kind, **a: simulate(slaved(), k(**a), dt=0.1, frames=1, **quiet()),
            lambda: {"sweeps": 5, "tolerance": 1e-12},
        )
    # loads and their signals
    ones = np.ones(N)
    kinds: dict[str, tuple[Any, dict[str, Any]]] = {
        "Torque": (loads.Torque, {"pattern": 0.3, "signal": None, "at": None, "about": "roll"}),
        "Force": (loads.Force, {"x": 0.1, "y": ones, "signal": signals.sine(1.0, 2.0), "at": None}),
        "Slope": (loads.Slope, {"gx": 0.1, "gy": -0.2}),
        "Spring": (loads.Spring, {"x": 0.1, "y": 0.2, "stiffness": 0.5, "at": None}),
        "Damping": (loads.Damping, {"rolling": 0.1, "turning": 0.0, "torsion": 0.1, "bending": 0.1}),
        "Rest": (
            loads.Rest,
            {"twist": 0.1, "curvature": 0.1, "stretch": 0.0, "shear": 0.0, "mounting_angle": None, "signal": None},
        ),
        "Motor": (loads.Motor, {"rate": 0.5, "at": 0.0, "about": "roll"}),
        "Potential": (loads.Potential, {"V": lambda x, y: 0.5 * x * x, "gradient": lambda x, y: (x, 0 * y)}),
        "Custom": (loads.Custom, {"force": lambda t, q, v: -0.1 * v, "power": None, "per_length": False}),
        "Linear": (
            loads.Linear,
            {
                "constant": np.zeros((3, N)),
                "damping": np.zeros((3, N)),
                "stiffness": np.zeros((3, N)),
                "viscosity": None,
                "offset": 0.0,
                "floor": None,
            },
        ),
    }
    for name, (kind_of, usual) in kinds.items():
        yield Door(name, kind_of, lambda usual=usual: usual, with_load, weight=2)
    named: dict[str, tuple[Any, dict[str, Any]]] = {
        "sine": (signals.sine, {"amplitude": 1.0, "rate": 2.0, "phase": 0.1}),
        "ramp": (signals.ramp, {"t0": 0.0, "t1": 0.1}),
        "smooth": (signals.smooth, {"t0": 0.0, "t1": 0.1}),
        "pulse": (signals.pulse, {"t0": 0.0, "width": 0.1}),
        "table": (signals.table, {"t": [0.0, 0.1], "values": [0.0, 1.0]}),
    }
    for name, (signal, usual) in named.items():
        yield Door(f"signals.{name}", signal, lambda usual=usual: usual, with_signal)
    events: dict[str, tuple[Any, dict[str, Any]]] = {
        "Line": (Line, {"point": (1.0, 0.0), "normal": (1.0, 0.0), "disc": None, "terminal": False, "direction": 0}),
        "Touch": (Touch, {"one": 0, "other": 2, "gap": 0.01, "terminal": False, "direction": 0}),
        "FrictionExceeded": (FrictionExceeded, {"mu": 0.3, "weight": 1.0, "disc": None, "terminal": False, "direction": 1}),
    }
    for name, (event, usual) in events.items():
        yield Door(f"events.{name}", event, lambda usual=usual: usual, with_event, weight=2)
    # analysis
    yield Door("modes", modes, lambda: {"problem": still(), "count": 3, "at": None}, lambda m: m.table(), weight=2)
    yield Door("linearise", linearise, lambda: {"problem": slaved(), "at": None, "t": 0.0})
    yield Door("steady", steady, lambda: {"problem": still(), "at": None})
    yield Door("equilibrium", equilibrium, lambda: {"problem": still(), "at": None})
    yield Door(
        "lyapunov",
        lyapunov,
        lambda: {"problem": slaved(), "count": 1, "dt": 0.01, "method": "gauss4", "every": 1, "seed": 0},
        weight=2,
    )
    yield Door("growth", growth, lambda: {"problem": slaved(), "dt": 0.1, "method": "gauss4", "most": 1e150})
    yield Door("horizon", horizon, lambda: {"problem": slaved(), "error": 1e-3, "dt": 0.1, "method": "gauss4", "tolerance": 1.0})
    yield Door(
        "gradient",
        lambda **a: gradient(**a, **quiet()),
        lambda: {
            "problem": slaved(),
            "cost": lambda run: run.y[-1, 0],
            "wrt": ("radius", "theta"),
            "method": "midpoint",
            "dt": 0.1,
            "frames": 1,
            "cost_gradient": None,
        },
        weight=3,
    )
    yield Door("relative_equilibria", relative_equilibria, lambda: {"make": lambda v: still(), "values": [0.0, 0.1], "count": 2})
    yield Door("friction_needed", friction_needed, lambda: {"run": run(), "weight": 1.0})
    yield Door("first_slip", first_slip, lambda: {"run": run(), "weight": 1.0, "mu": 0.3, "ends": False})
    yield Door("lagrange_dalembert", lagrange_dalembert, lambda: {"problem": slaved(), "dense": False})
    yield Door(
        "MechanicalSystem",
        system,
        lambda: {
            "names": ("x", "y"),
            "mass": np.eye(2),
            "potential": lambda q: q[1],
            "constraint": lambda q: [[q[1], 1.0]],
            "owners": ("wire",),
            "drive": 0.0,
            "force": None,
            "q": [0.0, 0.0],
            "v": [1.0, 0.0],
            "times": [0.0, 0.1],
        },
        weight=2,
        raises=(RuntimeError,),
    )
    # linkages
    yield Door(
        "Linkage",
        trailer,
        lambda: {
            "n": 4,
            "link_length": 0.5,
            "mass": 1.0,
            "heading_inertia": 0.2,
            "bending_stiffness": 1.0,
            "wheel": True,
            "mounting_angle": np.pi / 2,
            "stretch_compliance": 0.0,
            "shear_compliance": 0.0,
            "torsion_stiffness": 0.0,
            "spin_inertia": 0.0,
            "radius": 1.0,
            "rolling_drag": 0.0,
            "second_share": 0.5,
            "rest_curvature": 0.0,
            "force_x": 0.0,
            "force_y": 0.0,
            "held": (),
            "closed": False,
            "shift": (0.0, 0.0),
            "turns": 0,
        },
        lambda made: simulate(LinkageProblem(made, parked(), 0.1), dt=0.05, frames=1, progress=False),
        weight=3,
    )
    yield Door(
        "LinkageState",
        LinkageState,
        lambda: {"x": 0.5 * np.arange(4), "y": 0.0, "phi": np.pi / 2, "theta": 0.0, "x_rate": 0.0, "y_rate": 0.0, "phi_rate": 0.0},
        lambda made: simulate(LinkageProblem(trailer(), made, 0.1), dt=0.05, frames=1, progress=False),
    )
    yield Door("LinkageProblem", LinkageProblem, lambda: {"linkage": trailer(), "initial": parked(), "duration": 0.1})
    # fields and the comparison
    for kind in (continuum.untwisting_rod, continuum.rolling_rod, continuum.breathing_ring):
        yield Door(kind.__name__, kind, lambda: ROD | {"rolling": "field", "duration": 0.2}, on_scene)
    yield Door("steered_rod", continuum.steered_rod, lambda: ROD | OWN | {"duration": 0.2}, on_scene)
    yield Door("Rod", lambda **a: rod(continuum.Rod, **a), lambda: dict(ROD), on_scene)
    yield Door("SteeredRod", lambda **a: rod(continuum.SteeredRod, **a), lambda: ROD | OWN, on_scene)
    yield Door(
        "Scene",
        continuum.Scene,
        lambda: {
            "rod": continuum.Rod(**ROD),
            "initial": lambda s: (s, 0 * s, 0.1 * s, 0.5 + 0 * s),
            "duration": 0.2,
            "rolling": "field",
            "closed": False,
            "shift": (0.0, 0.0),
            "turns": 0,
            "name": "scene",
            "loads": (),
        },
        on_scene,
        weight=2,
    )
    yield Door(
        "solve",
        lambda **a: continuum.solve(**a, progress=False),
        lambda: {
            "scene": continuum.untwisting_rod(duration=0.2),
            "tol": 1e-2,
            "method": "leapfrog",
            "n": 6,
            "dt": None,
            "frames": 2,
            "want": (),
        },
        weight=2,
    )
    yield Door(
        "free_rod",
        lambda **a: continuum.free_rod(**a, progress=False, estimate=False),
        lambda: {
            "rod": continuum.Rod(**ROD),
            "r0": lambda s: np.array([s, 0 * s]),
            "v0": lambda s: np.array([0 * s, 0.1 * s]),
            "theta0": 0.1,
            "omega0": 0.2,
            "duration": 0.1,
            "n": 6,
            "dt": 0.05,
            "closed": False,
            "frames": 2,
        },
        weight=2,
    )
    yield Door(
        "lump", lump, lambda: {"scene": continuum.untwisting_rod(duration=0.2), "n": N, "ends": "springs", "degree": 1}, moved
    )
    yield Door(
        "convergence",
        lambda **a: convergence(**a, progress=False),
        lambda: {
            "scene": continuum.untwisting_rod(duration=0.1),
            "n": (5, 7),
            "ends": "springs",
            "field": None,
            "dt": 0.1,
            "method": "midpoint",
            "tol": 0.1,
            "degree": 1,
            "want": (),
        },
    )
    yield Door("sweep", in_process, lambda: {"function": _square, "cases": [1.0, 2.0], "archive": None}, len)
    # files and messages
    yield Door("save", saved, lambda: {"path": FOLDER / "run.nc"}, odd={"path": a_path}, weight=2)
    yield Door("load", load, lambda: {"path": FOLDER / "none.nc"}, odd={"path": a_path})
    yield Door("scene file", from_text, lambda: {"text": 'scene = "untwisting_rod"'}, odd={"text": scene_text}, weight=6)
    yield Door("lab", message, lambda: {"text": '{"kind": "reset"}'}, odd={"text": a_message}, weight=6)
    yield Door("run[...]", lambda key: run()[key], lambda: {"key": slice(0, 2)})
    yield Door("run.state", lambda frame: run().state(frame), lambda: {"frame": 1})
    yield Door("run.plot", lambda panel: len(run().plot(panel)), lambda: {"panel": "motion"})
