"""The cases of `compare.stability`: hard problems, and the result that is expected of each method."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from compare.hardcases.problems import (
    collapse,
    decay,
    every_other,
    folding,
    loaded,
    lumped,
    parasite,
    rough,
    rounding,
    torsion_wave,
    twisted,
    waves,
)
from compare.hardcases.runs import (
    CONSERVING,
    EXPLICIT,
    FIXED,
    GAUSS,
    PEERS,
    RADAU,
    TAKE_LOADS,
    USUAL_METHODS,
    Expectation,
    Found,
    motion,
)
from discs import Problem
from discs.loads import Damping, Motor, OnRod, Rest, Slope, Torque, signals


@dataclass(frozen=True)
class Case:
    """One hard case.

    name : the kind of difficulty. setting : size or parameters. what : why it is hard. expectation : see `Expectation`.
    run : function of a method and of the seconds that it may take; returns a `Found`. methods : those that run it.
    """

    name: str
    setting: str
    what: str
    expectation: Expectation
    run: Callable[[str, float], Found]
    methods: tuple[str, ...] = (*USUAL_METHODS, *PEERS)

    @property
    def key(self) -> str:
        """Name and setting, which identify the case."""
        return f"{self.name}, {self.setting}"


def cases(quick: bool = False) -> list[Case]:
    """All cases; only a few small ones if `quick`."""
    found: list[Case] = []

    def add(name: str, setting: str, what: str, expectation: Expectation, run: Callable[..., Found], **more: Any) -> None:
        found.append(Case(name, setting, what, expectation, run, **more))

    exactly = partial(Expectation, "exact", must=CONSERVING)
    bound = partial(Expectation, "bound", error=0.1)

    energy = exactly(
        "midpoint and its compositions keep the energy to 1e-10 at every step; explicit methods stop with an error", energy=1e-10
    )
    for n in (33, 129) if quick else (33, 129, 513, 1025):
        for multiple in (1, 8, 64) if quick else (1, 2, 4, 8, 16, 32, 64):
            end = (10.0 if quick else 40.0) * multiple * 4 / (n - 1)
            run = partial(motion, partial(twisted, n, duration=end), step=partial(_times_k, multiple), compared=False)
            what = "explicit methods need h < 0.6 k². Do implicit methods still keep the energy when h is far above k?"
            add("step above the explicit limit", f"N = {n}, h = {multiple} k", what, energy, run, methods=(*FIXED, *PEERS))

    for time, n in ((150, 33),) if quick else ((150, 33), (150, 129), (150, 513), (1500, 33), (1500, 129), (1500, 513)):
        words = "energy to 1e-10 if all steps converge; otherwise a warning"
        run = partial(motion, partial(twisted, n, duration=float(time)), compared=False)
        what = "the errors of all steps add up, and the motion amplifies them"
        add("long time", f"N = {n}, t = {time}", what, exactly(words, energy=1e-10, must=(*CONSERVING, *GAUSS)), run)

    for n, t in ((17, 45.0), (33, 45.0), (65, 10.0)) if quick else ((17, 60.0), (33, 60.0), (65, 20.0), (129, 10.0), (257, 5.0)):
        words = "the part of the velocity that violates the constraint stays below 0.1"
        what = "the two-step scheme constrains only the mean velocity of two steps; a mode that changes sign at every step is free"
        add("parasitic mode", f"N = {n}, t = {t:g}", what, bound(words), partial(parasite, n, t), methods=("leapfrog",))

    for rolling in ("field", "unit"):
        for n in (33,) if quick else (33, 129):
            words = "growth rates of all waves within 0.02 of the dispersion relation" + " (no growth)" * (rolling == "unit")
            what = "by the field law all waves grow, at rates up to ω√(β/K); by the unit law no wave grows"
            run = partial(waves, n, rolling, 0.7, 4.0)
            add(
                f"rolling straight rod, {rolling} law",
                f"N = {n}",
                what,
                bound(words, error=0.02, must=(*CONSERVING, *GAUSS)),
                run,
                methods=FIXED,
            )
    for n in (17, 33) if quick else (17, 33, 65, 129, 257):
        words = "a warning that the problem is ill posed; growth rates as in the dispersion relation, proportional to N"
        run = partial(waves, n, "field", 0.0, 20 / n, multiple=0.1)
        what = "without bending stiffness, short waves grow at unbounded rates, whatever the method"
        add(
            "limp rolling rod, field law",
            f"N = {n}",
            what,
            bound(words, error=0.02 * n, must=(*CONSERVING, *GAUSS), says="ill posed"),
            run,
            methods=FIXED,
        )

    for n in (32,) if quick else (32, 128):
        words = "stops before the heading is undefined; the error names the time and the disc"
        what = "the ring shrinks to a point, where r' = 0 and the heading is undefined"
        add(
            "collapsing ring, unit law",
            f"N = {n}",
            what,
            Expectation("must refuse", words, says="lost its heading"),
            partial(collapse, n),
        )

    for turns in (4, 16):
        run = partial(motion, partial(twisted, 65 if quick else 129, twist=float(turns)), note=folding)
        what = "64 and 1024 times the energy of the paper's motion: fast, and strongly folded"
        words = "energy to 1e-10; a warning if an error is above 10 %"
        add(
            "strong twist",
            f"{turns} turns, N = {65 if quick else 129}",
            what,
            bound(words, energy=1e-10, must=CONSERVING, aloud=True),
            run,
        )
    for n in (65,) if quick else (65, 513):
        what = "all waves of the chain are excited; most of them are too fast for the step"
        words = "energy to 1e-10"
        run = partial(motion, partial(rough, n, 4.5), compared=False)
        add("rough random roll", f"N = {n}", what, exactly(words, energy=1e-10), run)

    for setting, (scene, keywords) in EXTREMES.items():
        what = "no spin inertia, no torsion stiffness, very small or large bending stiffness, very large discs"
        words = "energy to 1e-9; a warning if an error is above 10 %"
        run = partial(motion, partial(lumped, scene, 33, **keywords))
        add("extreme parameters", setting, what, bound(words, energy=1e-9, must=CONSERVING, aloud=True), run)

    # at 7/8 of a period a wrong frequency shows; the phase error of midpoint with h < t/100 is omega^3 h^2 t/12 < 1.4e-3
    run = partial(motion, partial(twisted, 33, radius=0.0, duration=7.8), exact=torsion_wave)
    words = "the line stays at rest, and the twist agrees with the exact standing wave to 2e-3; energy to 1e-3"
    still = Expectation("exact", words, energy=1e-3, error=2e-3, must=USUAL_METHODS)
    add("extreme parameters", "R = 0", "discs of radius 0 stay where they are: only a torsion wave remains", still, run)

    few = "few discs", "a chain needs at least one bend"
    add(few[0], "N = 3", few[1], exactly("energy to 1e-12", energy=1e-12, error=0.1), partial(motion, partial(twisted, 3)))
    two = partial(motion, partial(lumped, "steered_rod", 2))
    able = tuple(m for m in (*USUAL_METHODS, *PEERS) if not quick or m not in EXPLICIT)  # quick: no kernels for one case
    add(few[0], "own headings, N = 2", few[1], exactly("energy to 1e-10", energy=1e-10, error=0.1), two, methods=able)
    refused = Expectation("must refuse", "a ValueError that says how many discs are needed", says="at least")
    add(few[0], "N = 2", few[1], refused, partial(motion, partial(twisted, 2)))
    add(few[0], "own headings, N = 1", few[1], refused, partial(motion, partial(lumped, "steered_rod", 1)))

    for n in (257, 1025) if quick else (257, 1025, 4097, 16_385):
        what = "forces are fourth differences: rounding of plain doubles gives errors of 1e-3 at N = 4097"
        words = "the same motion, moved and turned in the plane, agrees to 1e-6"
        run = partial(rounding, partial(twisted, n, duration=0.5 if quick else 4.5), 0.01)
        add("rounding", f"N = {n}", what, exactly(words, energy=1e-9, error=1e-6), run, methods=(*FIXED, *PEERS))

    for setting, (what, n, loads) in LOADED.items():
        words = "energy − work + dissipated energy is constant to 1e-10 of the largest of the three"
        run = partial(motion, partial(loaded, n, *loads, duration=1.0 if quick else 4.5), compared=False)
        able = tuple(m for m in TAKE_LOADS if m != "rk4" or not any(isinstance(load, Motor) for load in loads))
        add("loads", f"{setting}, N = {n}", what, exactly(words, energy=1e-10), run, methods=able)

    what = "random initial rates and viscous torsion: modes decay at rates up to 1e4, much faster than one step can resolve"
    words = "by Radau methods, rates at the end within 1e-3 of the largest initial rate; other methods oscillate, and warn"
    damped = Expectation("bound", words, energy=0.05, error=1e-3, must=RADAU)
    implicit = tuple(m for m in TAKE_LOADS if m != "rk4")
    add("fast decay", "N = 33, h = 0.1", what, damped, partial(decay, 33, 100.0, 0.1), methods=implicit)

    run = partial(motion, partial(twisted, 65, duration=9.0, twist=1.0), note=folding)
    words = "the equations stay valid: energy to 1e-10 (real discs would touch, see discs.mechanics.contact)"
    add(
        "folded line",
        "N = 65, 1 turn, t = 9",
        "R|κ| exceeds 1: neighbouring discs would overlap",
        exactly(words, energy=1e-10),
        run,
    )
    return found


LOADED: dict[str, tuple[str, int, tuple[OnRod, ...]]] = {
    "stiff damping": (
        "damping rates of 1e6, much faster than one step can resolve",
        33,
        (Damping(rolling=30.0, torsion=1e3),),
    ),
    "resonance": (
        "a torque at the frequency of the longest torsion wave, 0.5 rad per unit of time",
        33,
        (Torque(0.5, signals.sine(1.0, 0.5), at=0.0),),
    ),
    "a motor that reverses": (
        "the rate of roll of the first disc is prescribed, and changes its sign five times",
        17,
        (Motor(signals.sine(1.0, 4.0), at=0.0),),
    ),
    "a fast signal": (
        "a torque that changes its sign several times within a step",
        33,
        (Torque(3.0, signals.sine(1.0, 300.0), at=0.0),),
    ),
    "an actuator with the shortest wave": (
        "the rest twist of neighbouring links has opposite signs, and oscillates",
        33,
        (Rest(twist=partial(every_other, k=4 / 32), signal=signals.sine(1.0, 20.0)),),
    ),
    "strong slope": (
        "the rod falls by more than twenty times its length",
        33,
        (Slope(gx=10.0, gy=-5.0),),
    ),
}
EXTREMES: dict[str, tuple[str, dict[str, Any]]] = {
    "α = 1e-9": ("untwisting_rod", {"spin_inertia": 1e-9}),
    "α = 0": ("untwisting_rod", {"spin_inertia": 0.0}),
    "β = 0, a ring": ("breathing_ring", {"torsion_stiffness": 0.0}),
    "K = 1e-6": ("untwisting_rod", {"bending_stiffness": 1e-6}),
    "K = 1e6": ("untwisting_rod", {"bending_stiffness": 1e6}),
    "R = 100": ("untwisting_rod", {"radius": 100.0}),
}


def _times_k(multiple: float, problem: Problem) -> float:
    return multiple * problem.chain.k
