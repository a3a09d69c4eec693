r"""Couple and force of the ground at free ends by exact identities: quadratures along the motion instead of derivatives of r''.

At a free end without loads, with z = r' as complex numbers, r'' = tau z and r''' = (sigma + i nu) z, docs/ground-force.md derives

    K tau. = -beta theta' omega/|z|^2,
    K sigma + (3/2 - gamma) K tau^2 + beta theta'^2/|z|^2 - (alpha + rho R^2 |h|^2) omega^2/(2 |z|^2)
        + beta/|z|^2 int theta'' omega dt = const,

with |z| constant and gamma = d ln|h|/d ln|z|, 1 for the field law and 0 for the unit law. The couple is -K tau z at s = 0 and
K tau z at s = length, the part of the force along the line K sigma z and -K sigma z. The integrands are sums over the stages of
steps. On the paper's rod the couple is ten to a hundred times as accurate as that from r'', the force as that from r'''.
"""

import numpy as np

from continuum.galerkin import SpectralRod
from continuum.initial import resolve
from continuum.rod import Scene
from discs.arrays import Complex, Float
from discs.integrators.tableaux import tableau
from discs.skew import Phase

BENT = 1e-6  # curvature times the length: beyond it an initial line violates the condition at the end


def hold(scene: Scene) -> bool:
    """Whether the identities hold: for uniform rods with free ends that roll, without loads, and straight at the ends."""
    if scene.closed or scene.loads or scene.rod.varying or not scene.rod.radius or not scene.rod.bending_stiffness:
        return False
    z, z1, _ = _line(scene)
    return bool((np.abs((z.conj() * z1).imag) * scene.rod.length < BENT * np.abs(z) ** 2).all())


class EndIdentities:
    """The identities at the two ends of a rod on n functions, for a scene where they `hold`.

    count : number of integrals.
    """

    count = 4

    def __init__(self, rod: SpectralRod) -> None:
        scene, law = rod.scene, rod.law
        self._rod, self._ends = rod, np.array([0.0, scene.rod.length])
        self._field = [rod.functions.field(self._ends, m).T for m in range(3)]
        initial = resolve(scene)
        self._twists = [initial.at("theta", self._ends, m) for m in range(3)]
        z, z1, z2 = _line(scene)
        self._square = np.abs(z) ** 2
        size = law.size(np.abs(z))
        along = np.stack([z.real, z.imag])
        self._gamma = (along * law.rate(along, along)).sum(axis=0) / (np.abs(z) * size)
        p = scene.rod.uniform("identities at ends")
        self._inertia, self._beta = p.spin_inertia + p.density * p.radius**2 * size**2, p.torsion_stiffness
        self._stiffness = p.bending_stiffness
        self._tau = (z1 / z).real
        first = Phase(*(part[None] for part in rod.start))
        self._constant = self._stiffness * (z2 / z).real + self._others(first, self._stiffness * self._tau, np.zeros(2))

    def rates(self, h: float, z: Phase, v: Float) -> Float:
        """The integrands beta theta' omega and beta theta'' omega at the two ends, (s, 4), at the stages of a step h from z.

        v : (s, 3, n), the rates at the stages.
        """
        q = (z.hi + z.lo)[2] + h * tableau(len(v)).a @ v[:, 2]
        twist = np.stack([self._twists[m] + q @ self._field[m] for m in (1, 2)], axis=1)
        return (self._beta * twist * (v[:, 2] @ self._field[0])[:, None]).reshape(-1, 4)

    def at(self, z: Phase, integrals: Float) -> tuple[Float, Float]:
        """K tau and K sigma at the two ends, (k, 2), for states with a first axis k and the integrals (k, 4) of `rates`."""
        couple = self._stiffness * self._tau - integrals[:, :2] / self._square
        return couple, self._constant - self._others(z, couple, integrals[:, 2:])

    def _others(self, z: Phase, couple: Float, integral: Float) -> Float:
        """The terms of the second identity but K sigma, (k, 2)."""
        twist = self._twists[1] + (z.hi + z.lo)[:, 2] @ self._field[1]
        omega = self._rod.omega(z) @ self._field[0]
        energies = self._beta * twist**2 - 0.5 * self._inertia * omega**2 + integral
        found: Float = (1.5 - self._gamma) * couple**2 / self._stiffness + energies / self._square
        return found


def _line(scene: Scene) -> tuple[Complex, Complex, Complex]:
    """The first three derivatives of the initial line at the two ends, as complex numbers."""
    initial, ends = resolve(scene), np.array([0.0, scene.rod.length])
    z, z1, z2 = (initial.at("x", ends, m) + 1j * initial.at("y", ends, m) for m in (1, 2, 3))
    return z, z1, z2
