"""Discs as moving bodies in files of other programs: glTF (.glb) for Blender and web pages, VTKHDF (.vtkhdf) for ParaView.

Both hold at most 65 discs and the frames that a page would show (`discs.pictures.geometry.thinned`), discs with the radius of the
pictures, a bold spoke along d_3, and the rod through the hubs. Lengths are those of the run, z is up (in glTF y, by its rule).
"""

from pathlib import Path
from typing import Any

import numpy as np
import scipy

from discs.arrays import Array, Float
from discs.files import safe
from discs.pictures import geometry
from discs.pictures.style import BLUE, ORANGE
from discs.solution import Result, Solution
from discs.warn import warn

ABOUT = 65  # discs
CORNERS = 24  # of a disc in ParaView


def _prepared(run: Result, path: str | Path) -> tuple[Solution, Float, Float, Float]:
    """The run at the frames that are written, the drawn radius, and the poses of drawn discs. Warns of thinned frames."""
    one = run.discs
    shown = geometry.picked(one.s, ABOUT)
    some = geometry.thinned(one, shown.size)
    if some.t.size < one.t.size:
        warn(f"{path} holds {some.t.size} of the run's {one.t.size} frames: take run[i:j] for a part with all of them")
    radius = geometry.drawn_radius(one, None)
    hubs, axes = geometry.poses(some, radius)
    return some, np.asarray(radius), hubs[:, shown], axes[:, shown]


def save_glb(run: Result, path: str | Path) -> None:
    """Write an animated scene in glTF: the nodes "disc 0", "disc 1", ... move, and "link 0", ... between their hubs.

    One second is a unit of time. Frames that are too far apart for motion between them (`geometry.TOO_FAR`) are shown one by one.

    Raises
    ------
    ValueError : without the package trimesh; if no file can be made at `path`.
    """
    try:
        import trimesh
    except ImportError:
        raise ValueError('.glb needs the package trimesh: pip install "rolling-discs[shapes]"') from None
    some, size, hubs, axes = _prepared(run, path)
    radius, n = float(size), hubs.shape[1]

    def bar(length: float, width: float, colour: str) -> Any:
        made = trimesh.creation.box((1.5 * thick, width, length), trimesh.transformations.translation_matrix((0, 0, length / 2)))
        made.visual.vertex_colors = _bytes(colour)
        return made

    thick = 0.05 * radius
    along_x = trimesh.transformations.rotation_matrix(np.pi / 2, (0, 1, 0))
    plate = trimesh.creation.cylinder(radius, thick, sections=48, transform=along_x)
    plate.visual.vertex_colors = _bytes("#9cc4e0")
    rod = trimesh.creation.cylinder(0.07 * radius, 1.0, sections=12, transform=along_x)
    rod.visual.vertex_colors = _bytes(BLUE)
    scene = trimesh.Scene()
    scene.graph.update("rod", "world", matrix=trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0)))  # y is up in glTF
    tracks = {f"disc {i}": (hubs[:, i], _quaternions(axes[:, i]), None) for i in range(n)}
    ahead = np.roll(hubs, -1, axis=1) - hubs
    for i in range(n - 1 + geometry.is_ring(some) if n > 1 else 0):
        tracks[f"link {i}"] = (hubs[:, i] + ahead[:, i] / 2, _quaternions(_along(ahead[:, i])), np.linalg.norm(ahead[:, i], axis=1))
    for name, shape in (("disc", trimesh.util.concatenate([plate, bar(0.97 * radius, 0.15 * radius, ORANGE)])), ("link", rod)):
        nodes = [node for node in tracks if node.startswith(name)]
        if nodes:
            scene.add_geometry(shape, nodes[0], name, "rod")
            for node in nodes[1:]:
                scene.graph.update(node, "rod", geometry=name, matrix=np.eye(4))
    held = geometry.off_between_frames(some, radius) > geometry.TOO_FAR

    def animate(buffers: Any, tree: dict[str, Any]) -> None:
        _animate(buffers, tree, some.t, tracks, "STEP" if held else "LINEAR")

    with safe.fresh(safe.target(path)) as new:
        new.write(trimesh.exchange.gltf.export_glb(scene, buffer_postprocessor=animate))


def _bytes(colour: str) -> Array:
    return np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)] + [255], dtype=np.uint8)


def _along(way: Float) -> Float:
    """Right-handed axes (F, 3, 3), columns, whose first one is along horizontal vectors (F, 3)."""
    first = way / np.maximum(np.linalg.norm(way, axis=1), 1e-300)[:, None]
    third = np.broadcast_to([0.0, 0.0, 1.0], way.shape)
    return np.stack([first, np.cross(third, first), third], axis=-1)


def _quaternions(axes: Float) -> Float:
    """Quaternions (F, 4), real part last, of rotation matrices (F, 3, 3), each on the side of the one before."""
    found = scipy.spatial.transform.Rotation.from_matrix(axes).as_quat()
    turned = np.cumprod(np.append(1.0, np.where((found[1:] * found[:-1]).sum(axis=1) < 0, -1.0, 1.0)))
    return np.asarray(found * turned[:, None])


