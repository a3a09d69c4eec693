"""Random scenes that vary along the rod and carry loads: `loaded(random_scene(seed, index), seed, index)`."""

from dataclasses import replace
from typing import Any

import numpy as np

from compare.random_scenes import PARAMETERS, Drawn, Function, between, series
from discs.arrays import Float
from discs.loads import Damping, OnRod, Rest, Slope, Torque, signals

LONGEST = 6.0  # time: what drives a rod for longer makes it chaotic
DEPTH = 0.4  # largest relative amplitude of a parameter
SHARE = 0.5  # of parameters that vary, and of loads that are there


def loaded(drawn: Drawn, seed: int, index: int) -> Drawn:
    """The scene with some parameters as waves along the rod, and with some loads; the same on every machine.

    Signals start smoothly. Waves have no slope at free ends, so that initial fields fit as before.
    """
    rng, scene = np.random.default_rng([seed, index, 3]), drawn.scene
    length, closed = scene.rod.length, scene.closed
    names = [name for name in PARAMETERS if rng.random() < SHARE]
    varying: dict[str, Any] = {name: _wave(rng, length, closed, float(getattr(scene.rod, name))) for name in names}
    duration = min(scene.duration, LONGEST)
    start = signals.smooth(0.0, between(rng, 0.2, 1.0) * duration)
    every: tuple[OnRod, ...] = (
        Torque(series(rng, length, closed, between(rng, 0.02, 0.4)), start),
        Damping(rolling=between(rng, 0.01, 1.0), torsion=between(rng, 0.01, 0.5)),
        Slope(*(rng.choice([-1.0, 1.0], 2) * rng.uniform(0.02, 0.2, 2)).tolist()),
        Rest(twist=series(rng, length, closed, between(rng, 0.02, 0.3)), signal=start),
    )
    loads = tuple(load for load in every if rng.random() < SHARE)
    words = [f"varying {', '.join(names)}"] * bool(names) + [type(load).__name__ for load in loads]
    scene = replace(scene, rod=replace(scene.rod, **varying), loads=loads, duration=duration)
    return drawn._replace(scene=scene, words=", ".join([drawn.words, *words]))


def _wave(rng: np.random.Generator, length: float, closed: bool, mean: float) -> Function:
    depth, q = rng.uniform(0.1, DEPTH) * rng.choice([-1.0, 1.0]), np.pi * rng.integers(1, 4) * (1 + closed) / length

    def values(s: Float) -> Float:
        found: Float = mean * (1 + depth * np.cos(q * s))
        return found

    return values
