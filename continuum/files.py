"""Scenes from TOML files."""

import inspect
import tomllib
from pathlib import Path

from continuum.rod import Scene
from continuum.scenes import LAW, PAPER, SCENES, steered_rod
from discs import checks


def read_scene(path: str | Path) -> Scene:
    """A scene from a TOML file: `scene` names it, the other keys are its parameters.

        scene = "untwisting_rod"
        rolling = "unit"
        duration = 6.0
        radius = 0.7

    Raises
    ------
    ValueError : if the file cannot be read, or a key or value is not one of the scene's.
    """
    try:
        content = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"the scene file {path} cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"the scene file {path} is not TOML: {error}") from None
    if "scene" not in content:
        raise ValueError(
            f"the scene file {path} must name its scene, as in scene = {next(iter(SCENES))!r}; its keys are {list(content)}"
        )
    make = SCENES[checks.choice("scene", content.pop("scene"), SCENES)]
    own = [name for name, p in inspect.signature(make).parameters.items() if p.kind is not p.VAR_KEYWORD]
    for key in content:
        checks.choice(f"key of {make.__name__}", key, (*own, *PAPER, *(LAW if make is not steered_rod else ())))
    return make(**content)
