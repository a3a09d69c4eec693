"""Make the pictures of docs/pictures.md, ground-force, loads, modes, motion, stability, vakonomic.png and rod.gif, in some minutes:
`docs/pictures.py`.

The page's picture needs chromium. convergence.png, energy.png and limits.png are the main job's; `python -m continuum.figures
docs/images` makes those of the field.
"""

import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from PIL import Image

from compare import convergence, figures, lump, stability
from compare.hardcases.runs import FIXED
from compare.limit_figures import limits_of
from continuum import dispersion, solve, untwisting_rod
from discs import Chain, Problem, Solution, State, simulate
from discs.analysis import modes
from discs.chains.twist import PAPER
from discs.loads import Damping, Torque, signals
from discs.pictures import figures as of_discs
from discs.pictures import geometry
from discs.pictures.animation import Stage
from discs.pictures.style import BLUE, GREEN, GREY, INK, LABEL, ORANGE

IMAGES = Path(__file__).parent / "images"


def shot(page: Path, to: Path, t: float) -> None:
    """A picture of a page at a time, by a browser without a window."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    flags = "--headless=new --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --window-size=1200,760"
    for flag in flags.split():
        options.add_argument(flag)
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=shutil.which("chromedriver")))
    try:
        browser.get(page.as_uri())
        browser.execute_script("discs.play(false); discs.go(arguments[0])", t)
        time.sleep(2)
        browser.save_screenshot(str(to))
    finally:
        browser.quit()


def lab_shot(to: Path, t: float) -> None:
    """A picture of the lab when its discs have moved until a time."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    flags = "--headless=new --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --window-size=1280,940"
    for flag in flags.split():
        options.add_argument(flag)
    command = [sys.executable, "-m", "compare", "lab", "--no-browser", "--stay"]
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(executable_path=shutil.which("chromedriver")))
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as served:
        try:
            browser.set_script_timeout(300)
            browser.get(served.stdout.readline().split()[-1])
            there = f"globalThis.discs?.frame?.t > {t} && discs.frame.error"
            look = f"const done = arguments[0], look = () => {there} ? done() : setTimeout(look, 20); look()"
            browser.execute_async_script(look)
            browser.execute_script("document.querySelector('.play').click()")
            time.sleep(2)
            browser.execute_script("discs.stage.renderer.setPixelRatio(1); discs.stage.resize()")
            time.sleep(1)
            browser.save_screenshot(str(to))
        finally:
            browser.quit()
            served.send_signal(signal.SIGINT)


def loads() -> Figure:
    """A driven rod and a braked one: where they move, and the balance of energy."""
    figure = Figure(figsize=(9.6, 6.8), layout="constrained")
    still, twisted = lump(untwisting_rod(twist=0.0, duration=9.0), n=33), lump(untwisting_rod(duration=18.0), n=33)
    push = Torque(1.0, signal=signals.smooth(0.0, 3.0), at=0.0)
    both = (
        ("pushed: a torque on the first disc", still, push, "work", "work of the torque"),
        ("braked: viscous springs", twisted, Damping(torsion=0.3), "dissipated", "dissipated"),
    )
    for (left, right), (title, problem, load, name, words) in zip(figure.subplots(2, 2), both, strict=True):
        run = simulate(replace(problem, loads=(load,)), "midpoint", 0.01, frames=91, progress=False)
        run.plot_motion(left)
        left.set_title(title)
        right.plot(run.t, run.energy, color=BLUE, label="energy")
        right.plot(run.t, getattr(run, name), "--", color=ORANGE, label=words)
        if name == "dissipated":
            right.plot(run.t, run.energy + run.dissipated, ":", color=INK, label="their sum")
        right.set(xlabel="t", title="the balance")
        right.legend()
    return figure


