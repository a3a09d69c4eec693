"""Speed against error: every peer solves the same problem, failures stay in the table, and the arithmetic of the comparison."""

from dataclasses import replace
from importlib.util import find_spec

import numpy as np
import pytest

from compare import lump, work_precision
from compare.__main__ import main
from compare.entrants import ours, peers
from compare.peers import rates, reduced
from compare.peers.in_diffsl import diffsol_peers
from compare.peers.peer import Cutoff, Outcome, Peer
from compare.reference import distance, reference, rms_distance
from compare.work_precision import Row, WorkPrecision
from continuum import untwisting_rod
from discs import Problem
from discs.integrators.ivp import Reduced
from discs.kernels import driver
from discs.loads import Damping, Force, Motor, Rest, Slope, Spring, Torque, signals
from tests.conftest import Model, models, uneven

pytestmark = pytest.mark.slow

LOADS = (
    Slope(0.2, -0.4),
    Spring(1.0, 0.5, 0.8, at=3.0),
    Damping(rolling=0.3, torsion=lambda s: 0.1 * (1 + s)),
    Torque(lambda s: 0.3 - 0.1 * s, signals.smooth(0.1, 0.8)),
    Force(y=0.7, signal=signals.sine(1.1, 4.0, 0.4), at=0.0),
    Rest(twist=0.6, signal=signals.table([0.2, 0.9], [0.3, 1.0])),
)
# a short motion: peers whose error is that of their tolerances come close
SHORT = {
    "unit": lump(untwisting_rod(rolling="unit", duration=0.4), 9),
    "uneven": replace(uneven(7, Model("springs", "field")), loads=LOADS),
    "uneven own": uneven(7, Model("springs", "steered")),
    "loaded own": replace(
        uneven(7, Model("springs", "steered")), loads=(*LOADS, Torque(0.2, signals.sine(1.0, 3.0), about="turn"))
    ),
    "uneven true": uneven(7, Model("springs", "true")),
}
# what their methods allow in this motion; friction creeps
BOUND = {"IDA, multipliers": 1e-3, "Exudyn, generic": 3e-4, "Exudyn, wheels and beams": 3e-4, "MuJoCo, friction, damped": 3e-2}


def test_peers_take_the_loaded_equations():
    problem = SHORT["uneven"]
    exact, plain = reference(problem)[0], Reduced(problem.system)
    f = reduced.Bound(problem, lambda t, y, out: np.copyto(out, plain(t, y)))
    found = reduced.scipy_peers(problem, f) + (reduced.sundials_peers(problem, f) if find_spec("sksundae") else [])
    for peer in found:
        if "rates" not in peer.name:  # compiled
            assert distance(peer.run(1e-5, 60.0).q, exact) < 1e-3, peer.name


@pytest.mark.long
@pytest.mark.parametrize("name", SHORT)
def test_peers_solve_the_same_problem(name):
    problem: Problem = SHORT[name]
    exact, floor = reference(problem)
    assert floor < 1e-11
    found = peers(problem)
    names = {peer.name for peer in found}
    exudyn = "Exudyn, wheels and beams" if "own" in name else "Exudyn, generic"
    assert not any(name.startswith("diffsol") for name in names) or not problem.loads
    for module, peer in (("scipy", "SciPy Radau"), ("sksundae", "CVODE BDF-2"), ("diffrax", "diffrax Tsit5"), ("exudyn", exudyn)):
        written = ("true" not in name or module in ("scipy", "sksundae")) and (name, module) != ("loaded own", "exudyn")
        assert (written and find_spec(module) is not None) == (peer in names)
    for peer in [*found, *ours(problem)]:
        setting = 1e-6 if 1e-6 in peer.settings else peer.settings[3 if peer in found else -1]  # a tolerance or a step
        q = peer.run(setting, 60.0).q
        error = (np.abs(q - exact).max(axis=1) / np.abs(exact).max(axis=1)).max()
        assert error < BOUND.get(peer.name, 1e-4), (peer.name, setting, error)


