"""Values that NumPy could convert to a number, as truth values or text, are refused by every public function."""

import datetime
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from compare import lump
from continuum import Rod, Scene, SteeredRod, breathing_ring, free_rod, rolling_rod, solve, steered_rod, untwisting_rod
from continuum.files import read_scene
from continuum.scenes import PAPER
from discs import Chain, Gauss6, Midpoint, Problem, State, SteeredChain, checks, first_slip, simulate
from discs.chains.twist import untwisting_chain
from discs.mechanics.oscillators import contact_oscillator, driven_oscillator
from discs.mechanics.textbook import chaplygin_sleigh, knife_edge, rolling_disc
from discs.running.frames import frame_times

OWN = {"heading_inertia": 0.3, "stretch_stiffness": 4.0, "shear_stiffness": 3.0}
LINE = np.arange(5.0)
PLACES = dict.fromkeys(("x", "y", "theta"), LINE)
SMALL = untwisting_chain(5, duration=0.3)
ROD = Rod(**PAPER | {"radius": 0.0})
PLAIN = {"engine": "plain", "progress": False, "frames": 2}
FORCED = simulate(SMALL, dt=0.1, frames=2, want="contact_force", engine="plain", progress=False)
SKATE = {"mass": 1.0, "inertia": 1.0, "slope": 1.0, "speed": 1.0, "turn_rate": 1.0}
OSCILLATOR = {
    "mass": 1,
    "stiffness": 1,
    "driver_mass": 1,
    "driver_stiffness": 1,
    "width": 1,
    "q": [1, 1, 1],
    "speed": 1,
    "drift": 1,
}

HUGE = [10**400, -(10**5000), Fraction(10**400), Decimal("1e400"), np.longdouble("1e4000")]
ODD = [True, np.True_, "1", b"1", np.str_("1"), 1j, 1 + 0j, np.complex128(1), np.datetime64(1, "s"), np.timedelta64(1, "s")]
ODD += [
    datetime.timedelta(1),
    datetime.date(2020, 1, 1),
    {},
    object(),
    np.ma.masked,
    np.ma.masked_array(1.0, mask=True),
    np.array(True),
]
BAD = [*HUGE, *ODD, np.nan, np.inf]

