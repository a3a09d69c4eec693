"""What the public functions are given by the fuzzer, right or nearly right, and what is done with their results."""

import atexit
import json
import random
import shutil
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import continuum
from compare import lump, sweep
from compare.lab.messages import NEEDED, OPTIONAL, parsed
from compare.lab.session import Session
from compare.lab.settings import Settings
from continuum.files import read_scene
from discs import (
    Chain,
    Linkage,
    LinkageState,
    MechanicalSystem,
    Problem,
    Solution,
    State,
    SteeredChain,
    load,
    loads,
    simulate,
)

N = 6
FOLDER = Path(tempfile.mkdtemp(prefix="discs-fuzz-"))
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)
ROD = {
    "length": 3.1,
    "density": 1.3,
    "spin_inertia": 0.6,
    "torsion_stiffness": 0.9,
    "bending_stiffness": 0.8,
    "radius": 0.7,
}
OWN = {"heading_inertia": 0.3, "stretch_stiffness": 9.0, "shear_stiffness": 7.0}
S = np.linspace(0.0, 3.1, N)


@cache
def slaved(loads_: tuple[Any, ...] = ()) -> Problem:
    """Six discs, slaved headings."""
    return Problem(Chain(n=N, **ROD), State(S, 0.02 * S**2, 0.1 * S**2, 0.5), 0.2, loads_)


def steered() -> Problem:
    """Six discs with own headings."""
    return Problem(SteeredChain(n=N, **ROD, **OWN), State(S, 0 * S, 0.1 * S**2, 0.5, 0.1 * S, 0.1), 0.2)


def still() -> Problem:
    """Six discs at rest, straight."""
    return Problem(Chain(n=N, **ROD), State(S, 0 * S, 0 * S), 0.2)


def trailer(**given: Any) -> Linkage:
    """A linkage with rigid links."""
    usual = {"n": 4, "link_length": 0.5, "mass": 1.0, "heading_inertia": 0.2, "bending_stiffness": 1.0, "mounting_angle": np.pi / 2}
    return Linkage(**usual | given)


def parked() -> LinkageState:
    """Of `trailer`, straight and at rest."""
    return LinkageState(0.5 * np.arange(4), 0.0, np.pi / 2)


@cache
def run() -> Solution:
    """A short run with the ground's force."""
    return simulate(slaved(), dt=0.05, frames=3, want=("contact_force",), progress=False, engine="plain")


def moved(problem: Problem) -> Solution:
    """Two steps."""
    return simulate(problem, dt=0.1, frames=[0.2], progress=False, engine="plain")


def with_load(given: Any) -> Any:
    """A load or motor is used on both chains."""
    for of in (slaved, steered):
        problem = of()
        try:
            result = moved(Problem(problem.chain, problem.initial, problem.duration, (given,)))
        except ValueError as error:
            if of is slaved and "own heading" not in str(error):
                raise
    return result


def with_signal(signal: Any) -> Any:
    return moved(Problem(slaved().chain, slaved().initial, 0.2, (loads.Torque(0.3, signal),)))


def with_event(event: Any) -> Any:
    return simulate(slaved(), "midpoint", dt=0.1, frames=2, events=[event], progress=False, engine="plain")


def on_scene(scene: Any) -> Any:
    """A scene is lumped and run."""
    return moved(lump(scene, N))


def rod(kind: Any, **given: Any) -> Any:
    """A rod in a scene, on which its functions are called."""
    own = kind is continuum.SteeredRod
    made = kind(**given)

    def initial(s: Any) -> tuple[Any, ...]:
        return (s, 0 * s, 0.1 * s, 0.5 + 0 * s, 0 * s, 0 * s) if own else (s, 0 * s, 0.1 * s, 0.5 + 0 * s)

    return continuum.Scene(rod=made, initial=initial, duration=0.2, rolling="unit" if own else "field")


def message(text: Any) -> Any:
    """A message of a page to the lab, and whether the lab still lives. A refusal is an answer that names the field."""
    lab = Session(Settings(n=5, dt=0.02), clock=lambda: 0.0)
    for reply in lab.handle(parsed(text)):
        if reply.content["kind"] == "refused":
            raise ValueError(str(reply.content))
        json.dumps(reply.content, allow_nan=False)
    if not any(reply.content["kind"] == "frame" for reply in lab.handle({"kind": "advance", "time": 0.02})):
        raise AssertionError("the lab does not go on")
    return True