@pytest.mark.skipif(find_spec("pydiffsol") is None, reason="pydiffsol is not installed")
@models([Model("springs", law) for law in ("field", "unit", "steered")])
def test_diffsol_solves_the_same_problem(model):
    problem = uneven(7, model)
    exact, _ = reference(problem)
    for peer in diffsol_peers(problem):
        assert distance(peer.run(1e-6, 60.0).q, exact) < 1e-4, peer.name
        assert distance(peer.run(1e-8, 60.0).q, exact) < 5e-6, peer.name


@pytest.mark.long
def test_rates_as_unknowns_obey_the_same_equations():
    """(q, omega) by the chain rule from (q, pi), by central differences of omega = pi / root along the motion."""
    problem = replace(uneven(6, Model("springs", "field")), loads=LOADS)
    by_momenta, by_rates = reduced.Bound(problem), reduced.Bound(problem, by_rate=True)
    assert rates.takes(problem)
    system, y, h = problem.system, by_momenta.y0, 1e-6

    def omega(y):
        z = by_momenta.reduced.split(y)
        return system.forward(system.basis(system.shape(z.hi)), z.pi)[2]

    rate = by_momenta(0.3, y)
    expected, found = by_momenta.reduced.split(rate).hi, by_momenta.reduced.split(by_rates(0.3, by_rates.y0))
    np.testing.assert_allclose(found.hi, expected, atol=1e-14)
    np.testing.assert_allclose(found.pi, (omega(y + h * rate) - omega(y - h * rate)) / (2 * h), atol=1e-8)


def test_the_band_of_the_jacobian_is_found():
    problem = uneven(9, Model("springs", "steered"))
    plain = Reduced(problem.system)
    f = reduced.Bound(problem, lambda t, y, out: np.copyto(out, plain(t, y)))
    jacobian = np.array([(f(0.0, f.y0 + 1e-6 * unit) - f(0.0, f.y0 - 1e-6 * unit)) for unit in np.eye(f.y0.size)]).T
    rows, columns = np.nonzero(np.abs(jacobian) > 1e-14)
    band = reduced.band(problem, f)
    assert (band["lband"], band["uband"]) == ((rows - columns).max(), (columns - rows).max())


def test_the_error_in_the_2_norm():
    exact, found = np.array([[3.0, 4.0], [0.0, 0.0]]), np.array([[3.0, 4.5], [0.0, 1e-3]])
    assert rms_distance(found, exact) == pytest.approx(0.1)


def test_loads_that_peers_do_not_take_are_refused():
    problem = uneven(7, Model("springs", "field"))
    motor = Motor(float(problem.initial.omega[2]), problem.chain.s[2])
    for load, words in (
        (motor, "peers take no motors; got a problem with a Motor"),
        (Torque(1.0, lambda t: t), "Torque: peers take signals of discs.loads.signals"),
    ):
        with pytest.raises(ValueError, match=words):
            peers(replace(problem, loads=(load,)))


def test_failures_stay_in_the_table():
    def wrong(setting: float, seconds: float) -> Outcome:
        return Outcome(np.ones((3, 9)), 3, 4, None, 1e-3)

    def slow(setting: float, seconds: float) -> Outcome:
        raise Cutoff

    def crawls(setting: float, seconds: float) -> Outcome:
        return slow(setting, seconds) if setting == 1e-3 else wrong(setting, seconds)

    def broken(setting: float, seconds: float) -> Outcome:
        raise ArithmeticError("the step became too small")

    def methods(problem: Problem) -> list[Peer]:
        return [Peer(run.__name__, (1e-3, 1e-4, 1e-5), run, "differs") for run in (wrong, slow, crawls, broken)]

    study = work_precision({"short": untwisting_rod(duration=0.2)}, (9,), methods, repeats=2, seconds=5.0, progress=False)
    rows = {(r.method, r.setting): r for r in study.rows}
    assert rows["wrong", 1e-3].remark == "says it succeeded, and is wrong"
    assert rows["wrong", 1e-3].seconds == 1e-3
    assert rows["slow", 1e-3].remark == rows["crawls", 1e-3].remark == "cut off after 5 s"
    assert rows["slow", 1e-4].remark == "cut off after 5 s; tighter left out"
    assert ("slow", 1e-5) not in rows
    assert rows["crawls", 1e-4].seconds == rows["crawls", 1e-5].seconds == 1e-3  # as CVODE does
    assert "failed: the step became too small" in rows["broken", 1e-4].remark
    assert np.isnan(rows["broken", 1e-4].error)
    assert any(r.ours and r.method == "auto" and r.error < 1e-6 for r in study.rows)
    assert "says it succeeded, and is wrong" in study.report()
    assert "* slow: differs." in study.report()


