"""Hints for messages: why the field of a scene does not reach a tolerance."""

import numpy as np

from continuum.initial import resolve
from continuum.rod import Scene
from discs.arrays import Bool, Complex, Float
from discs.loads.binding import nonzero

BENT = 1e-3  # curvature times the length: above it a line counts as bent at a free end
COMPRESSED = 0.3  # |r'| below it counts as compressed


def bent_hint(scene: Scene) -> str:
    """A hint for scenes that start bent at a free end, which violates the end condition x'y'' = y'x''; empty for others."""
    curved = any(nonzero(getattr(load, "curvature", 0.0)) for load in scene.loads)  # the end may have a curvature then
    if scene.closed or curved or not scene.rod.bending_stiffness or not scene.rod.radius:
        return ""
    length = scene.rod.length
    d = 1e-4 * length
    curvature = 0.0
    for places in (d * np.arange(4.0), length - d * np.arange(4.0)):
        fields = scene.fields(places)
        r = fields["x"] + 1j * fields["y"]
        slope, bend = (-3 * r[0] + 4 * r[1] - r[2]) / (2 * d), (2 * r[0] - 5 * r[1] + 4 * r[2] - r[3]) / d**2  # to d^2
        curvature = max(curvature, float(abs((slope.conjugate() * bend).imag)) / max(float(abs(slope)) ** 2, 1e-300))
    if curvature * length < BENT:
        return ""
    return "; the line starts bent at a free end, which may be why: the end has no curvature and sends out ever shorter waves"


def points_inside(scene: Scene) -> list[float]:
    """Places inside the rod at which loads act."""
    points = [at for load in scene.loads if isinstance(at := getattr(load, "at", None), int | float)]
    return [at for at in points if scene.closed or 0 < at < scene.rod.length]


def point_hint(scene: Scene) -> str:
    """A hint for scenes with a load at a point inside the rod; empty for others.

    The normal part of K r'' has a corner there, so the tangential part of e'' jumps, and with it the tangential part of r''. Its
    polynomials err like 1/n.
    """
    inside = points_inside(scene)
    if not inside:
        return ""
    return (
        f"; the load at the point s = {inside[0]:g} makes r'' jump there, and errors fall like 1/functions: spread it over a "
        f"width, as by a pattern like exp(-((s - {inside[0]:g})/{scene.rod.length / 40:.2g})^2)"
    )


def rough_hint(slopes: Complex, times: Float, good: Bool) -> str:
    """A hint from the frames (F,) at which motions agree within the bounds: until when they do, and whether |r'| falls there.

    slopes : (F, n), r' at the nodes of the finest motion.
    """
    if good.all() or not good.any() or good.argmin() == 0:
        return ""
    first = int(good.argmin())
    said = f"; up to t = {times[first - 1]:.4g} it is reached"
    least = np.abs(slopes[first:]).min()
    if least > COMPRESSED:
        return said
    return said + (
        f", then |r'| falls to {least:.2g}: where the line is so compressed, the motion becomes rough, and functions resolve it "
        "slowly"
    )


def corner_hint(scene: Scene) -> str:
    """A hint for scenes whose rod may have a corner in its parameters; empty for others."""
    kinks = resolve(scene).kinks if scene.rod.varying else ()
    if not kinks:
        return ""
    return (
        f"; the scene, its rod included, has a corner at s = {kinks[0]:.6g}, which functions resolve slowly: round it, or take "
        "method='richardson'"
    )
