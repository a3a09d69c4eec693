"""The lessons: stored without outputs, of one form; each runs and asserts its numbers."""

import re
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat", reason="needs the group pages")
NotebookClient = pytest.importorskip("nbclient", reason="needs the group pages").NotebookClient

NOTEBOOKS = sorted((Path(__file__).parent.parent / "notebooks").glob("*.ipynb"))
SHORT = ("04-n-to-infinity",)  # of every package, run by `make test`
CAPTION = r'(?:^\*|\n\*|")Figure (\d+)\. '
DRAWS = r"film\(|slide\(|figures\.motion\(|plt\.(subplots|figure|plot|semilogy|loglog)\("
each = pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)


def test_lessons_are_numbered():
    assert [path.name[:3] for path in NOTEBOOKS] == [f"{number:02d}-" for number in range(1, len(NOTEBOOKS) + 1)]


@each
def test_outputs_are_stripped(path):
    for number, cell in enumerate(nbformat.read(path, as_version=4).cells):
        if cell.cell_type == "code":
            assert not cell.outputs, f"cell {number}: clear all outputs before committing"
            assert cell.execution_count is None


@each
def test_has_the_form_of_a_lesson(path):
    notebook = nbformat.read(path, as_version=4)
    text = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "markdown")
    code = "\n".join(cell.source for cell in notebook.cells if cell.cell_type == "code")
    assert text.startswith(f"# {int(path.name[:2])}. ")
    assert re.match(r"# [^\n]+\n\n\*\*[^\n]+\?\*\*\n", text)  # one question
    assert re.search(r"\n\*About \d+ minutes.* You need .*\. To change: .*\.\*\n", notebook.cells[0].source)
    order = ["$$", "**What was learnt.**", "## Exercises", "## Answers"]
    assert sorted(order, key=text.index) == order
    learnt = text.split("**What was learnt.**")[1].split("\n\n")[0]
    assert len(re.findall(r"[.?]( |$)", learnt)) == 3  # sentences
    exercises, answers = text.split("## Exercises")[1].split("## Answers")
    for line in exercises.strip().splitlines():
        number = re.fullmatch(r"(\d)\. \((?:easy|medium|hard)\) .* \*Find: .*\.\*", line)
        assert number, line
        assert f"\n**{number[1]}.**" in answers
    assert "assert " in code
    for target in re.findall(r"\]\(([^)#]+)\)", text):
        assert target.startswith("https://") or (path.parent / target).exists()


@each
def test_has_a_movie_something_to_change_and_captions(path):
    cells = nbformat.read(path, as_version=4).cells
    code = "\n".join(cell.source for cell in cells if cell.cell_type == "code")
    assert "film(" in code
    assert "slide(" in code or re.search("#.*change (it|[A-Z]+|them)\\b", code)
    captions = [int(number) for cell in cells for number in re.findall(CAPTION, cell.source)]
    assert captions == list(range(1, len(captions) + 1))
    drawn = [cell for cell in cells if cell.cell_type == "code" and re.search(DRAWS, cell.source)]
    assert len(captions) == len(drawn)


@pytest.mark.slow
@pytest.mark.parametrize("path", [pytest.param(p, id=p.stem, marks=() if p.stem in SHORT else pytest.mark.long) for p in NOTEBOOKS])
def test_runs(path):
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(path.parent)}}).execute()
    told = [
        out.text
        for cell in notebook.cells
        for out in cell.get("outputs", ())
        if out.output_type == "stream" and out.name == "stderr"
    ]
    assert "Warning" not in "".join(told)
