"""Odd arguments are refused in words: a short part of `python -m tests.fuzz`, and what it has found."""

import numpy as np
import pytest

import continuum
from compare import convergence, lump, sweep
from compare.lab.session import Session
from compare.lab.settings import Settings
from discs import (
    Chain,
    LinkageProblem,
    LinkageState,
    MechanicalSystem,
    Problem,
    State,
    checks,
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
from discs.analysis import gradient, growth, horizon, lyapunov
from discs.events import FrictionExceeded, Line, Touch
from discs.files.results import Archive, read, record
from discs.running.outcome import from_data
from tests.fuzz.__main__ import FAULT, answers
from tests.fuzz.made import ROD, N, S, parked, run, slaved, still, trailer, with_event, with_load

RAGGED = [[1.0], [2.0, 3.0]]
TWO = np.array([1.0, 2.0])


def plain(problem=None, **given):
    return simulate(problem or slaved(), **{"dt": 0.1, "frames": 2, "progress": False, "engine": "plain"} | given)


def many(problems=None, **given):
    problems = [slaved()] if problems is None else problems
    return simulate_many(problems, **{"dt": 0.1, "progress": False, "engine": "plain"} | given)


def of(**given):
    return gradient(slaved(), **{"cost": lambda run: run.y[-1, 0], "wrt": "radius", "dt": 0.1, "engine": "plain"} | given)


def linkage(**given):
    return simulate(LinkageProblem(trailer(), parked(), 0.1), **{"dt": 0.05, "progress": False} | given)


def linkage_of(state):
    return LinkageProblem(trailer(), state, 0.1)


def from_lagrangian(**given):
    return MechanicalSystem.from_lagrangian(**{"names": "x", "mass": np.eye(1), "potential": lambda q: q[0]} | given)


def huge(**given):
    return Problem(Chain(n=N, **ROD | given), State(S, 0.1 * S**2, S), 0.2)


@pytest.mark.filterwarnings("default")
def test_odd_arguments():
    """Each gives a result or an error in words; NumPy's own errors and warnings are faults."""
    found = list(answers(seed=1, count=80))
    assert not [answer for answer in found if answer.kind == FAULT]
    assert len(found) == 80


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: suggest_dt(RAGGED), "problem must be a Problem, as"),
        (lambda: lagrange_dalembert(3), "problem must be a Problem, as"),
        (lambda: lagrange_dalembert(slaved(), dense=TWO), "dense must be True or False"),
        (lambda: Problem(slaved().chain, 3.7, 0.2), "initial must be a State"),
        (lambda: Problem("chain", slaved().initial, 0.2), "chain must be a Chain or a SteeredChain; got 'chain'"),
        (lambda: plain(events=TWO), "events must be functions of a Moment"),
        (lambda: plain(method=TWO), "method must be one of"),
        (lambda: plain(method=""), "method must be one of"),
        (lambda: plain(engine=""), "engine must be one of"),
        (lambda: plain(want=np.array([])[:, None]), None),
        (lambda: plain(want=3), "want must be names of quantities; got 3"),
        (lambda: plain(checkpoint=True), "checkpoint must be the path of a file, a text or a Path; got True"),
        (lambda: next(steps(slaved(), engine="", dt=0.1)), "engine must be one of"),
        (lambda: many(3.0), "problems must be problems, as"),
        (lambda: many(want=0), "want must be names of quantities; got 0"),
        (lambda: many(executor=1j), "executor must have a method submit"),
        (lambda: many(method=TWO), "method must be one of"),
        (lambda: many(checkpoint=[]), "checkpoint must be the path of a file"),
        (lambda: linkage(want=1), "want must be names of quantities; got 1"),
        (lambda: linkage(method=TWO), "a linkage runs by 'midpoint'"),
        (lambda: trailer(held=3.0), "held must be pairs"),
        (lambda: trailer(closed=TWO), "closed must be True or False"),
        (lambda: of(wrt=True), "wrt must be names of parameters; got True"),
        (lambda: of(wrt=np.ones((2, 2))), "wrt must be names among"),
        (lambda: of(cost=3.0), "cost must be a function of a run; got 3.0"),
        (lambda: of(cost_gradient=3.0), "cost_gradient must be a function of a run; got 3.0"),
        (lambda: of(cost=lambda run: 1 / 0), "the cost raised ZeroDivisionError"),
        (lambda: load(b"run.nc"), "path must be the path of a file, a text or a Path; got b'run.nc'"),
        (lambda: linkage_of(LinkageState(0.5 * np.arange(4), 0.0, np.pi / 2, x_rate=1e200)), "the initial energy is too large"),
        (lambda: of(cost_gradient=lambda: 3.0), "cost_gradient raised TypeError"),
        (lambda: of(cost_gradient=lambda run: {"y": np.ones(9)}), r"y of cost_gradient must be finite numbers of shape \(1, 6\)"),
        (lambda: of(cost_gradient=lambda run: {"y": np.nan * run.y}), r"y of cost_gradient must be finite numbers of shape"),
        (lambda: lyapunov(slaved(), dt=0.01, every=1, seed=-1.5), "seed must be a whole number"),
        (lambda: friction_needed(3.0, 1.0), r"run must be a run with want=\(\"contact_force\",\)"),
        (lambda: first_slip(run(), 1.0, 0.3, ends=TWO), "ends must be True or False"),
        (lambda: FrictionExceeded(RAGGED, 1.0), "mu must be a positive finite number"),
        (lambda: Line((0, 0), (1, 0), disc=0.5), "disc must be a whole number; got 0.5"),
        (lambda: Line((0, 0), (1, 0), direction=2), "direction must be 1, from below only, -1"),
        (lambda: Line((0, 0), (1, 0), terminal="no"), "terminal must be True or False"),
        (lambda: Touch("x", 1, 0.1), "one must be a whole number; got 'x'"),
        (lambda: with_event(Line((0, 0), (1, 0), disc=9)), "disc must be one of the 6 discs, 0 to 5; got 9"),
        (lambda: with_event(Touch(0, 9, 0.1)), "disc must be one of the 6 discs, 0 to 5; got 9"),
        (lambda: with_event(FrictionExceeded(0.3, 1.0, disc=9)), "disc must be one of the 6 discs, 0 to 5; got 9"),
        (lambda: loads.Linear(offset={}), "offset of Linear must be a finite number"),
        (lambda: loads.Linear(floor=[1.0]), "floor of Linear must be a finite number"),
        (lambda: loads.Linear(constant=lambda s: s), "constant of Linear must be finite numbers"),
        (lambda: loads.Linear(damping=1j), "damping of Linear must be finite numbers; got 1j"),
        (lambda: loads.Linear(np.zeros((3, 6)), viscosity="x"), "viscosity of Linear must be finite numbers"),
        (lambda: loads.Linear(np.zeros((3, 6)), viscosity=[]), r"viscosity must be .* of shape \(1, 7\); got array"),
        (lambda: with_load(loads.Custom(lambda t, q, v: 0 * q, per_length=TWO)), "per_length of Custom must be True or False"),
        (lambda: with_load(loads.Rest(shear=RAGGED)), "shear is for discs with headings of their own"),
        (lambda: with_load(loads.Torque(RAGGED, at=0.0)), "pattern of Torque with at= must be a finite number"),
        (lambda: from_lagrangian(names=3), "names must be names; got 3"),
        (
            lambda: from_lagrangian(potential=lambda q: 1 / 0).integrate([0.0], [0.0], [0.0, 1.0]),
            r"V\(q\) raised ZeroDivisionError",
        ),
        (lambda: lump(continuum.untwisting_rod(), 6, degree=TWO), "degree must be a whole number"),
        (lambda: convergence(continuum.untwisting_rod(), field=3.0), "field must be solve"),
        (lambda: convergence(continuum.untwisting_rod(), want=3), "want must be names of quantities"),
        (lambda: sweep(3, [1]), "function must be a function of a case; got 3"),
        (lambda: sweep(abs, 3), "cases must be cases, as a list of numbers; got 3"),
        (lambda: sweep(abs, [1], executor=TWO), "executor must have a method submit"),
        (lambda: sweep(abs, [1], archive=RAGGED), "archive must be the path of a file"),
        (lambda: Chain(n=6, **ROD | {"radius": np}), "radius must be a number or 6 numbers; got <module 'numpy'"),
    ],
)
def test_found(call, message):
    """Each of these gave an error of NumPy's or Python's own that named no argument, or was taken for something else."""
    if message is None:
        call()
        return
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"radius": 1e200}, r"the largest of what is given is radius, up to 1e\+200: change units"),
        ({"bending_stiffness": 1e308}, "is bending_stiffness, up to"),
    ],
)
def test_what_overflows_is_refused(given, message):
    """Without a warning of NumPy's, which would fail the test."""
    with pytest.raises(ValueError, match=message):
        huge(**given)


