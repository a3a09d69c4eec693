#!/usr/bin/env -S uv run --script
# /// script
# dependencies = ["nox>=2025.2"]
# ///
"""`nox`: the quick tests with each Python that pyproject.toml names; one that is not on the machine is skipped, and said so."""

import nox

PROJECT = nox.project.load_toml("pyproject.toml")
nox.needs_version = ">=2025.2"
nox.options.default_venv_backend = "uv|virtualenv"  # uv also finds Pythons that it has installed


@nox.session(python=nox.project.python_versions(PROJECT))
def tests(session: nox.Session) -> None:
    """`nox -s tests-3.13 -- -k twins`: pytest's arguments follow the two dashes; without, what `make quick` runs."""
    session.install("--editable", ".[cluster,contact]", *nox.project.dependency_groups(PROJECT, "test"))
    session.run("pytest", *(session.posargs or ("-m", "not slow and not long")))


if __name__ == "__main__":
    nox.main()
