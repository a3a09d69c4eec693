"""The messages that a page may send: a strict schema. Whatever is not in it is refused with the reason."""

import json
from collections.abc import Callable, Mapping
from typing import Any

from discs import checks

LONGEST = 4096  # characters of a message; the longest of the page have some hundreds
FAR = 1e6  # positions and rates that a page may send are not larger
MOST_DISCS = 1025
Check = Callable[[str, Any], Any]


def _number(least: float, most: float) -> Check:
    def check(name: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not least <= value <= most:
            raise ValueError(f"{name} must be a number from {least:g} to {most:g}; got {checks.shown(value)}")
        return float(value)

    return check


def _whole(least: int, most: int) -> Check:
    def check(name: str, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise ValueError(f"{name} must be a whole number from {least} to {most}; got {checks.shown(value)}")
        return value

    return check


def _flag(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"{name} must be true or false; got {checks.shown(value)}")
    return value


def _word(name: str, value: Any) -> str:
    if not isinstance(value, str) or not 0 < len(value) <= 64:
        raise ValueError(f"{name} must be a word of at most 64 characters; got {checks.shown(value)}")
    return value


def _one_of(*known: str) -> Check:
    return lambda name, value: checks.choice(name, value, known)


DISC = _whole(0, MOST_DISCS - 1)
PLACE = _number(-FAR, FAR)
NEEDED: dict[str, dict[str, Check]] = {
    "advance": {"time": _number(0.0, 1.0)},  # move on by so much time
    "step": {"by": _one_of("forward", "back")},
    "seek": {"time": _number(0.0, FAR)},  # go back to the last frame kept before this time
    "reset": {},
    "choose": {},
    "set": {"name": _word, "value": PLACE},  # a slider
    "pull": {"disc": DISC, "x": PLACE, "y": PLACE},  # by a spring to this place
    "release": {},
    "kick": {"disc": DISC, "change": _number(-100.0, 100.0)},  # of omega
    "hold": {"disc": DISC, "on": _flag},
    "compare": {"on": _flag},  # with the field
    "code": {"language": _one_of("python", "toml")},
    "save": {"ending": _one_of(".nc", ".csv")},
}
OPTIONAL: dict[str, dict[str, Check]] = {
    "choose": {
        "scene": _word,
        "rolling": _word,
        "ends": _word,
        "method": _word,
        "n": _whole(2, MOST_DISCS),
        "dt": _number(1e-5, 1.0),
    },
}


def parsed(text: object) -> Any:
    """A message from its text. ValueError if it is no JSON, or too long."""
    if not isinstance(text, str):
        raise ValueError("a message is text in JSON; got binary data")
    if len(text) > LONGEST:
        raise ValueError(f"a message has at most {LONGEST} characters; got {len(text)}")
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise ValueError(f"a message is text in JSON; got {checks.shown(text)}") from None


def checked(message: object) -> dict[str, Any]:
    """A message {"kind": ..., ...} with the fields of its kind and no others, each in its range. ValueError otherwise."""
    if not isinstance(message, Mapping):
        raise ValueError(f'a message is an object with a "kind"; got {checks.shown(message)}')
    kind = checks.choice("kind", message.get("kind"), NEEDED)
    needed, optional = NEEDED[kind], OPTIONAL.get(kind, {})
    found: dict[str, Any] = {"kind": kind}
    for name, value in message.items():
        if name == "kind":
            continue
        check = (needed | optional).get(name)
        if check is None:
            raise ValueError(f"a message {kind!r} has the fields {list(needed | optional)}; got {checks.shown(name)}")
        found[name] = check(name, value)
    if missing := [name for name in needed if name not in found]:
        raise ValueError(f"a message {kind!r} needs {', '.join(missing)}")
    return found