@pytest.mark.parametrize(
    "call",
    [
        lambda: growth(slaved(), dt=1e-300),
        lambda: horizon(slaved(), 1e-3, dt=1e-310),
        lambda: lyapunov(slaved(), dt=1e-300),
        lambda: of(dt=1e-310),
        lambda: linkage(dt=1e-310),
        lambda: next(steps(slaved(), dt=1e-310)),
    ],
)
def test_more_steps_than_can_be_counted(call):
    with pytest.raises(ValueError, match=r"dt = 1e-3.0 makes .* steps to t = .*, more than can be counted"):
        call()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Chain(n=2**50, **ROD), "n = 1125899906842624 discs: 1.44e[+]08 GB are needed, and this machine has 8 GB"),
        (lambda: trailer(n=2**50), "n = 1125899906842624 nodes: .* GB are needed"),
        (lambda: plain(frames=2**40), "frames = 1099511627776: 8.8e[+]03 GB are needed"),
        (lambda: lyapunov(slaved(), dt=1e-13), "dt = 1e-13: .* GB are needed"),
    ],
)
def test_more_than_the_memory(call, message, monkeypatch):
    monkeypatch.setattr(checks, "MEMORY", 8e9)
    with pytest.raises(ValueError, match=message):
        call()


def test_frames_in_memory(monkeypatch):
    """Of 6 discs with 4 quantities each, and two numbers."""
    monkeypatch.setattr(checks, "MEMORY", 1e6)
    with pytest.raises(ValueError, match=r"frames = 10000: 0.00208 GB are needed, and this machine has 0.001 GB"):
        plain(frames=10**4)