def test_what_stays_zero_is_compared_absolutely():
    """y of a straight rod that only twists."""
    exact, found = np.array([[1.0, 2.0], [0.0, 0.0]]), np.array([[1.0, 2.2], [0.0, 1e-3]])
    assert distance(found, exact) == pytest.approx(0.1)
    assert distance(found[:, :1], exact[:, :1]) == 0.0
    assert distance(found, exact, np.array([4.0, 0.0])) == pytest.approx(0.05)


def test_all_methods_take_turns():
    called: list[tuple[str, float]] = []

    def peer(name: str, least: float) -> Peer:
        def run(setting: float, seconds: float) -> Outcome:
            called.append((name, setting))
            return Outcome(np.ones((3, 9)), 1, 1, None, least * len(called))

        return Peer(name, (1e-2, 1e-3), run)

    def methods(problem: Problem) -> list[Peer]:
        return [peer("a", 1e-4), peer("b", 1e-4), peer("slow", 0.1)]

    study = work_precision({"short": untwisting_rod(duration=0.2)}, (9,), methods, repeats=3, seconds=6.0, progress=False)
    settings = [("a", 1e-2), ("a", 1e-3), ("b", 1e-2), ("b", 1e-3)]
    first = [("a", 1e-2), *settings[:2], ("b", 1e-2), *settings[2:], ("slow", 1e-2), ("slow", 1e-2), ("slow", 1e-3)]
    turn = [each for each in settings for _ in range(2)]  # to warm up, and for the clock
    assert called == first + turn + [("slow", 1e-2), ("slow", 1e-3)] + 2 * turn
    seconds = {(r.method, r.setting): r.seconds for r in study.rows if not r.ours}
    assert seconds["a", 1e-2] == pytest.approx(1e-4 * 21)  # the second of three rounds
    assert seconds["slow", 1e-3] == pytest.approx(0.1 * (9 + 19) / 2)  # the mean of its two runs


def test_times_at_equal_error():
    def row(method: str, mine: bool, error: float, seconds: float) -> Row:
        return Row("p", 8, method, mine, 0.0, error, seconds, None, None, None, "")

    rows = [row("a", True, 1e-2, 1.0), row("a", True, 1e-4, 2.0), row("a", True, 1e-3, 50.0), row("b", False, 1e-2, 8.0)]
    rows += [row("b", False, 1e-6, 32.0), row("c", False, np.nan, 0.1), row("c", False, 2.0, 0.1)]
    study = WorkPrecision(rows, {("p", 8): 1e-12}, {})
    assert study.time_at(1e-3, "p", 8, True)[0] == pytest.approx(2**0.5)  # halfway in the logarithm; the slow run does not count
    assert study.time_at(1e-4, "p", 8, False) == (pytest.approx(16.0), "b")
    assert study.time_at(1e-5, "p", 8, True)[0] == np.inf
    assert "| p | 8 | 1e-04 | a | 2e+03 ms | b | 1.6e+04 ms | 8 |" in study.speedups()
    ahead = WorkPrecision([*rows, row("d", False, 1e-7, 0.5)], {("p", 8): 1e-12}, {})
    assert "| p | 8 | 1e-04 | a | 2e+03 ms | d | 500 ms | 0.25 |" in ahead.speedups()