def ground_force() -> Figure:
    """The ground's force along the line: inside, on the discs at an end, and how all of it converges."""
    scene = untwisting_rod()
    field = solve(scene, tol=1e-8, frames=1, want=("contact_force", "slope"))
    figure = Figure(figsize=(13.2, 5.0), layout="constrained")
    inside, end, limit = figure.subplots(1, 3)
    inside.plot(field.s, along(field)[0], color=INK, label="the field, N → ∞")
    for shift, (n, mark, colour) in zip((-0.25, 0.0, 0.25), ((33, "^", ORANGE), (129, "s", GREEN), (513, "o", BLUE)), strict=True):
        run = simulate(lump(scene, n, "consistent"), "gauss8", 0.01, frames=1, want=("contact_force", "slope"), progress=False)
        force, k, each = along(run)[0], run.problem.chain.k, slice(None, None, max(1, n // 64))
        inside.plot(run.s[each], (force / run.problem.chain.w)[each], mark, color=colour, markersize=4, label=f"{n} discs")
        end.bar(np.arange(6) + shift, k * force[:6], 0.25, color=colour, label=f"{n} discs")
    inside.set(ylim=(-4.5, 4.5), xlabel=LABEL["s"], ylabel="force on a disc over its length", title="Inside: a force per length")
    inside.annotate("the last discs: see right", (0.3, 4.4), (0.75, 3.6), arrowprops={"arrowstyle": "->"})
    force, couple = np.hypot(*field.end_force[0, 0]), np.hypot(*field.end_couple[0, 0])
    words = f"Each force grows like N. The sum tends to {force:.1f},\nthe end force; the moment about the end"
    words += f"\nto {couple:.2f}, the end couple."
    end.text(0.03, 0.03, words, transform=end.transAxes, fontsize=9)
    end.set(ylim=(-7.6, 4.6), xlabel="disc, counted from the end", ylabel="force on a disc times its spacing k")
    end.set_title("At an end: a force and a couple")
    limits_of(convergence(scene, (129, 257, 513, 1025), "consistent", field, want=("contact_force",)), limit)
    limit.set(ylim=(3e-5, 2e-1), title="All of it converges", ylabel="error, relative to the field's largest value")
    for ax in (inside, end, limit):
        ax.legend(fontsize=8)
        ax.grid(alpha=0.3)
    figure.suptitle("The ground's force on the paper's rod, its part along the line, at t = 4.5")
    return figure


def along(run: Solution) -> np.ndarray:
    """The ground's force along the line, (F, n)."""
    slope = run.slope_x + 1j * run.slope_y
    return ((run.contact_force[:, 0] - 1j * run.contact_force[:, 1]) * slope / abs(slope)).real


def small_motions() -> Figure:
    """Modes of rings: frequencies at rest, growth while they roll, with the dispersion relations."""
    figure = Figure(figsize=(10.5, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    rod, n = untwisting_rod().rod, 64
    q = 2 * np.pi / rod.length * np.linspace(0.0, n / 4, 400)
    for law, colour, mark in (("field", BLUE, "o"), ("unit", ORANGE, "x")):
        chain = Chain(n=n, ends="ring", shift=(rod.length, 0.0), rolling=law, **PAPER)
        still = Problem(chain, State(chain.s, 0 * chain.s, 0 * chain.s), 1.0)
        found = modes(still, count=n)
        turns = np.abs(np.fft.fft(found.shape[:, 2], axis=1)).argmax(axis=1)
        waves = 2 * np.pi / rod.length * np.minimum(turns, n - turns)
        left.plot(waves, np.abs(found.rate), mark, color=colour, fillstyle="none", label=f"{n} discs, {law} law")
        rolling = modes(replace(still, initial=replace(still.initial, omega=1.0)), count=2 * n - 2)
        turns = np.abs(np.fft.fft(rolling.shape[:, 2], axis=1)).argmax(axis=1)
        waves = 2 * np.pi / rod.length * np.minimum(turns, n - turns)
        right.plot(waves, rolling.rate.real, mark, color=colour, fillstyle="none", label=f"{n} discs, {law} law")
        right.plot(q, dispersion.growth(rod, q, 1.0, law), color=INK, linewidth=0.8)
        right.plot(q, dispersion.growth(rod, q, 1.0, law, chain.k), "--", color=colour, linewidth=0.8)
    left.plot(q, dispersion.frequency(rod, q), color=INK, linewidth=0.8, label="the field")
    left.set(xlabel="wave number q", ylabel="frequency", title="At rest", xlim=(0, 30), ylim=(0, 1.05 * np.abs(found.rate).max()))
    right.set(xlabel="wave number q", ylabel="Re σ", title="Rolling sideways, ω = 1", xlim=(0, q[-1]), ylim=(-0.1, 1.3))
    for ax in (left, right):
        ax.legend(fontsize=8)
        ax.grid(alpha=0.3)
    return figure


def towards_the_rod(path: Path, sizes: tuple[int, ...] = (5, 9, 17, 65), frames: int = 46) -> None:
    """A movie from above: N discs on the rod that they become, and the rod alone."""
    scene = untwisting_rod()
    runs = [simulate(lump(scene, n, "consistent"), dt=0.01, frames=frames, progress=False) for n in sizes]
    field = solve(scene, tol=1e-4, frames=frames, progress=False)
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    canvas, grid = FigureCanvasAgg(figure), figure.subplots(2, 3, sharex=True, sharey=True)
    lines, strokes, dots = [], [], []
    for ax, run in zip(grid.flat, [*runs, field], strict=False):
        alone, few = run is field, run.s.size < 30
        lines.append(ax.plot([], [], color=BLUE if alone else GREY, linewidth=6, alpha=0.8 if alone else 0.4)[0])
        strokes.append(ax.add_collection(LineCollection([], colors=BLUE, linewidths=2.5 if few else 1.2)))
        dots.append(ax.plot([], [], "o", color=ORANGE, markersize=4 if few else 2)[0])
        ax.set(xlim=(-0.5, 4.5), ylim=(-2.8, 2.8), aspect="equal", xticks=[], yticks=[])
        ax.set_title("the rod" if alone else f"{run.s.size} discs on the rod", fontsize=11)
    last = grid.flat[-1]
    last.set_axis_off()
    words = "Discs seen from above (blue),\neach with a mark on its rim\n(orange). The more discs, the\n"
    words += "closer they stay to the rod (grey)."
    last.text(0.02, 0.55, words, transform=last.transAxes, va="center", fontsize=11)
    clock = last.text(0.02, 0.12, "", transform=last.transAxes, fontsize=11)
    forward = [geometry.turn(geometry.axles(run)) for run in runs]
    pictures = []
    for f in range(frames):
        for line in lines:
            line.set_data(field.x[f], field.y[f])
        for run, ahead, stroke, dot in zip(runs, forward, strokes, dots, strict=False):
            at, reach = np.stack([run.x[f], run.y[f]], axis=1), 0.25 * ahead[f].T
            stroke.set_segments(list(np.stack([at - reach, at + reach], axis=1)))
            dot.set_data(*(at + np.sin(run.theta[f])[:, None] * reach).T)
        clock.set_text(f"t = {field.t[f]:.1f}")
        canvas.draw()
        picture = Image.fromarray(np.array(canvas.buffer_rgba())).convert("RGB")
        pictures.append(picture.quantize(48, dither=Image.Dither.NONE))
    durations = [100] * (frames - 1) + [1500]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=durations, loop=0, optimize=True)


def equations() -> Figure:
    """The discs' equations and the rod's, in one small picture."""
    figure = Figure(figsize=(9.0, 2.5))
    lines = (
        ("each disc rolls and does not slide", r"$\dot{\mathbf{r}}_i = \mathbf{e}_i\,\dot{\theta}_i$"),
        (
            r"springs and the ground's force $\lambda_i$ move it",
            r"$m_i\,\ddot{\mathbf{r}}_i = -\,\partial V/\partial\mathbf{r}_i + \lambda_i$",
        ),
        (
            "and turn it about its axle",
            r"$I_i\,\ddot{\theta}_i = -\,\partial V/\partial\theta_i - \mathbf{e}_i\cdot\lambda_i$",
        ),
        (
            r"the rod, $N\to\infty$",
            r"$\rho\,\ddot{\mathbf{r}} = -K\,\mathbf{r}^{\prime\prime\prime\prime} + \lambda,\quad"
            r" \alpha\,\ddot{\theta} = \beta\,\theta^{\prime\prime} - \mathbf{e}\cdot\lambda,\quad"
            r" \dot{\mathbf{r}} = \mathbf{e}\,\dot{\theta}$",
        ),
    )
    for k, (words, formula) in enumerate(lines):
        figure.text(0.02, 0.86 - 0.235 * k, words, fontsize=11.5, color=INK, va="center")
        figure.text(0.46, 0.86 - 0.235 * k, formula, fontsize=13, color=BLUE, va="center")
    return figure


def main() -> None:
    scene = untwisting_rod()
    towards_the_rod(IMAGES / "towards-the-rod.gif")
    equations().savefig(IMAGES / "equations.png", dpi=110)
    run = simulate(lump(scene, n=32, ends="consistent"), dt=0.02, frames=91)
    run.plot()[0].figure.savefig(IMAGES / "first-look.png", dpi=80)
    run.animate(IMAGES / "rod.gif", fps=20, size=(640, 360))
    Image.fromarray(Stage(run, size=(960, 540)).picture(-1)).convert("RGB").save(IMAGES / "movie.png", optimize=True)
    figures.motion(solve(scene, tol=1e-3, frames=5), scene).savefig(IMAGES / "motion.png", dpi=110)
    of_discs.vakonomic().savefig(IMAGES / "vakonomic.png", dpi=110)
    loads().savefig(IMAGES / "loads.png", dpi=100)
    small_motions().savefig(IMAGES / "modes.png", dpi=100)
    ground_force().savefig(IMAGES / "ground-force.png", dpi=100)
    stability(names=["step above the explicit limit"], methods=FIXED, progress=False).plot(IMAGES / "stability.png")
    if not shutil.which("chromedriver"):
        sys.exit("no chromedriver: view.png and lab.png are not made")
    few = simulate(lump(scene, n=17), dt=0.02, frames=91)
    field = solve(scene, tol=1e-3, frames=91)
    with tempfile.TemporaryDirectory() as folder:
        page = few.view(Path(folder) / "both.html", beside=field, titles=("17 discs, plain springs", "the rod they become"))
        shot(page.path, IMAGES / "view.png", 3.0)
    lab_shot(IMAGES / "lab.png", 2.5)


if __name__ == "__main__":
    main()
