"""Runs in files of other tools."""

import json
import sys
from dataclasses import replace

import h5py
import numpy as np
import pandas as pd
import pytest

from discs import State, simulate
from discs.__main__ import main
from discs.files import shapes
from discs.mechanics import textbook
from discs.pictures import geometry
from tests.conftest import Model, uneven


@pytest.fixture(scope="module")
def run():
    problem = uneven(6, Model("ring", "steered"))
    return simulate(problem, dt=0.05, frames=5, want=("contact_force",), engine="plain", progress=False)


def test_a_table(run, tmp_path):
    run.save(tmp_path / "run.csv")
    table = pd.read_csv(tmp_path / "run.csv")
    assert len(table) == 5 * 6
    row = table.iloc[3 * 6 + 4]  # frame 3, disc 4
    force = "mass length per time squared"
    expected = {
        "t (time)": run.t[3],
        "disc (number)": 4,
        "s (length)": run.s[4],
        "x (length)": run.x[3, 4],
        "phi (rad)": run.phi[3, 4],
        "omega (rad per time)": run.omega[3, 4],
        f"contact_force_x ({force})": run.contact_force[3, 0, 4],
        f"contact_force_y ({force})": run.contact_force[3, 1, 4],
        "energy (mass length squared per time squared)": run.energy[3],
    }
    assert {name: row[name] for name in expected} == expected  # to the last digit
    frame = run.to_dataframe()
    assert list(frame.columns) == [name.partition(" (")[0] for name in table.columns]
    assert frame.attrs["units"]["phi_rate"] == "rad per time"
    assert not any("initial" in name or "checksum" in name for name in frame)


def test_a_table_of_a_mechanical_system():
    path = textbook.rolling_disc(1.3, 0.6, 0.4, 0.7, roll_rate=1.1, turn_rate=0.8, slope=2.1).integrate(np.linspace(0, 1, 4))
    frame = path.to_dataframe()
    assert list(frame.columns) == ["t", *path.names, *(f"{name}_rate" for name in path.names), "energy"]
    np.testing.assert_array_equal(frame[path.names[2]], path.q[:, 2])


def test_what_a_notebook_shows(run):
    shown = replace(run, stats=run.stats | {"method": "<b>"})._repr_html_()
    assert "data:image/png;base64," in shown
    assert "6 discs, 5 frames, t = 0 to 1" in shown
    assert "&lt;b&gt;" in shown
    assert "<img" not in run[:1]._repr_html_()
    book = textbook.rolling_disc(1.3, 0.6, 0.4, radius=0.7, roll_rate=1.1, turn_rate=0.8, slope=2.1)
    assert "4 coordinates" in book.integrate([0.0, 0.5, 1.0])._repr_html_()


def test_bodies_for_paraview(run, tmp_path):
    """Hub, spoke and axle of each polygon are those of the disc, at each time. (ParaView's reader, VTK 9, was tried by hand.)"""
    run.save(tmp_path / "run.vtkhdf")
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        root = file["VTKHDF"]
        assert root.attrs["Type"] == b"PolyData"
        points = root["Points"][:].reshape(5, 6, shapes.CORNERS + 1, 3)
        np.testing.assert_array_equal(root["Steps/Values"], run.t)
        np.testing.assert_array_equal(root["Steps/PointOffsets"], 6 * (shapes.CORNERS + 1) * np.arange(5))
        cells = root["CellData/omega"][:].reshape(5, -1)
        np.testing.assert_allclose(cells[:, :6], run.omega, rtol=1e-6)
        np.testing.assert_allclose(cells[:, 7:], run.omega, rtol=1e-6)  # after the rod, which has none
        force = root["CellData/force"][:].reshape(5, -1)[:, :6]
        np.testing.assert_allclose(force**2, (run.contact_force**2).sum(axis=1), rtol=1e-5)
        corners = root["Polygons/Connectivity"][:].reshape(6, shapes.CORNERS)
        assert root["Lines/Connectivity"][-7:].tolist() == [*corners[:, 0] - 1, 0]  # the rod, closed
    radius = geometry.drawn_radius(run, None)
    np.testing.assert_allclose(points[:, :, 0, :2], np.stack([run.x, run.y], axis=-1), atol=1e-6)
    spoke = (points[:, :, 1] - points[:, :, 0]) / radius
    np.testing.assert_allclose(spoke[..., 2], np.cos(run.theta), atol=1e-5)
    np.testing.assert_allclose(spoke[..., 0], -np.sin(run.phi) * np.sin(run.theta), atol=1e-5)
    axle = np.stack([np.cos(run.phi), np.sin(run.phi), 0 * run.phi], axis=-1)
    np.testing.assert_allclose(((points - points[:, :, :1]) * axle[:, :, None]).sum(axis=-1), 0, atol=1e-6)


