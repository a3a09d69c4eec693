"""The page of the main job: its tables and pictures, with two sentences each."""

import csv
from pathlib import Path

from compare.main_job import LONG
from compare.outputs import fresh_files
from compare.page import Page
from compare.results import Study
from compare.tables import markdown

NAME = "index.html"


def write(out: str | Path, studies: list[Study], own_headings: bool = False, speeds: str = "", timed: bool = False) -> Path:
    """Write index.html, which contains the pictures that the main job wrote to `out`.

    Parameters
    ----------
    studies : those of `overview`.
    own_headings : whether `limits` wrote its files.
    speeds : the table of speed against error in Markdown, or why there is none; empty if it was not asked for.
    timed : whether speed.png and speed.csv were written.

    Returns
    -------
    Path of the page.
    """
    folder, scene = Path(out), studies[0].scene
    page = Page(folder)
    page.add(
        f"# N rolling discs and the rod: {scene.name}, {scene.law}",
        "N vertical discs roll on a plane without sliding, and springs join neighbours. For more and more discs their motion tends "
        f"to that of a rod (the field), and this page shows how fast for the {scene.name}, t = 0 to {scene.duration:g}.",
    )
    _discs(page, studies)
    long = scene.duration if scene.closed else LONG * scene.duration
    page.add(
        f"## Energy over [0, {long:g}]",
        "The springs and the rolling discs keep their energy, so a good method must keep it too. The picture shows the energy "
        "against time for the paper's explicit scheme and for the midpoint method.",
    )
    page.picture("energy.png", "The energy by two methods.")
    if own_headings:
        _own_headings(page)
    if speeds:
        page.add(
            "## Speed against error",
            "The table gives the processor time at equal error, for our fastest method and for the fastest of SciPy's. The last "
            "column is the ratio of the two times; above 1 our method is faster.",
            speeds,
        )
    if timed:
        page.picture("speed.png", "Error against processor time; lower and further left is better.", "speed.csv")
    with fresh_files(out) as new:
        (new / NAME).write_text(page.html("N rolling discs and the rod"), encoding="utf-8")
    return folder / NAME


def _discs(page: Page, studies: list[Study]) -> None:
    """N to infinity, what else converges, and the motion."""
    floor = max(study.floor for study in studies)
    page.add(
        "## N → ∞",
        "The table gives the largest error over the discs at the end of the motion, in length and rad, for each number of discs. "
        "An order of 2 means that twice as many discs have a quarter of the error.",
        markdown(studies[0].columns, (row for study in studies for row in study.rows())),
    )
    caption = f"Errors of N discs against the field, whose own estimated error is {floor:.1e}."
    page.picture("convergence.png", caption, "convergence.csv")
    page.add(
        "## Velocities, energy and the ground's force",
        "These converge as well as the positions. Errors of energy and force are relative to the field's largest value, and "
        "“inside” means an eighth of the length or more away from free ends.",
    )
    for study in studies:
        head, *rows = study.wants_rows()
        page.add(markdown(head, rows))
    page.picture("limits-of-all.png", "Errors of all these, with the slope that they should have.", "convergence.csv")
    page.add(
        "## The motion",
        "The centre line at several times, with arrows along the directors d₃ that turn with the discs, and the same line "
        "from above. It is the field to which the discs tend.",
    )
    page.picture("motion.png", "The motion of the field.")


def _own_headings(page: Page) -> None:
    """The limits of discs with own headings; the tables are those of the files."""
    page.add(
        "## Discs with their own headings",
        "Here each disc can turn about the vertical by itself, and springs resist stretch (A) and shear (G) of the line; J is the "
        "heading inertia. Two discs to a link give order 2, elements of three discs give order 4.",
        _of_file(page.folder / "headings.csv"),
    )
    page.picture("limits.png", "Convergence, and three limits of the stiffnesses.", "headings.csv", "limits.csv", "locking.csv")
    page.add(
        "With A = 0, J = 1/G and G → ∞ the rod tends to the paper's unit law with the true curvature, but not to the paper's rod. "
        "The table gives distances at the end of the motion from rods whose headings follow the line.",
        _of_file(page.folder / "limits.csv"),
        "A rod that neither stretches nor shears locks: from this initial state it cannot move. The table gives the largest motion "
        "of any disc for A = G → ∞.",
        _of_file(page.folder / "locking.csv"),
    )


def _of_file(path: Path) -> str:
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    return markdown(head, rows)
