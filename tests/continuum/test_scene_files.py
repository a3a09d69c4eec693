"""Scene files that are not as they should be; good ones: test_solve.py, any: test_bad_input.py."""

import os
import re
from dataclasses import replace

import numpy as np
import pytest

from compare import lump
from continuum import solve
from continuum.files import read_scene
from continuum.parameters import polynomial, table
from discs.loads import signals


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("a = " + "[" * 100_000 + "]" * 100_000, "is larger than 16384 bytes"),
        ("a = " + "[" * 8_000 + "]" * 8_000, "more brackets within brackets than can be followed"),
        ("a = {" * 3_000, "more brackets within brackets than can be followed"),
        ("duration = " + "9" * 5_000, "is not TOML: Exceeds the limit"),
        ("x = \x1b[31m", "is not TOML"),
        ('scene = "untwisting_rod"\n"\\u001b[31m" = 1', r"key of untwisting_rod must be one of .*; got '\\x1b\[31m'"),
    ],
)
def test_odd_content(content, message, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(content)
    with pytest.raises(ValueError, match=message):
        read_scene(path)


LOADED = """
scene = "untwisting_rod"
rolling = "unit"

[[loads]]
load = "Torque"
pattern = 0.3
at = 0.0
signal = { name = "sine", amplitude = 1.0, rate = 2.0 }

[[loads]]
load = "Damping"
rolling = 0.1
torsion = 0.02

[[loads]]
load = "Force"
y = 0.2
signal = { name = "table", file = "push.csv" }

[[loads]]
load = "Motor"
rate = { name = "sine", amplitude = 0.5, rate = 2.0 }
at = 4.0
"""


def test_loads_in_a_file_are_those_of_the_discs(tmp_path):
    (tmp_path / "scene.toml").write_text(LOADED)
    (tmp_path / "push.csv").write_text("0, 0.0\n1.0, 2.0\n")
    scene = read_scene(tmp_path / "scene.toml")
    torque, damping, force, motor = scene.loads
    assert (torque.pattern, torque.at, torque.signal) == (0.3, 0.0, signals.sine(1.0, 2.0))
    assert (damping.rolling, damping.torsion, damping.turning) == (0.1, 0.02, 0.0)
    assert force.signal(0.25) == 0.5
    assert motor.rate == signals.sine(0.5, 2.0)
    scene = replace(scene, loads=scene.loads[:3])
    problem, free = lump(scene, 9), lump(replace(scene, loads=()), 9)
    q, v = problem.start().hi, np.ones((3, 9))
    expected = np.zeros((3, 9))
    expected[1], expected[2] = 0.2 * 0.5 * problem.chain.w, -0.1 * problem.chain.w
    expected[2, 0] += 0.3 * np.sin(0.5)
    np.testing.assert_allclose(problem.system.load.force(0.25, q, v), expected, atol=1e-15)
    assert problem.energy() == free.energy()
    assert scene.description()["loads"][1].startswith("Damping(rolling=0.1")
    field = solve(scene, 1e-3, progress=False)
    assert 0 < field.dissipated[-1] < abs(field.work[-1])
    with pytest.raises(ValueError, match="loads of a scene must be a tuple of loads on a rod"):
        replace(scene, loads=(3,))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('load = "Push"', "load must be one of 'Torque', 'Force'.*; got 'Push'"),
        ("pattern = 1.0", "the table of a load must name it"),
        ('load = "Torque"', "Torque needs pattern"),
        ('load = "Torque"\npattern = 1.0\nsize = 2', "key of Torque must be one of .*; got 'size'"),
        ('load = "Torque"\npattern = 1.0\nsignal = "sine"', "signal must be a table with its name"),
        ('load = "Torque"\npattern = 1.0\nsignal = { name = "sine", rate = 1.0 }', "sine needs amplitude"),
        ('load = "Torque"\npattern = 1.0\nsignal = { name = "table", file = "no.csv" }', "no.csv cannot be read"),
        ('load = "Torque"\npattern = 1.0\nsignal = { name = "table", file = "scene.toml" }', "must be lines 't, value'"),
    ],
)
def test_loads_that_a_file_cannot_hold(content, message, tmp_path):
    (tmp_path / "scene.toml").write_text('scene = "untwisting_rod"\n[[loads]]\n' + content)
    with pytest.raises(ValueError, match=message):
        read_scene(tmp_path / "scene.toml")


VARYING = """
scene = "untwisting_rod"
density = { name = "polynomial", coefficients = [1.0, 0.25] }
radius = { name = "table", s = [0.0, 2.0, 4.0], values = [1.0, 0.7, 0.8] }
bending_stiffness = { name = "table", file = "k.csv" }
"""


def test_parameters_that_vary(tmp_path):
    (tmp_path / "scene.toml").write_text(VARYING)
    (tmp_path / "k.csv").write_text("0, 0.7\n4.0, 1.4\n")
    scene = read_scene(tmp_path / "scene.toml")
    assert scene.rod.density == polynomial([1.0, 0.25])
    assert scene.rod.radius == table([0.0, 2.0, 4.0], [1.0, 0.7, 0.8])
    chain = lump(scene, 5).chain
    np.testing.assert_array_equal(chain.density, [1.0, 1.25, 1.5, 1.75, 2.0])
    np.testing.assert_allclose(chain.bending_stiffness, [0.875, 1.05, 1.225])
    np.testing.assert_allclose(np.asarray(chain.radius)[[0, 2, 4]], [1.0, 0.7, 0.8])
    assert chain.torsion_stiffness[0] == 0.8


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("density = { coefficients = [1.0] }", 'density must be a table with its name, as { name = "polynomial", ... }'),
        ('density = { name = "sine", rate = 1.0 }', "density must be one of 'polynomial', 'table'; got 'sine'"),
        ('density = { name = "polynomial" }', "polynomial needs coefficients"),
        ('density = { name = "polynomial", coefficients = [1.0, -0.5] }', "density must be finite and above 0; got 0 at s = 2"),
        ('radius = { name = "table", s = [0.0, 1.0] }', "table needs values"),
        ('radius = { name = "table", file = "scene.toml" }', "must be lines 's, value'"),
        ('length = { name = "polynomial", coefficients = [4.0] }', "length must be a positive finite number"),
    ],
)
def test_parameters_that_a_file_cannot_hold(content, message, tmp_path):
    (tmp_path / "scene.toml").write_text('scene = "untwisting_rod"\n' + content)
    with pytest.raises(ValueError, match=re.escape(message)):
        read_scene(tmp_path / "scene.toml")


def test_what_is_no_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    for path in (tmp_path / "pipe.toml", "/dev/zero"):
        with pytest.raises(ValueError, match="cannot be read: it is no regular file"):
            read_scene(path)
    with pytest.raises(ValueError, match="cannot be read: it is a folder"):
        read_scene(tmp_path)
    with pytest.raises(ValueError, match="cannot be read: No such file"):
        read_scene(tmp_path / "missing.toml")


def test_loads_of_a_file_come_besides_those_of_its_scene(tmp_path):
    """A rod with a mounting angle has a rest shape, with and without further loads."""
    path = tmp_path / "scene.toml"
    path.write_text('scene = "steered_rod"\nmounting_angle = 0.4\n', encoding="utf-8")
    assert [load.mounting_angle for load in read_scene(path).loads] == [0.4]
    path.write_text('scene = "steered_rod"\nmounting_angle = 0.4\n[[loads]]\nload = "Damping"\nrolling = 0.1\n', encoding="utf-8")
    rest, damping = read_scene(path).loads
    assert (rest.mounting_angle, damping.rolling) == (0.4, 0.1)
