"""Scene files that are not as they should be; good ones: test_solve.py, any: test_bad_input.py."""

import os

import pytest

from continuum.files import read_scene


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("a = " + "[" * 100_000 + "]" * 100_000, "is larger than 16384 bytes"),
        ("a = " + "[" * 8_000 + "]" * 8_000, "more brackets within brackets than can be followed"),
        ("a = {" * 3_000, "more brackets within brackets than can be followed"),
        ("duration = " + "9" * 5_000, "is not TOML: Exceeds the limit"),
        ("x = \x1b[31m", "is not TOML"),
        ('scene = "untwisting_rod"\n"\\u001b[31m" = 1', r"key of untwisting_rod must be one of .*; got '\\x1b\[31m'"),
    ],
)
def test_odd_content(content, message, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(content)
    with pytest.raises(ValueError, match=message):
        read_scene(path)


def test_what_is_no_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    for path in (tmp_path / "pipe.toml", "/dev/zero"):
        with pytest.raises(ValueError, match="cannot be read: it is no regular file"):
            read_scene(path)
    with pytest.raises(ValueError, match="cannot be read: it is a folder"):
        read_scene(tmp_path)
    with pytest.raises(ValueError, match="cannot be read: No such file"):
        read_scene(tmp_path / "missing.toml")
