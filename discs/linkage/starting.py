"""What a state of a linkage must obey; errors name the node or the link."""

from collections.abc import Sequence

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Bool, Float, Matrix
from discs.linkage.equations import Equations
from discs.linkage.linkage import Linkage, LinkageState
from discs.mechanics import saddle

CLOSE = 1e-9  # relative; larger differences from a constraint are refused


def speeds(of: Equations, q: Float, rates: Float) -> Float:
    """The velocities w (3, n) from the rates of x, y, phi (3, n); ValueError for one that a wheel or a clamp does not allow."""
    phi, wheel = q[3], of.wheel
    along = np.where(wheel, np.cos(phi) * rates[1] - np.sin(phi) * rates[0], rates[0])
    across = np.where(wheel, np.cos(phi) * rates[0] + np.sin(phi) * rates[1], rates[1])
    w = np.array([along, across, rates[2]])
    least = CLOSE * max(float(np.abs(w[:2]).max()), of.of.length * float(np.abs(w[2]).max()))
    for row, node in np.argwhere(of.fixed & (np.abs(w) > least)).tolist():
        what = "slips across its wheel" if wheel[node] and row == 1 else "moves although it is held"
        name = of.names[row * of.n + node] if row != 1 or not wheel[node] else f"node {node}"
        raise ValueError(f"initial velocity: {name} {what}, by {w[row, node]:.3g} per time; give a velocity that is allowed")
    return np.where(of.fixed, 0.0, w)


def check(of: Equations, q: Float, w: Float) -> None:
    """Refuse a state off a rigid link, and a linkage that rigid links over-determine or that lacks inertia."""
    rigid = of.compliance == 0
    apart = np.where(rigid, np.abs(of.gap(of.shape(q))) / of.k, 0.0)
    rate = np.where(rigid, np.abs(of.gap_rate(q, of.forward(q[3], w))), 0.0)
    fastest = max(float(np.abs(w[:2]).max()), of.of.length * float(np.abs(w[2]).max()))
    for what, off, least in (("place", apart, CLOSE), ("velocity", rate, CLOSE * fastest)):
        if off.size and off.max() > least:
            link = int(np.argmax(off.max(axis=0)))
            raise ValueError(
                f"initial {what}: the rigid link {link} between nodes {of.first[link]} and {of.second[link]} is off by "
                f"{off.max():.3g}; start with a {what} that it allows, or give it a compliance"
            )
    response(of, q, w, 0.0)


def response(of: Equations, q: Float, w: Float, t: float) -> tuple[Float, Float]:
    """w' (3, n) and the forces of links (2, n_links); ValueError, with the node or the link, if they are not determined."""
    rigid, rest = of.compliance == 0, of.of.rest(t)
    soft = np.where(rigid, 0.0, of.gap(of.shape(q)) / np.where(rigid, 1.0, of.compliance))
    force, twice = of.balance(q, w, np.zeros_like(w), soft, rest)
    free, rows = ~of.fixed.ravel(), rigid.ravel()
    names = [name for name, moves in zip(of.names, free, strict=True) if moves]
    a, owners = pulls(of, q)[rows][:, free], owners_of(of, rows)
    change, multipliers = saddle.solve(
        scipy.sparse.diags_array(of.inertia.ravel()[free], format="csr"),
        a,
        -force.ravel()[free],
        -twice.ravel()[rows],
        names,
        owners,
    )
    found, stress = np.zeros(w.size), soft.ravel()
    found[free], stress[rows] = change, -multipliers
    return found.reshape(w.shape), stress.reshape(soft.shape)


def nearest(linkage: Linkage, state: LinkageState) -> LinkageState:
    """The state near the given one that obeys rigid links, wheels and what is held, by Newton's method; ValueError if none is."""
    of = Equations(linkage)
    q = np.array([state.x, state.y, state.theta, state.phi], dtype=float)
    rates = np.array([state.x_rate, state.y_rate, state.phi_rate], dtype=float)
    rigid = (of.compliance == 0).ravel()
    moves = np.array([of.wheel | ~of.fixed[0], of.wheel | ~of.fixed[1], np.zeros(of.n, dtype=bool), ~of.fixed[2]]).ravel()
    names = [f"{row} of node {i}" for row in ("x", "y", "theta", "phi") for i in range(of.n)]

    def closest(a: Matrix, free: Bool, given: Float, level: Float, names: Sequence[str]) -> Float:
        found = np.zeros(given.size)
        one = scipy.sparse.eye_array(int(free.sum()), format="csr")
        picked = [name for name, kept in zip(names, free, strict=True) if kept]
        found[free] = saddle.solve(one, a[rigid][:, free], given.ravel()[free], level, picked, owners_of(of, rigid))[0]
        return found.reshape(given.shape)

    for _ in range(50):
        gap = of.gap(of.shape(q)).ravel()[rigid]
        if np.abs(gap).max(initial=0.0) <= 1e-14 * linkage.length:
            break
        q = q + closest(slopes(of, q), moves, np.zeros_like(q), -gap, names)
    else:
        raise ValueError("no state near the given one obeys the rigid links; start nearer to one")
    cos, sin = np.cos(q[3]), np.sin(q[3])
    w = np.array([np.where(of.wheel, cos * rates[1] - sin * rates[0], rates[0]), rates[1], rates[2]])
    w = closest(pulls(of, q), ~of.fixed.ravel(), w, np.zeros(int(rigid.sum())), of.names)
    v = of.forward(q[3], w)
    return LinkageState(q[0], q[1], q[3], q[2], v[0], v[1], v[3])


def owners_of(of: Equations, rigid: Bool) -> list[str]:
    """Names of the rigid rows of links."""
    owners = [f"link {j} between nodes {of.first[j]} and {of.second[j]}" for j in range(of.links)] * 2
    return [owner for owner, kept in zip(owners, rigid, strict=True) if kept]


def slopes(of: Equations, q: Float) -> Matrix:
    """B, sparse (2 n_links, 4 n): the rates of the gaps of links for rates of the coordinates."""
    return _joined(of, q, np.eye(4)[:, :, None] * np.ones(of.n))


def pulls(of: Equations, q: Float) -> Matrix:
    """B C, sparse (2 n_links, 3 n): the rates of the gaps of links for velocities w."""
    return _joined(of, q, of.forward(q[3], np.eye(3)[:, :, None] * np.ones(of.n)))


def _joined(of: Equations, q: Float, moved: Float) -> Matrix:
    """B times the columns `moved` (columns, 4, n) of each node."""
    shape, rows = of.shape(q), np.arange(of.links)
    along, across = of.secant(shape, shape)
    parts = []
    for nodes, sign, weight in ((of.first, -1.0, 1 - of.share), (of.second, 1.0, of.share)):
        for column, rates in enumerate(moved[..., nodes]):
            values: Float = sign * (along * rates[None, :2]).sum(axis=1) + across * (weight * rates[3])
            parts += [(values[row], row * of.links + rows, column * of.n + nodes) for row in range(2)]
    data, at, of_column = (np.concatenate(part) for part in zip(*parts, strict=True))
    return scipy.sparse.csr_array((data, (at, of_column)), shape=(2 * of.links, len(moved) * of.n))
