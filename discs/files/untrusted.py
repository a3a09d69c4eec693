"""Content of files, checked before use and escaped before display."""

import json
from typing import Any

LONGEST = 4 * 2**20  # characters of a text; a run has some thousands
SHOWN = 1000  # characters of a value that are shown
NUMBER: tuple[type, ...] = (int, float)
TEXTS: dict[str, tuple[type, ...]] = {
    "problem": (dict, type(None)),
    "stats": (dict,),
    "error_estimate": (dict, type(None)),
    "versions": (dict,),
}
STATS: dict[str, tuple[type, ...]] = {  # the stats that readers rely on; others are not checked
    "method": (str,),
    "settings": (str,),
    "engine": (str,),
    "want": (list,),
    "scene": (dict,),
    "dt": (*NUMBER, type(None)),
    "dt_suggested": (bool,),
    "steps": (int,),
    "solves": (int,),
    "unconverged": (int,),
    "seconds": NUMBER,
    "frames_missing": (int,),
}


def decoded(name: str, text: str | int) -> dict[str, Any] | None:
    """The decoded JSON of the attribute `name`; ValueError if it has not the required types."""
    if not isinstance(text, str) or len(text) > LONGEST:
        raise ValueError(f"attribute {name!r} is not a text of at most {LONGEST} characters")
    value = json.loads(text)
    _check(f"attribute {name!r}", value, TEXTS[name])
    if name == "stats":
        for key in STATS.keys() & value.keys():
            _check(f"attribute 'stats', {key!r}", value[key], STATS[key])
        if "scene" in value:
            _check("attribute 'stats', name of the scene", value["scene"].get("name"), (str,))
    if name == "error_estimate":
        for key, error in (value or {}).items():
            _check(f"attribute 'error_estimate', {key!r}", error, NUMBER)
    checked: dict[str, Any] | None = value
    return checked


def _check(name: str, value: object, kinds: tuple[type, ...]) -> None:
    """ValueError for a value of another kind, or a whole number larger than a double, which JSON allows."""
    truth = isinstance(value, bool) and bool not in kinds
    if truth or not isinstance(value, kinds) or (isinstance(value, int) and abs(value) > 2**1000):
        raise ValueError(f"{name} is {type(value).__name__}, not {' or '.join(kind.__name__ for kind in kinds)}")


def printable(value: object) -> str:
    """A value as one line of printable characters: control characters are escaped, and a long text is cut."""
    text = str(value)
    line = "".join(c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in text[:SHOWN])
    return line + " ..." * (len(text) > SHOWN)
