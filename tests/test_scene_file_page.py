"""The page of the scene file: its samples are read, and its tables have the keys that the reader takes, with their defaults."""

import inspect
import re
from dataclasses import MISSING, fields
from pathlib import Path

import pytest

from continuum import parameters, solve
from continuum.files import read_scene
from continuum.scenes import LAW, SCENES
from discs.chains.twist import PAPER
from discs.loads import signals
from discs.loads.tables import LOADS

PAGE = (Path(__file__).parent.parent / "docs" / "scene-file.md").read_text(encoding="utf-8")
SAMPLES = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
CLASSES = LOADS | parameters.NAMES | {name: kind for name, kind in signals.NAMES.items() if name != "table"}
CLASSES["table` of a signal"] = signals.table


def written(heading: str) -> dict[str, str]:
    """Key and default of each line of the first table under a heading."""
    (section,) = re.findall(rf"\n##+ {re.escape(heading)}\n(.*?)(?=\n##|\Z)", PAGE, re.DOTALL)
    return dict(re.findall(r"^\| `(\w+)` \|.*\| (.*?) \|$", section, re.MULTILINE))


def number(text: str) -> object:
    """A default as it stands in a table: a number, a word in quotation marks, or a phrase for none."""
    try:
        return float(text)
    except ValueError:
        return text.strip("`").strip('"') if text.startswith("`") else None


@pytest.mark.parametrize("sample", SAMPLES, ids=range(len(SAMPLES)))
def test_samples_are_scenes(sample, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(sample)
    assert read_scene(path).duration > 0


def test_there_are_three_samples_and_the_last_one_moves(tmp_path):
    assert len(SAMPLES) == 3
    path = tmp_path / "scene.toml"
    path.write_text(SAMPLES[-1])
    assert solve(read_scene(path), tol=1e-3, frames=2, progress=False).x[-1].mean() > 1e-4  # pulled by the slope


def test_keys_of_every_scene():
    assert written("Keys of every scene").keys() == {"scene", "duration", "loads", *PAPER}
    assert {key: float(written("Keys of every scene")[key]) for key in PAPER} == PAPER


@pytest.mark.parametrize("name", SCENES)
def test_keys_of_a_scene(name):
    own = {key: p.default for key, p in inspect.signature(SCENES[name]).parameters.items() if p.kind is not p.VAR_KEYWORD}
    defaults = own if name == "steered_rod" else own | dict(zip(LAW, ("linear", 0.0), strict=True))
    assert {key: number(text) for key, text in written(f"`{name}`").items()} == defaults


@pytest.mark.parametrize("name", CLASSES)
def test_keys_of_loads_signals_and_parameters(name):
    table = written(f"`{name}" if " " in name else f"`{name}`")
    assert list(table) == [f.name for f in fields(CLASSES[name])]
    for f in fields(CLASSES[name]):
        assert (table[f.name] == "must be given") == (f.default is MISSING), f.name
        if f.default is not MISSING:
            assert number(table[f.name]) == f.default, f.name