NUMBERS = {
    **{f"Chain {name}": lambda v, name=name: Chain(n=5, **PAPER | {name: v}) for name in PAPER},
    **{f"SteeredChain {name}": lambda v, name=name: SteeredChain(n=5, **PAPER | OWN | {name: v}) for name in OWN},
    **{f"Rod {name}": lambda v, name=name: Rod(**PAPER | {name: v}) for name in PAPER},
    **{f"SteeredRod {name}": lambda v, name=name: SteeredRod(**PAPER | OWN | {name: v}) for name in OWN},
    **{
        f"State {name}": lambda v, name=name: State(**dict.fromkeys(("x", "y", "theta"), LINE) | {name: v})
        for name in ("x", "omega")
    },
    "Chain shift": lambda v: Chain(n=5, **PAPER, ends="ring", shift=(v, 0.0)),
    "Problem duration": lambda v: Problem(SMALL.chain, SMALL.initial, v),
    "Scene duration": lambda v: Scene(rod=ROD, initial=lambda s: (s, s, s, s), duration=v),
    "Scene initial": lambda v: lump(Scene(rod=ROD, initial=lambda s: (s, 0 * s, v, 0 * s), duration=1.0), 5),
    "twist": lambda v: untwisting_rod(twist=v),
    "steered twist": lambda v: steered_rod(twist=v),
    "rolling omega": lambda v: lump(rolling_rod(omega=v), 5),
    "rolling amplitude": lambda v: lump(rolling_rod(amplitude=v), 5),
    "ring omega": lambda v: lump(breathing_ring(omega=v), 5),
    "untwisting_chain twist": lambda v: untwisting_chain(5, twist=v),
    "dt": lambda v: simulate(SMALL, dt=v, **PLAIN),
    "tol": lambda v: simulate(SMALL, tol=v, **PLAIN),
    "field tol": lambda v: solve(untwisting_rod(duration=0.1), tol=v, progress=False),
    "tolerance": lambda v: Midpoint(tolerance=v),
    "free duration": lambda v: free_rod(ROD, lambda s: (s, 0 * s), lambda s: (0 * s, 0 * s), 0, 0, v, 5, 0.1),
    "free dt": lambda v: free_rod(ROD, lambda s: (s, 0 * s), lambda s: (0 * s, 0 * s), 0, 0, 0.1, 5, v),
    "free omega0": lambda v: free_rod(ROD, lambda s: (s, 0 * s), lambda s: (0 * s, 0 * s), 0, v, 0.1, 5, 0.1),
    "weight": lambda v: first_slip(FORCED, v, 1.0, ends=True),
    **{f"knife_edge {name}": lambda v, name=name: knife_edge(**SKATE | {name: v}) for name in SKATE},
    "knife_edge heading": lambda v: knife_edge(**SKATE, heading=v),
    "sleigh heading": lambda v: chaplygin_sleigh(1.0, 1.0, 1.0, speed=1.0, turn_rate=1.0, heading=v),
    "driven skew": lambda v: driven_oscillator(1.0, 1.0, 1.0, 1.0, v, q=[1, 1, 1], speed=1.0, drift=9.0),
    "sleigh speed": lambda v: chaplygin_sleigh(1.0, 1.0, 1.0, speed=v, turn_rate=1.0),
    "rolling_disc roll_rate": lambda v: rolling_disc(1.0, 1.0, 1.0, 1.0, roll_rate=v, turn_rate=1.0),
    "rolling_disc slope": lambda v: rolling_disc(1.0, 1.0, 1.0, 1.0, roll_rate=1.0, turn_rate=1.0, slope=v),
    **{
        f"oscillator {name}": lambda v, name=name: contact_oscillator(**OSCILLATOR | {name: v})
        for name in OSCILLATOR
        if name != "q"
    },
}
SIZES = {
    "Chain n": lambda v: Chain(n=v, **PAPER),
    "lump n": lambda v: lump(untwisting_rod(), v),
    "sweeps": lambda v: Midpoint(sweeps=v),
    "gauss sweeps": lambda v: Gauss6(sweeps=v),
    "frames": lambda v: simulate(SMALL, dt=0.1, frames=v, engine="plain", progress=False),
    "turns": lambda v: SteeredChain(n=5, **PAPER | OWN, ends="ring", turns=v),
    "mode": lambda v: rolling_rod(mode=v),
    "leapfrog n": lambda v: solve(untwisting_rod(), method="leapfrog", n=v, progress=False),
}
ARRAYS = {
    "density": lambda v: Chain(n=5, **PAPER | {"density": v}),
    "State x": lambda v: State(v, LINE, LINE),
    "State phi_rate": lambda v: State(LINE, LINE, LINE, 0.0, LINE, v),
    "initial": lambda v: Scene(rod=ROD, initial=lambda s: (s, 0 * s, v, 0 * s), duration=1.0).fields(LINE),
    "frames": lambda v: frame_times(v, 5.0),
    "omega0": lambda v: free_rod(ROD, lambda s: (s, 0 * s), lambda s: (0 * s, 0 * s), 0, v, 0.1, 5, 0.1, progress=False),
    "vector": lambda v: checks.vector("q", v, 5),
    "mu": lambda v: first_slip(FORCED, 1.0, v, ends=True),
}
FIVE = [0.5, 1.0, 1.5, 2.0, 2.5]


def refused(door, value):
    with pytest.raises(ValueError, match=r"must|needs") as told:
        door(value)
    assert len(str(told.value)) < 400


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("door", NUMBERS)
def test_no_numbers(door):
    for value in BAD:
        refused(NUMBERS[door], value)