def animated(file):
    """The animation of a .glb file: what it gives each node, and its times."""
    content = file.read_bytes()
    size = int.from_bytes(content[12:16], "little")
    tree, binary = json.loads(content[20 : 20 + size]), content[28 + size :]

    def values(accessor):
        said = tree["accessors"][accessor]
        view = tree["bufferViews"][said["bufferView"]]
        data = binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        return np.frombuffer(data, "<f4")[: said["count"] * {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[said["type"]]].reshape(
            said["count"], -1
        )

    (animation,) = tree["animations"]
    found, times = {}, []
    for channel in animation["channels"]:
        sampler = animation["samplers"][channel["sampler"]]
        times.append(values(sampler["input"])[:, 0])
        found[tree["nodes"][channel["target"]["node"]]["name"], channel["target"]["path"]] = values(sampler["output"])
    return found, np.array(times)


def test_bodies_for_blender(run, tmp_path):
    """The animated nodes turn the model's spoke, its z axis, into that of the disc."""
    trimesh = pytest.importorskip("trimesh")
    run.save(tmp_path / "run.glb")
    found, times = animated(tmp_path / "run.glb")
    np.testing.assert_allclose(times, np.broadcast_to(run.t, times.shape), rtol=1e-6)
    assert len([name for name, path in found if name.startswith("link") and path == "scale"]) == 6  # a ring
    for i in range(6):
        places, (x, y, z, w) = found[f"disc {i}", "translation"], found[f"disc {i}", "rotation"].T
        np.testing.assert_allclose(places[:, :2], np.stack([run.x, run.y], axis=-1)[:, i], atol=1e-6)
        spoke = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])  # the rotated z axis
        phi, theta = run.phi[:, i], run.theta[:, i]
        expected = [-np.sin(phi) * np.sin(theta), np.cos(phi) * np.sin(theta), np.cos(theta)]
        np.testing.assert_allclose(spoke, expected, atol=1e-5)
    scene = trimesh.load(tmp_path / "run.glb")
    assert set(scene.geometry) == {"disc", "link"}


def test_two_discs_that_turn_twice_have_one_link_and_turn_steadily(tmp_path):
    """Quaternions of q and -q are the same turn: between frames they must not jump, as programs take values between them."""
    pytest.importorskip("trimesh")
    problem = uneven(2, Model("springs", "steered"), equal=True)
    state = State([0.0, 3.1], [0.0, 0.0], [0.3, 0.3], [5.0, 5.0], phi=[0.0, 0.0])
    simulate(replace(problem, initial=state, duration=3.0), dt=0.05, frames=61, engine="plain", progress=False).save(
        tmp_path / "run.glb"
    )
    found, _ = animated(tmp_path / "run.glb")
    assert sorted(name for name, path in found if path == "scale") == ["link 0"]
    np.testing.assert_allclose(found["link 0", "translation"][:, 0], 1.55, atol=1e-6)
    for disc in ("disc 0", "disc 1"):
        turns = found[disc, "rotation"]
        np.testing.assert_allclose((turns[1:] * turns[:-1]).sum(axis=1), np.cos(0.05 * 5.0 / 2), atol=1e-5)


def test_without_trimesh(run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(ValueError, match=r"\.glb needs the package trimesh"):
        run.save(tmp_path / "run.glb")
    assert not list(tmp_path.iterdir())


def test_from_the_command_line(tmp_path, capsys):
    command = ["run", "--n", "5", "--t", "0.1", "--dt", "0.05", "--frames", "2", "--engine", "plain", "--quiet"]
    file = tmp_path / "run.csv"
    assert main([*command, "--save", str(file)]) == 0
    assert len(pd.read_csv(file)) == 10
    assert main([*command, "--save", str(file)]) == 2
    assert "give --overwrite to replace it" in capsys.readouterr().err
    assert main([*command, "--save", str(file), "--overwrite", "--t", "0.2"]) == 0
    assert pd.read_csv(file)["t (time)"].max() == 0.2
