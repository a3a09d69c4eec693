"""What files say, checked before it is used and made harmless before it is shown."""

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
STATS: dict[str, tuple[type, ...]] = {  # whatever a reader of stats relies on; other things may be anything
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


def told(name: str, text: str | int) -> dict[str, Any] | None:
    """What the attribute `name` of a file says, of the kinds that it must be; ValueError if it is something else."""
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


def _check(name: str, value: Any, kinds: tuple[type, ...]) -> None:
    """JSON's numbers may be whole and have any number of digits; more than a double holds are refused."""
    truth = isinstance(value, bool) and bool not in kinds
    if truth or not isinstance(value, kinds) or (isinstance(value, int) and abs(value) > 2**1000):
        raise ValueError(f"{name} is {type(value).__name__}, not {' or '.join(kind.__name__ for kind in kinds)}")


def printable(value: Any) -> str:
    """A value as one line of printable characters: whatever could steer a terminal is escaped, and what is long is cut."""
    text = str(value)
    line = "".join(c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in text[:SHOWN])
    return line + " ..." * (len(text) > SHOWN)