def _animate(buffers: Any, tree: dict[str, Any], t: Float, tracks: dict[str, Any], how: str) -> None:
    """Add the motion of nodes to a glTF scene: of each (name) places (F, 3), quaternions (F, 4), and lengths (F,) or None."""

    def accessor(values: Float, kind: str) -> int:
        data = np.ascontiguousarray(values, "<f4")
        key = f"track {len(tree['accessors'])}"
        buffers[key] = data.tobytes()
        said = {"bufferView": buffers.index(key), "componentType": 5126, "count": len(data), "type": kind}
        if kind == "SCALAR":
            said |= {"min": [float(data.min())], "max": [float(data.max())]}
        tree["accessors"][key] = said
        return int(tree["accessors"].index(key))

    clock, samplers, channels = accessor(t - t[0], "SCALAR"), [], []
    for i, node in enumerate(tree["nodes"]):
        if node.get("name") not in tracks:
            continue
        places, turns, lengths = tracks[node["name"]]
        parts = {"translation": (places, "VEC3"), "rotation": (turns, "VEC4")}
        if lengths is not None:
            parts["scale"] = np.stack([lengths, lengths**0, lengths**0], axis=1), "VEC3"
        node.pop("matrix", None)
        for name, (values, kind) in parts.items():
            node[name] = values[0].tolist()
            samplers.append({"input": clock, "output": accessor(values, kind), "interpolation": how})
            channels.append({"sampler": len(samplers) - 1, "target": {"node": i, "path": name}})
    if t.size > 1:
        tree["animations"] = [{"name": "motion", "samplers": samplers, "channels": channels}]


def save_vtkhdf(run: Result, path: str | Path) -> None:
    """Write discs as polygons, with spokes and rod as lines, for each time; ParaView 5.12 or newer opens it.

    Cells have the arrays disc (its number), theta, omega and, if recorded, force (size of the ground's force); NaN on the rod.
    """
    import h5py  # slow, and not needed to load the package

    some, size, hubs, axes = _prepared(run, path)
    frames, n = hubs.shape[:2]
    angle = 2 * np.pi * np.arange(CORNERS) / CORNERS
    rim = np.cos(angle)[:, None] * axes[:, :, None, :, 2] + np.sin(angle)[:, None] * axes[:, :, None, :, 1]
    points = np.concatenate([hubs[:, :, None], hubs[:, :, None] + size * rim], axis=2)  # the first corner is the spoke's end
    of_disc = (CORNERS + 1) * np.arange(n)
    rod = np.append(of_disc, of_disc[:1]) if geometry.is_ring(some) else of_disc
    lines = [[disc, disc + 1] for disc in of_disc.tolist()] + [rod.tolist()] * (n > 1)
    polygons = [range(disc + 1, disc + 1 + CORNERS) for disc in of_disc.tolist()]
    shown = geometry.picked(some.s, ABOUT)
    values = {"disc": np.broadcast_to(shown, (frames, n)), "theta": some.theta[:, shown], "omega": some.omega[:, shown]}
    if some.contact_force is not None:
        values["force"] = np.hypot(some.contact_force[:, 0], some.contact_force[:, 1])[:, shown]
    gap = np.full((frames, len(lines) - n), np.nan)
    cells = len(lines) + len(polygons)
    with safe.fresh(safe.target(path)) as new, h5py.File(new.name, "w", locking=False) as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 2])
        root.attrs.create("Type", b"PolyData", dtype=h5py.string_dtype("ascii", 8))
        root["Points"] = points.reshape(-1, 3).astype("<f4")
        root["NumberOfPoints"] = np.array([n * (CORNERS + 1)])
        kinds: dict[str, Any] = {"Vertices": [], "Lines": lines, "Polygons": polygons, "Strips": []}
        for name, members in kinds.items():
            group, sizes = root.create_group(name), [len(member) for member in members]
            group["NumberOfCells"] = np.array([len(members)])
            group["NumberOfConnectivityIds"] = np.array([sum(sizes)])
            group["Offsets"] = np.append(0, np.cumsum(sizes, dtype=np.int64)).astype(np.int64)
            group["Connectivity"] = np.array([i for member in members for i in member], dtype=np.int64)
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = frames
        steps["Values"] = some.t
        zeros = np.zeros(frames, dtype=np.int64)
        steps["NumberOfParts"], steps["PartOffsets"] = zeros + 1, zeros
        steps["PointOffsets"] = np.arange(frames) * n * (CORNERS + 1)
        steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = np.zeros((frames, 4), dtype=np.int64)  # the same cells each time
        data, offsets = root.create_group("CellData"), steps.create_group("CellDataOffsets")
        for name, value in values.items():
            data[name] = np.concatenate([value, gap, value], axis=1).astype("<f4").ravel()
            offsets[name] = np.arange(frames) * cells