def scipy_alone(problem: Problem) -> list[Peer]:
    """SciPy's methods with the kernel that every chain shares, where peers have one compiled for theirs, which takes seconds."""
    chain = problem.system.parameters
    return reduced.scipy_peers(problem, reduced.Bound(problem, lambda t, y, out: driver.reduced(chain, t, y, out)))


def test_a_run_over_its_time_is_cut_off():
    with pytest.raises(Cutoff):
        scipy_alone(lump(untwisting_rod(), 65))[0].run(1e-6, 0.01)


def test_command_line(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("compare.precision.peers", scipy_alone)  # the others: see above
    out = tmp_path / "out"
    arguments = ["precision", "--n", "9", "--scenes", "field", "--repeats", "1", "--seconds", "0.5", "--quiet", "--out", str(out)]
    assert main(arguments) == 0
    assert sorted(p.name for p in out.iterdir()) == ["precision.csv", "precision.md", "precision.png"]
    printed = capsys.readouterr().out
    assert "fastest peer" in printed
    assert "SciPy DOP853" in printed
    assert (out / "precision.csv").read_text().startswith("problem,n,method,ours,setting,error,seconds")
    assert main(["precision", "--n", "9", "--repeats", "0", "--quiet", "--out", str(out)]) == 2
    assert "repeats must be a whole number" in capsys.readouterr().err


def test_an_interrupted_run_leaves_what_it_has_finished(tmp_path, capsys, monkeypatch):
    out, arguments = tmp_path / "out", ["precision", "--scenes", "field", "--repeats", "1", "--seconds", "0.5", "--quiet"]

    def interrupted(problem: Problem) -> list[Peer]:
        if problem.chain.n == 9:
            return []
        raise KeyboardInterrupt

    monkeypatch.setattr("compare.precision.peers", interrupted)
    assert main([*arguments, "--n", "10", "9", "--out", str(out)]) == 130
    assert not out.exists()
    assert main([*arguments, "--n", "9", "10", "--out", str(out)]) == 130
    assert "these are the results so far" in capsys.readouterr().err
    sizes = [line.split(",")[1] for line in (out / "precision-partial.csv").read_text().splitlines()]
    assert set(sizes) == {"n", "9"}
    assert sorted(p.name for p in out.iterdir()) == [f"precision-partial.{end}" for end in ("csv", "md", "png")]


def test_own_scene(tmp_path, monkeypatch, capsys):
    """The scene of the file is what is measured; it takes the place of --scenes."""
    (tmp_path / "mine.toml").write_text('scene = "breathing_ring"\nradius = 0.7\nduration = 0.3\n')
    given = {}
    monkeypatch.setattr("compare.commands.wait_for_kernels", lambda: None)
    monkeypatch.setattr("compare.precision.work_precision", lambda scenes, *_, into: given.update(scenes))
    monkeypatch.setattr(WorkPrecision, "plot", lambda self, path: path.write_text(""))
    arguments = ["precision", "--scene", str(tmp_path / "mine.toml"), "--quiet", "--out", str(tmp_path / "out")]
    assert main(arguments) == 0
    ((name, scene),) = given.items()
    assert (name, scene.closed, scene.rod.radius, scene.duration) == ("breathing ring", True, 0.7, 0.3)
    assert main([*arguments, "--scenes", "unit"]) == 2
    assert "--scene FILE.toml takes the place of --scenes" in capsys.readouterr().err


def test_a_method_that_was_cut_off_leaves_time_for_the_next():
    """CVODE finds its bands by the right-hand side that SciPy's methods have used up the time of."""
    pytest.importorskip("sksundae")
    problem = lump(untwisting_rod(duration=0.2), 40)
    f = reduced.Bound(problem)
    scipy_peer = next(peer for peer in reduced.scipy_peers(problem, f) if peer.name == "SciPy BDF")
    with pytest.raises(Cutoff):
        scipy_peer.run(1e-9, 1e-3)
    cvode = reduced.sundials_peers(problem, f)[0]
    assert cvode.run(1e-3, 10.0).seconds > 0
