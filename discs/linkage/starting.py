"""What a state of a linkage must obey; errors name the node or the link."""

import numpy as np
import scipy  # its parts, slow to import, when they are used

from discs.arrays import Float, Matrix
from discs.linkage.equations import Equations
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
    owners = [f"link {j} between nodes {of.first[j]} and {of.second[j]}" for j in range(of.links)] * 2
    owners = [owner for owner, kept in zip(owners, rows, strict=True) if kept]
    a = pulls(of, q)[rows][:, free]
    change, multipliers = saddle.solve(
        scipy.sparse.diags_array(of.inertia.ravel()[free], format="csr"), a, -force.ravel()[free], -twice.ravel()[rows], names, owners
    )
    found, stress = np.zeros(w.size), soft.ravel()
    found[free], stress[rows] = change, -multipliers
    return found.reshape(w.shape), stress.reshape(soft.shape)


def pulls(of: Equations, q: Float) -> Matrix:
    """B C, sparse (2 n_links, 3 n): the rates of the gaps of links for velocities w."""
    shape, rows = of.shape(q), np.arange(of.links)
    along, across = of.secant(shape, shape)
    c = of.forward(q[3], np.eye(3)[:, :, None] * np.ones(of.n))  # (3, 4, n)
    parts = []
    for nodes, sign, weight in ((of.first, -1.0, 1 - of.share), (of.second, 1.0, of.share)):
        for column in range(3):
            moved = c[column][:, nodes]
            value = sign * (along * moved[None, :2]).sum(axis=1) + across * (weight * moved[3])
            for row in range(2):
                parts.append((value[row], row * of.links + rows, column * of.n + nodes))
    value, row, column = (np.concatenate(part) for part in zip(*parts, strict=True))
    return scipy.sparse.csr_array((value, (row, column)), shape=(2 * of.links, 3 * of.n))
