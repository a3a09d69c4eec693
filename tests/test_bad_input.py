"""Whatever is given - scenes, files, arrays, command lines - is answered by a result, a ValueError or a SimulationError: nothing
else is raised, nothing hangs, nothing is written. DISCS_CASES=8 for eight times as many cases, 2 640."""

import contextlib
import io
import os
import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from continuum import Rod, Scene, SteeredRod
from continuum.__main__ import main as continuum_main
from continuum.files import read_scene
from continuum.mesh import semidiscretise
from continuum.scenes import PAPER, SCENES
from discs import Chain, Problem, SimulationError, State, SteeredChain, load, simulate
from discs.__main__ import main as discs_main
from discs.chains.stencils import ENDS
from discs.chains.twist import untwisting_chain
from discs.integrators import METHODS

MORE = int(os.environ.get("DISCS_CASES", "1"))
pytestmark = pytest.mark.filterwarnings("default")  # warnings are for the user; here they are no failure


def cases(count):
    """`count` cases, always the same ones; one that takes a minute hangs."""
    quiet = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture, HealthCheck.data_too_large]
    return settings(max_examples=count * MORE, deadline=60_000, derandomize=True, database=None, suppress_health_check=quiet)


@contextlib.contextmanager
def documented():
    """Documented errors are accepted like results."""
    with warnings.catch_warnings(), contextlib.suppress(ValueError, SimulationError):
        warnings.simplefilter("ignore")
        yield


numbers = st.one_of(
    st.floats(width=64), st.floats(0.1, 3.0), st.integers(-3, 40), st.sampled_from([0.0, -0.0, 1e-300, 1e300, 1e-12, 1e12, 2**70])
)
oddities = st.one_of(
    st.none(), st.booleans(), st.text(max_size=4), st.lists(st.floats(), max_size=3), st.just({}), st.complex_numbers()
)
values = st.one_of(numbers, numbers, numbers, oddities)
fine = st.floats(0.2, 2.0)
NAMES = (
    *PAPER,
    "curvature",
    "stretch_stiffness",
    "shear_stiffness",
    "heading_inertia",
    "duration",
    "twist",
    "omega",
    "mode",
    "amplitude",
)
entries = st.dictionaries(st.sampled_from([*NAMES, "rolling", "n"]), st.one_of(fine, fine, values), max_size=4)


@cases(40)
@given(
    name=st.sampled_from(sorted(SCENES)),
    entries=entries,
    n=st.one_of(st.integers(-1, 12), oddities),
    ends=st.sampled_from([*ENDS, "x"]),
)
@example(name="breathing_ring", entries={"length": 1.0, "radius": 1.4e154}, n=None, ends="springs")
def test_scenes(name, entries, n, ends):
    with documented():
        problem = semidiscretise(SCENES[name](**entries), n, ends) if "n" not in entries else SCENES[name](**entries)
        simulate(problem, dt=problem.duration / 3, frames=2, engine="plain", progress=False)
    with documented():
        Scene(
            rod=Rod(**PAPER | {k: v for k, v in entries.items() if k in PAPER}), initial=lambda s: (s, n, s, ends), duration=1.0
        ).fields(np.arange(4.0))
    with documented():
        SteeredRod(**PAPER | {"shear_stiffness": 1, "heading_inertia": 1} | {k: v for k, v in entries.items() if k in PAPER})


def toml(value):
    if isinstance(value, str):
        return '"' + value.replace("\\", "").replace('"', "").replace("\n", "") + '"'
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, (int, float, list)) else '"?"'


written = st.builds(
    lambda scene, told: "\n".join([f'scene = "{scene}"', *(f"{k} = {toml(v)}" for k, v in told.items())]),
    st.sampled_from([*SCENES, "nothing"]),
    entries,
)
files = st.one_of(
    written.map(str.encode), written.map(str.encode), st.binary(max_size=60), st.text(max_size=60).map(lambda t: t.encode())
)