def test_a_search_for_a_step_that_converges_ends_soon():
    """Steps that do not converge are noticed at the first: trying all 256 short ones took half a minute for six discs."""
    problem = Problem(still().chain, still().initial, 0.2, (loads.Slope(gy=1e12),))
    with pytest.warns(UserWarning, match="did not converge"):
        found = plain(problem, frames=[0.2])
    assert found.stats["unconverged"] == 2


def test_the_lab_refuses_numbers_beyond_doubles():
    """The message was an OverflowError of the session."""
    lab = Session(Settings(n=5, dt=0.02), clock=lambda: 0.0)
    refused = next(
        reply.content for reply in lab.handle({"kind": "advance", "time": 10**400}) if reply.content["kind"] == "refused"
    )
    assert "time must be a number from 0 to 1; got a whole number of 401 digits" in str(refused)


def kept(path):
    """An ensemble with a checkpoint, its frames as bytes."""
    found = simulate_many([slaved(), still()], dt=0.1, engine="plain", progress=False, threads=1, checkpoint=path)
    return found.x.tobytes() + found.theta.tobytes()


def test_a_changed_digit_of_a_checkpoint_is_noticed(tmp_path):
    """A changed digit was another result, without a word."""
    path = tmp_path / "runs.jsonl"
    whole, content = kept(path), path.read_bytes()
    place = content.index(b'"theta"') + 20
    other = b"1" if content[place : place + 1] == b"0" else b"0"
    path.write_bytes(content[:place] + other + content[place + 1 :])
    with pytest.raises(ValueError, match="is damaged: line 2 is not what was written; delete that line, and its case"):
        kept(path)
    path.write_bytes(content.splitlines(keepends=True)[0])
    assert kept(path) == whole


def test_a_changed_digit_of_a_sweep_is_noticed(tmp_path):
    path = tmp_path / "sweep.jsonl"
    with Archive(path, "f", "") as archive:
        archive.write(record(1.0, 0.123))
    path.write_bytes(path.read_bytes().replace(b"0.123", b"0.124"))
    with pytest.raises(ValueError, match="damaged: line 2 is not what was written"):
        read(path)


def test_archives_of_sweeps_without_sums_are_read(tmp_path):
    """Those of version 0.1."""
    path = tmp_path / "sweep.jsonl"
    line = '{"case": 1.0, "value": 0.123, "error": "", "trace": "", "seconds": 0.0}'
    path.write_text(f'{{"function": "f", "content": ""}}\n{line}\n', encoding="utf-8")
    assert read(path)[0].value == 0.123
    with Archive(path, "f", "") as archive:
        archive.write(record(2.0, 0.5))
    assert [found.value for found in read(path)] == [0.123, 0.5]


@pytest.mark.parametrize("data", [None, 3, {}, {"blocks": [], "failed": [], "warned": []}, {"blocks": [{"runs": [0]}]}])
def test_a_forged_checkpoint_is_refused(data):
    with pytest.raises(ValueError, match="must be one that simulate_many has written; what it has of some runs is not"):
        from_data(data, [0, 1])