@pytest.mark.parametrize("door", SIZES)
def test_no_sizes(door):
    for value in (
        10**30,
        10**400,
        2**53 + 1,
        5.0,
        np.float64(5),
        True,
        np.True_,
        "5",
        np.ma.masked_array(5, mask=True),
        np.array(True),
    ):
        refused(SIZES[door], value)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("door", ARRAYS)
def test_no_arrays_of_numbers(door):
    masked = np.ma.masked_array(FIVE, mask=[0, 1, 0, 0, 0])
    dates = np.arange(1, 6).astype("m8[s]")
    lists = [[*FIVE[:4], value] for value in (True, "2.5", 2.5 + 0j, None, 10**400, np.ma.masked, np.datetime64(3, "s"))]
    arrays = [
        masked,
        np.array(FIVE) + 0j,
        np.array(FIVE) + 1j,
        np.array(FIVE).astype(str),
        np.ones(5, bool),
        dates,
        dates + np.datetime64(0, "s"),
    ]
    for value in (*lists, *arrays, np.array(lists[3]), np.array([[1, 2], 3], dtype=object)):
        refused(ARRAYS[door], value)


@pytest.mark.parametrize("door", ARRAYS)
@pytest.mark.parametrize(
    "value",
    [tuple(FIVE), np.float32(FIVE), np.array(FIVE, object), [Fraction(k, 2) for k in range(1, 6)], [Decimal(1), 2, 3, 4, 5],
     range(1, 6), np.ma.masked_array(FIVE), np.arange(1, 6, dtype=np.int8), [np.array(v) for v in FIVE]],
    ids=lambda value: type(value).__name__,
)  # fmt: skip
def test_arrays_of_numbers(door, value):
    ARRAYS[door](value)


def test_numbers():
    for value in (2, 2.0, np.float32(2), np.int8(2), np.array(2), np.array(2.0), Fraction(2), Decimal(2), np.ma.masked_array(2.0)):
        assert Rod(**PAPER | {"length": value}).length == 2.0
        assert Chain(n=5, **PAPER | {"density": value}).density.tolist() == [2.0] * 5
    for value in (5, np.int16(5), np.array(5), np.uint64(5)):
        assert type(Chain(n=value, **PAPER).n) is int


def test_long_steps_and_durations():
    for dt in (1e300, 1e154, 10**300):
        with pytest.raises(ValueError, match="dt must be at most the duration"):
            simulate(SMALL, dt=dt, **PLAIN)


@pytest.mark.parametrize("duration", [0.3, 1.1, 1e-9, 3e12])
def test_times_outside_by_rounding(duration):
    over, under = np.nextafter(duration, np.inf), -np.spacing(duration)
    times = frame_times([under, duration / 2, over], duration)
    assert times.tolist() == [0.0, duration / 2, duration]
    np.testing.assert_array_equal(frame_times(np.arange(0, 0.35, 0.1), 0.3), [0.0, 0.1, 0.2, 0.3])
    for far in ([0.0, duration * (1 + 1e-9)], [-1e-9 * duration, duration], [over, 2 * duration], [duration, over]):
        with pytest.raises(ValueError, match="frames must be increasing times within"):
            frame_times(far, duration)


def test_scene_files(tmp_path):
    path = tmp_path / "scene.toml"
    for value in ("true", '"1"', "1979-05-27", "07:32:00", "[1.0]", "nan", "inf", "1" + "0" * 400, "1" + "0" * 5000, "{}"):
        path.write_text(f'scene = "untwisting_rod"\nlength = {value}\n')
        with pytest.raises(ValueError, match=r"length must be a positive finite number; got|is not TOML"):
            read_scene(path)


def test_what_was_given_stays_short():
    for value in (
        10**400,
        -(10**100_000),
        "x" * 10_000,
        [1.5] * 10_000,
        np.zeros(10_000) + 0j,
        {k: k for k in range(999)},
        object(),
    ):
        assert len(checks.shown(value)) < 200
        assert "\n" not in checks.shown(value)
    assert checks.shown(-(10**400)) == "a negative whole number of 401 digits"