@cases(80)
@given(content=files)
def test_scene_files(content, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "scene.toml"
    path.write_bytes(content)
    with documented():
        scene = read_scene(path)
        assert tomllib.loads(content.decode())["scene"] in SCENES
        assert scene.duration > 0


anything = st.one_of(
    values, arrays(st.sampled_from([np.float64, np.int64, bool, object, complex]), array_shapes(max_dims=2, max_side=6))
)
uneven_arrays = arrays(np.float64, st.integers(3, 6), elements=st.one_of(st.floats(-2, 2), st.floats()))


@cases(60)
@given(kind=st.sampled_from([Chain, SteeredChain]), n=st.integers(2, 6), data=st.data())
def test_arrays(kind, n, data):
    own = {"heading_inertia": 0.3, "stretch_stiffness": 4.0, "shear_stiffness": 3.0} if kind is SteeredChain else {}
    standard = PAPER | own | {"ends": "springs"}
    given_values = {
        name: data.draw(st.one_of(anything, uneven_arrays, fine))
        for name in data.draw(st.sets(st.sampled_from(sorted(standard)), max_size=2))
    }
    with documented():
        chain = kind(n=n, **standard | given_values)
        fields = [data.draw(st.one_of(st.just(chain.s), uneven_arrays, anything)) for _ in range(4)]
        state = State(*fields, phi=0 * chain.s if own else data.draw(st.one_of(st.none(), anything)))
        simulate(Problem(chain, state, data.draw(st.one_of(fine, values))), dt=0.1, frames=[0.1], engine="plain", progress=False)


@cases(60)
@given(
    method=st.one_of(st.sampled_from(sorted(METHODS)), values),
    dt=st.one_of(st.none(), st.floats(0.02, 10.0), st.floats(1e30), st.floats(max_value=1e-20), oddities),
    frames=st.one_of(st.integers(-1, 5), st.lists(st.floats(-0.1, 0.4), max_size=4), uneven_arrays, oddities),
    want=st.one_of(st.lists(st.sampled_from(["velocity", "slope", "contact_force", "modified_energy", "?"]), max_size=2), values),
    engine=st.one_of(st.just("plain"), oddities),
    tol=st.one_of(st.none(), st.none(), st.none(), st.floats(max_value=0.0), oddities),
)
def test_settings_of_a_run(method, dt, frames, want, engine, tol):
    problem = untwisting_chain(5, duration=0.3)
    with documented():
        run = simulate(problem, method, dt, frames, want, progress=False, engine=engine, tol=tol)
        assert np.isfinite(run.x).all()


words = st.one_of(
    st.floats().map(repr), st.integers(-2, 9).map(str), st.text(st.characters(codec="ascii"), max_size=5), st.just("")
)
sane = st.floats(0.1, 2.0).map(repr)


def option(name, ok, bad=words):
    return st.builds(lambda v: [f"--{name}={v}"], st.one_of(ok, ok, bad))


run_options = st.lists(
    st.one_of(
        option("n", st.integers(2, 9).map(str), st.sampled_from(["-1", "x", "1e3", "99999999999999"])),
        option("t", st.floats(0.1, 0.5).map(repr), st.sampled_from(["0", "nan", "inf", "-1", "", "x"])),
        option("dt", st.floats(0.05, 5).map(repr), st.sampled_from(["0", "nan", "inf", "-1", "1e-320", "x"])),
        option("tol", st.just("0.5"), st.sampled_from(["0", "nan", "-1", "x"])),
        option("frames", st.integers(1, 4).map(str), st.sampled_from(["0", "x", "-7"])),
        option("method", st.sampled_from(["midpoint", "rk4", "RK45", "gauss4"])),
        option("ends", st.sampled_from(["springs", "consistent", "paper"])),
        option("rolling", st.sampled_from(["field", "unit", "own"])),
        option("want", st.sampled_from(["velocity", "slope"])),
        option("twist", sane),
        *(option(name.replace("_", "-"), sane) for name in (*PAPER, "shear_stiffness")),
        st.just(["--overwrite"]),
        st.builds(lambda w: [w], words),
        option("save", st.just("no/such/folder/run.nc"), st.just("/")),
    ),
    max_size=5,
).map(lambda parts: [word for part in parts for word in part])
settled = ["--quiet", "--engine=plain"]
lines = st.one_of(
    st.tuples(st.just(discs_main), run_options.map(lambda o: ["run", "--n=5", "--t=0.3", "--dt=0.1", *o, *settled])),
    st.tuples(st.just(discs_main), st.lists(words, max_size=3)),
    st.tuples(st.just(discs_main), st.tuples(st.sampled_from(["info", "plot", "animate", "view"]), words.filter(bool)).map(list)),
    st.tuples(st.just(continuum_main), st.lists(words, max_size=3)),
    st.tuples(
        st.just(continuum_main),
        st.lists(
            st.one_of(
                option("tol", st.just("0.1"), st.sampled_from(["0", "nan", "-1", "x"])),
                option("scene", st.just("missing.toml"), words),
                option("n", st.just("5"), st.sampled_from(["-1", "1", "x"])),
                option("frames", st.just("2"), st.sampled_from(["0", "x"])),
            ),
            max_size=3,
        ).map(lambda parts: ["solve", "--method=leapfrog", "--n=5", *[word for part in parts for word in part], "--quiet"]),
    ),
)


@cases(50)
@given(line=lines)
def test_command_lines(line, tmp_path_factory):
    main, arguments = line
    folder = tmp_path_factory.getbasetemp() / "empty"
    folder.mkdir(exist_ok=True)
    before = Path.cwd()
    os.chdir(folder)
    out, err = io.StringIO(), io.StringIO()
    try:
        with warnings.catch_warnings(), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            warnings.simplefilter("ignore")
            try:
                code = main(arguments)
            except SystemExit as stop:
                code = stop.code
    finally:
        os.chdir(before)
    assert code in (0, 1, 2), (code, arguments)
    assert "Traceback" not in err.getvalue()
    assert (code == 0) == (not err.getvalue())
    assert not list(folder.iterdir()), arguments


@cases(40)
@given(data=st.data())
def test_archives(data, tmp_path_factory):
    """A file with some bytes changed or its end cut off is refused or is the same run."""
    path = tmp_path_factory.getbasetemp() / "bad.nc"
    run = saved(path.with_name("good.nc"))
    content = bytearray(path.with_name("good.nc").read_bytes())
    for _ in range(data.draw(st.integers(0, 5))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(content[: data.draw(st.one_of(st.just(len(content)), st.integers(0, len(content))))])
    with documented():
        found = load(path)
        assert found.x.tobytes() == run.x.tobytes()


def saved(path, runs={}):  # noqa: B006, one run for all cases
    if not runs:
        runs[0] = simulate(untwisting_chain(5, duration=0.3), dt=0.1, frames=3, engine="plain", progress=False)
        runs[0].save(path)
    return runs[0]
