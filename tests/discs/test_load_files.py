"""Loads in saved runs and on command lines."""

import json
from dataclasses import replace

import numpy as np
import pytest

from discs import load, simulate
from discs.__main__ import main
from discs.chains.twist import untwisting_chain
from discs.files import schema
from discs.loads import Custom, Damping, Force, Motor, Rest, Slope, Spring, Torque, signals
from discs.loads.tables import load_of, load_of_words, table_of
from tests.conftest import Model, uneven
from tests.discs.test_archive import same
from tests.discs.test_restart import equal, stopped

EVERY = (
    Torque(np.linspace(0, 1, 7), signals.sine(0.3, 2.0), about="roll"),
    Force(0.1, 0.2, signals.table([0.0, 0.5], [0.0, 1.0]), at=1.0),
    Slope(0.1, -0.2),
    Spring(0.1, 0.2, 3.0),
    Damping(rolling=0.1, torsion=0.2),
    Rest(twist=0.3, signal=signals.smooth(0.0, 1.0)),
)
MOTOR = Motor(signals.sine(0.5, 1.0), at=0.0)


@pytest.mark.slow
def test_a_run_with_loads_is_saved_and_goes_on_to_the_same_bits(tmp_path, monkeypatch):
    monkeypatch.setattr("discs.running.time_loop.CHUNK", 1)
    problem, path = replace(uneven(7, Model("springs", "field")), loads=EVERY), tmp_path / "run.nc"
    settled = {"method": "midpoint", "dt": 0.05, "frames": 5}
    whole = simulate(problem, **settled, progress=False)
    stopped(monkeypatch, 9, problem, **settled, checkpoint=path)
    assert load(path).stats["frames_missing"] > 0
    equal(simulate(problem, **settled, checkpoint=path, progress=False), whole)
    found = load(path)
    assert [type(each) for each in found.problem.loads] == [type(each) for each in EVERY]
    equal(simulate(found.problem, **settled, progress=False), replace(whole, problem=found.problem))


@pytest.mark.parametrize("one", [*EVERY, MOTOR], ids=lambda one: type(one).__name__)
def test_a_table_makes_the_load_again(one):
    table = table_of(one)
    again = load_of(json.loads(schema.as_text(table)))
    assert type(again) is type(one)
    assert table_of(again) == table


def test_long_patterns_are_refused():
    with pytest.raises(ValueError, match="at most 100000 values; got 100001"):
        table_of(Torque(np.ones(100_001)))


def test_motors_are_saved(tmp_path):
    problem = replace(untwisting_chain(7, duration=0.2), loads=(Motor(0.0, at=0.0),))
    run = simulate(problem, "midpoint", 0.05, frames=2, engine="plain", progress=False)
    run.save(tmp_path / "run.nc")
    same(load(tmp_path / "run.nc"), run)


@pytest.mark.parametrize(
    ("one", "words"),
    [
        (Torque(np.sin), "if pattern of Torque is a function; give numbers for the discs"),
        (Torque(1.0, np.sin), "if signal of Torque is a function; give a signal of discs.loads.signals"),
        (Motor(np.sin, 0.0), "if rate of Motor is a function"),
        (Custom(lambda t, q, v: 0 * q), "a run with the load Custom.* cannot be written to a file"),
    ],
    ids=["pattern", "signal", "rate", "custom"],
)
def test_loads_that_files_cannot_hold_are_refused_before_the_run(one, words, tmp_path):
    problem = replace(untwisting_chain(7, duration=0.2), loads=(one,))
    with pytest.raises(ValueError, match=words):
        simulate(problem, "midpoint", 0.05, checkpoint=tmp_path / "run.nc", progress=False)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("loads", "words"),
    [
        ({}, "loads are a list of tables"),
        ([3], "the table of a load must name it"),
        ([{"load": "eval"}], "load must be one of 'Torque'"),
        ([{"load": "Torque", "pattern": 1.0, "signal": {"name": "table", "file": "/etc/passwd"}}], "key of table must be one of"),
        ([{"load": "Torque", "pattern": "a"}], "pattern of Torque"),
        ([{"load": "Damping", "rolling": -1.0}], "rolling of Damping must be finite and at least 0"),
    ],
    ids=["no list", "number", "unknown", "file", "text", "negative"],
)
def test_tables_in_foreign_files_are_checked(loads, words):
    told, arrays = schema.describe(untwisting_chain(7, duration=0.2))
    with pytest.raises(ValueError, match=words):
        schema.rebuild(told | {"loads": loads}, arrays).energy()


def test_words_are_loads():
    found = load_of_words(["Torque", "pattern=0.3", "at=0.0", 'signal={name="sine", amplitude=1.0, rate=2.0}'])
    assert table_of(found) == table_of(Torque(0.3, signals.sine(1.0, 2.0), at=0.0))
    assert table_of(load_of_words(["Damping", "rolling=0.1"])) == table_of(Damping(rolling=0.1))
    with pytest.raises(ValueError, match="a load is its name and KEY=VALUE"):
        load_of_words(["Torque", "pattern=a"])


@pytest.mark.slow
def test_command_line(tmp_path, capsys):
    path = str(tmp_path / "run.nc")
    options = ["--n", "7", "--t", "0.2", "--dt", "0.05", "--load", "Slope", "gx=0.2", "--load", "Damping", "rolling=0.3"]
    assert main(["run", *options, "--save", path, "--quiet"]) == 0
    assert "taken by dampers" in capsys.readouterr().out
    assert [table_of(one) for one in load(path).problem.loads] == [table_of(one) for one in (Slope(0.2), Damping(rolling=0.3))]
    assert main(["info", path]) == 0
    assert "\nSlope(gx=0.2, gy=0.0)\nDamping(rolling=0.3, " in capsys.readouterr().out
    assert main(["run", *options, "--load", "Torqe"]) == 2
    assert "load must be one of 'Torque'" in capsys.readouterr().err
