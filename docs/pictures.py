"""Make the pictures of docs/pictures.md, loads.png, motion.png, vakonomic.png and rod.gif: `docs/pictures.py`, 30 s.

The page's picture needs chromium. convergence.png, energy.png and limits.png are the main job's; `python -m continuum.figures
docs/images` makes those of the field.
"""

import shutil
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from compare import figures, lump
from continuum import solve, untwisting_rod
from discs import simulate
from discs.loads import Damping, Torque, signals
from discs.pictures import figures as of_discs
from discs.pictures.animation import Stage
from discs.pictures.style import BLUE, ORANGE

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
        browser.execute_script("discs.go(arguments[0])", t)
        time.sleep(2)
        browser.save_screenshot(str(to))
    finally:
        browser.quit()


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
        right.set(xlabel="t", title="the balance")
        right.legend()
    return figure


def main() -> None:
    scene = untwisting_rod()
    run = simulate(lump(scene, n=32, ends="consistent"), dt=0.02, frames=91)
    run.plot()[0].figure.savefig(IMAGES / "first-look.png", dpi=80)
    run.animate(IMAGES / "rod.gif", fps=20, size=(640, 360))
    Image.fromarray(Stage(run, size=(960, 540)).picture(-1)).convert("RGB").save(IMAGES / "movie.png", optimize=True)
    figures.motion(solve(scene, tol=1e-3, frames=5), scene).savefig(IMAGES / "motion.png", dpi=110)
    of_discs.vakonomic().savefig(IMAGES / "vakonomic.png", dpi=110)
    loads().savefig(IMAGES / "loads.png", dpi=100)
    if not shutil.which("chromedriver"):
        sys.exit("no chromedriver: view.png is not made")
    few = simulate(lump(scene, n=17), dt=0.02, frames=91)
    field = solve(scene, tol=1e-3, frames=91)
    with tempfile.TemporaryDirectory() as folder:
        page = few.view(Path(folder) / "both.html", beside=field, titles=("17 discs, plain springs", "the rod they become"))
        shot(page.path, IMAGES / "view.png", 3.0)


if __name__ == "__main__":
    main()