def a_message(rng: random.Random) -> str:
    """A message that is nearly right."""
    kind = rng.choice(list(NEEDED))
    said: dict[str, Any] = {"kind": kind}
    values = [0, 1, -1, 0.5, 3, 1e6, -1e6, 1e308, 10**400, True, None, "", "x", "forward", ".nc", "python", "unit", "own", [], {}]
    values += ["omega", "radius", "twist", "steered_rod", "consistent", "ring", "RK45", "leapfrog", "gauss4", 1e-5, 1025, 2]
    for name in NEEDED[kind] | OPTIONAL.get(kind, {}):
        if rng.random() < 0.8:
            said[name] = rng.choice(values)
    text = json.dumps(said)
    if rng.random() < 0.2:
        text = text[: rng.randrange(len(text))]
    return text if rng.random() < 0.9 else rng.choice(["[]", "null", "NaN", "[" * 3000, '{"kind": 3}', '{"kind": NaN}', "x" * 5000])


def saved(path: Any) -> Any:
    """A run is saved there and, if it was an archive, read again."""
    run().save(path)
    return load(path) if str(path).endswith((".nc", ".h5")) else True


def a_path(rng: random.Random) -> Any:
    """A path that may not be."""
    name = rng.choice(["run", "", ".", "..", "no/such/run", "\x00", "a" * 300, "CON", "run\n", "/dev/full", "/dev/null"])
    ending = rng.choice(["", ".nc", ".csv", ".vtkhdf", ".xyz", ".NC", ".nc.nc", ".h5", ".png"])
    return rng.choice([str(FOLDER / name) + ending, FOLDER / (name.replace("\x00", "") + ending), 3, None, b"run.nc", []])


def scene_text(rng: random.Random) -> str:
    """A scene file that is nearly right."""
    lines = ['scene = "untwisting_rod"', "duration = 0.2"]
    values = ["1.0", "-1", "0", "nan", "inf", "1e300", '"x"', "true", "[]", "[1.0, 2.0]", "{}", "1979-05-27", "{ name = 3 }"]
    values += ['{ name = "polynomial", coefficients = [] }', '{ name = "table", s = [0.0], values = [1.0, 2.0] }']
    values += ['{ name = "table", file = "none.csv" }', '{ name = "sine", amplitude = 1.0, rate = 2.0 }', '"unit"', '"own"']
    keys = ["length", "density", "radius", "rolling", "twist", "duration", "curvature", "stretch_stiffness", "nonsense", "loads"]
    for key in rng.sample(keys, rng.randrange(3)):
        lines = [line for line in lines if not line.startswith(key)] + [f"{key} = {rng.choice(values)}"]
    if rng.random() < 0.5 and not any(line.startswith("loads") for line in lines):
        kind = rng.choice(["Torque", "Force", "Spring", "Damping", "Rest", "Motor", "Slope", "Custom", "Nothing", "Linear"])
        lines += ["[[loads]]", f'load = "{kind}"']
        names = ["pattern", "x", "y", "at", "signal", "stiffness", "rolling", "twist", "rate", "about", "gx"]
        lines += [f"{name} = {rng.choice(values)}" for name in rng.sample(names, rng.randrange(4))]
    return "\n".join(lines)


def from_text(text: Any) -> Any:
    path = FOLDER / "scene.toml"
    path.write_text(text if isinstance(text, str) else repr(text), encoding="utf-8")
    return on_scene(read_scene(path))


def system(**given: Any) -> Any:
    """A particle on a slope, as a system of one's own."""
    usual: dict[str, Any] = {"q": [0.0, 0.0], "v": [1.0, 0.0], "times": [0.0, 0.1]} | given
    q, v, times = (usual.pop(name) for name in ("q", "v", "times"))
    made = MechanicalSystem.from_lagrangian(**{"names": ("x", "y"), "mass": np.eye(2), "potential": lambda q: q[1]} | usual)
    return made.integrate(q, v, times, progress=False)


def _square(case: Any) -> Any:
    return case


def in_process(function: Any, cases: Any, archive: Any) -> Any:
    """A sweep in this process."""
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(1) as pool:
        return sweep(function, cases, executor=pool, archive=archive, progress=False)
