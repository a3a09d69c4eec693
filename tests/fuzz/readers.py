"""Coverage-guided fuzzing of everything that reads a file: scenes in TOML, archives and what `info` says of them, restart files,
archives of sweeps and checkpoints of ensembles.

    pip install atheris
    python tests/fuzz/readers.py -max_total_time=600 -timeout=20 -rss_limit_mb=3000 -len_control=0 -max_len=65536 corpus/

Not part of the tests. A reader may raise ValueError and nothing else; an archive that was changed is refused or is the same run.
The first byte of an input chooses what it is: a TOML file, bytes of an archive, changes to a whole archive, to a restart file, to
the archive of a sweep, or to the checkpoint of an ensemble.
"""

import atexit
import shutil
import sys
import tempfile
import warnings
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["discs", "continuum", "tomllib"]):
    from continuum.files import read_scene
    from discs import Solution, load, simulate, simulate_many
    from discs.chains.twist import untwisting_chain
    from discs.command_line import about
    from discs.files.restart import read_restart
    from discs.files.results import Archive, read, record
    from discs.running import recording

FOLDER = Path(tempfile.mkdtemp(dir="/dev/shm" if Path("/dev/shm").is_dir() else None))
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)
QUANTITIES = ("x", "y", "theta", "omega", "energy")


def seeds() -> tuple[Solution, bytes, bytes]:
    """A run, its archive and the restart file of one that did not end."""
    problem = untwisting_chain(4, duration=0.1)
    run = simulate(problem, dt=0.05, frames=3, engine="plain", progress=False)
    run.save(FOLDER / "run.nc")

    class Stop(Exception):
        pass

    def stop(file: object, stats: object) -> None:
        raise Stop

    finish, recording.finish = recording.finish, stop  # type: ignore[assignment]
    try:
        simulate(problem, dt=0.05, frames=3, engine="plain", progress=False, checkpoint=FOLDER / "killed.nc")
    except Stop:
        recording.finish = finish
    return run, (FOLDER / "run.nc").read_bytes(), (FOLDER / "killed.nc.restart").read_bytes()


RUN, WHOLE, RESTART = seeds()
CASES = {str(case): {"y": case / 7, "name": "disc"} for case in range(3)}


def many(checkpoint: Path) -> bytes:
    """The frames of some runs, from a checkpoint or computed."""
    problems = [untwisting_chain(n, duration=0.1) for n in (4, 5, 6)]
    runs = simulate_many(problems, "rk4", dt=0.05, engine="plain", progress=False, checkpoint=checkpoint, threads=1)
    return b"".join(run.x.tobytes() + run.omega.tobytes() for run in runs)


def results() -> tuple[bytes, bytes, bytes]:
    """The archive of a sweep, the checkpoint of an ensemble, and the frames of its runs."""
    with Archive(FOLDER / "sweep.jsonl", "function", "content") as archive:
        for case, value in CASES.items():
            archive.write(record(case, value))
    frames = many(FOLDER / "many.jsonl")
    return (FOLDER / "sweep.jsonl").read_bytes(), (FOLDER / "many.jsonl").read_bytes(), frames


SWEEP, MANY, FRAMES = results()
TOML = b'scene = "steered_rod"\nduration = 0.5\nshear_stiffness = 6.0\nradius = 0.7\n'


def changed(data: atheris.FuzzedDataProvider, whole: bytes) -> bytes:
    """Some places of a file changed, some cut out, perhaps the end cut off."""
    content = bytearray(whole)
    for _ in range(data.ConsumeIntInRange(0, 8)):
        place = data.ConsumeIntInRange(0, len(content) - 1)
        part = data.ConsumeBytes(data.ConsumeIntInRange(0, 9))
        content[place : place + len(part)] = part
    return bytes(content[: data.ConsumeIntInRange(0, len(content))]) if data.ConsumeBool() else bytes(content)


def one_input(content: bytes) -> None:
    """Read one file."""
    data = atheris.FuzzedDataProvider(content)
    kind, path = data.ConsumeIntInRange(0, 5), FOLDER / "input"
    try:
        if kind == 0:
            path.write_bytes(data.ConsumeBytes(4096))
            scene = read_scene(path)
            assert scene.duration > 0
        elif kind == 3:
            path.write_bytes(changed(data, RESTART))
            read_restart(path)
        elif kind == 4:
            path.write_bytes(changed(data, SWEEP))
            assert all(result.value == CASES[result.case] and not result.error for result in read(path))
        elif kind == 5:
            path.write_bytes(changed(data, MANY))
            assert many(path) == FRAMES
        else:
            path.write_bytes(data.ConsumeBytes(1 << 16) if kind == 1 else changed(data, WHOLE))
            found = load(path)
            assert all(c.isprintable() or c == "\n" for c in about(path))
            for name in QUANTITIES:
                value = getattr(found, name)
                assert value.tobytes() == getattr(RUN, name)[: len(value)].tobytes(), name
    except ValueError:
        pass


def main() -> None:
    """Fuzz, from a corpus folder with what is whole in it."""
    warnings.simplefilter("ignore")
    for folder in (a for a in sys.argv[1:] if not a.startswith("-")):
        Path(folder).mkdir(exist_ok=True)
        for name, content in (
            ("toml", TOML + b"\x00"),
            ("archive", WHOLE + b"\x01"),
            ("changes", b"\x01\x02"),
            ("restart", b"\x01\x03"),
            ("sweep", b"\x01\x04"),
            ("many", b"\x01\x05"),
        ):
            (Path(folder) / name).write_bytes(content)
    atheris.Setup(sys.argv, one_input)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
