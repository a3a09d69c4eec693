"""diffsol (Rust) as a peer, through pydiffsol, with the right-hand side in its language DiffSL, which it differentiates itself."""

import time as clock
from contextlib import suppress
from functools import cache
from typing import Any

import numpy as np
from scipy import sparse

from compare.peers.peer import THIRDS, Cutoff, Outcome, Peer
from discs import Chain, Problem
from discs.arrays import Float

PARTS = (0.01, 0.03, 0.1, 0.25)
MOST = {"bdf": 512, "tsit45": 512}  # discs: of more, orders above 2 crawl for hours, and explicit steps are far too short
METHODS = ("bdf", "tr_bdf2", "esdirk34", "tsit45")


def diffsol_peers(problem: Problem) -> list[Peer]:
    """diffsol's implicit methods with sparse Jacobians, and its explicit one; plain free ends without loads only.

    Its runs cannot be interrupted: a setting is tried first on parts of the run, and given up when one takes more than its share.
    (Not in a copy of the process that the system could end: diffsol's threads do not live there.) Tolerances are those of CVODE.
    """
    import pydiffsol as ds

    rows = len(problem.system.rows)
    n = problem.chain.n
    # KLU of pydiffsol 0.6.2 crashes here: its own sparse LU
    code = in_diffsl(problem)
    made: list[Any] = []

    def compiled(again: bool = False) -> Any:
        if again or not made:
            made[:] = [ds.Ode(code, matrix_type=ds.faer_sparse, linear_solver=ds.lu)]
        return made[0]

    mass, _, spin = problem.system.weights[:3]
    unit = float(np.sqrt(np.where(spin > 0, spin, mass)).min())  # of pi; bdf is faster without

    def peer(name: str) -> Peer:
        def solve(rtol: float, end: float) -> tuple[Float, float]:
            ode = compiled()
            ode.ode_solver, ode.rtol, ode.atol = getattr(ds, name), rtol, 0.1 * rtol * (1.0 if name == "bdf" else unit)
            begun = clock.process_time()
            try:
                y = np.asarray(ode.solve_dense(np.ones(1), np.array([end])).ys)[:, -1]
            except RuntimeError as error:
                raise ArithmeticError(str(error)) from None
            except BaseException as error:
                if type(error).__name__ != "PanicException":  # Rust's, a BaseException: esdirk34 misses some ends of runs
                    raise
                compiled(again=True)  # the old one stays locked
                raise ArithmeticError(str(error)) from None
            return y, clock.process_time() - begun

        @cache
        def hopeless(rtol: float, seconds: float) -> bool:
            for part in PARTS:
                with suppress(ArithmeticError):
                    if solve(rtol, part * problem.duration)[1] > 2 * part * seconds:
                        return True
            return False

        def run(rtol: float, seconds: float) -> Outcome:
            if hopeless(rtol, seconds):
                raise Cutoff
            y, spent = solve(rtol, problem.duration)
            if spent > seconds:
                raise Cutoff
            return Outcome(y[: rows * n].reshape(rows, n), 0, 0, None, spent)

        return Peer(f"diffsol {name}", THIRDS, run, "right-hand side written in DiffSL and compiled by LLVM")

    return [peer(name) for name in METHODS if n <= MOST.get(name, n)]


def in_diffsl(problem: Problem) -> str:
    """The reduced equations in DiffSL, in the order x, y, theta, (phi,) pi (, pi of the turning)."""
    chain, system, z = problem.chain, problem.system, problem.start()
    n, k = chain.n, chain.k
    step = sparse.diags([-np.ones(n), np.ones(n - 1)], [0, 1], (n - 1, n)).tocsr()

    def springs(strain: Any, stiffness: Any) -> Any:
        return strain.T @ sparse.diags(np.broadcast_to(stiffness, strain.shape[0])) @ strain

    matrices = {"T": springs(step, chain.torsion_stiffness) / k}
    vectors = dict(zip(("x0", "y0", "th0", "ph0"), z.hi, strict=False))
    vectors |= dict(zip(("p0", "h0"), np.atleast_2d(z.pi), strict=False))
    vectors |= {"m": system.weights[0], "w": system.weights[2], "r": np.broadcast_to(chain.radius, n)}
    if isinstance(chain, Chain):
        slope = sparse.diags([-np.ones(n - 1), np.ones(n - 1)], [-1, 1], (n, n)).tolil()
        slope[0, :3], slope[-1, -3:] = (-3, 4, -1), (1, -4, 3)
        bend = step[:-1, :-1] @ step
        matrices |= {"S": slope / (2 * k), "K": springs(bend, chain.bending_stiffness) / k**3}
        length = {"field": "1", "unit": "sqrt(a_i * a_i + b_i * b_i)"}[chain.rolling]
        heading = f"a_i {{ S_ij * x_j }} b_i {{ S_ij * y_j }} l_i {{ r_i / {length} }} ex_i {{ -b_i * l_i }} ey_i {{ a_i * l_i }}"
        force = "fx_i { K_ij * x_j } fy_i { K_ij * y_j }"
        unknowns = ", p = p0_i"
        rates = "ex_i * om_i, ey_i * om_i, om_i, -(ex_i * fx_i + ey_i * fy_i + ft_i) / rt_i"
    else:
        matrices |= {"D": step / k, "E": step.T, "B": abs(step) / 2, "C": abs(step).T * (k / 2)}
        matrices["K"] = springs(step, chain.bending_stiffness) / k
        links = n - 1
        vectors |= {"A": np.broadcast_to(chain.stretch_stiffness, links), "G": np.broadcast_to(chain.shear_stiffness, links)}
        vectors["v"] = np.sqrt(system.weights[3])
        heading = "ex_i { -r_i * sin(ph_i) } ey_i { r_i * cos(ph_i) }"
        force = (
            "mid_i { B_ij * ph_j } c_i { cos(mid_i) } s_i { sin(mid_i) } dx_i { D_ij * x_j } dy_i { D_ij * y_j }\n"
            "g1_i { c_i * dx_i + s_i * dy_i } g2_i { c_i * dy_i - s_i * dx_i } n1_i { A_i * (g1_i - 1) } n2_i { G_i * g2_i }\n"
            "qx_i { n1_i * c_i - n2_i * s_i } qy_i { n1_i * s_i + n2_i * c_i } qm_i { n1_i * g2_i - n2_i * g1_i }\n"
            "fx_i { E_ij * qx_j } fy_i { E_ij * qy_j } kp_i { K_ij * ph_j } mp_i { C_ij * qm_j } tu_i { h_i / v_i }"
        )
        unknowns = ", ph = ph0_i, p = p0_i, h = h0_i"
        rates = "ex_i * om_i, ey_i * om_i, om_i, tu_i, -(ex_i * fx_i + ey_i * fy_i + ft_i) / rt_i, -(kp_i + mp_i) / v_i"
    lines = ["in_i { unused = 1 }"]
    for name, matrix in matrices.items():
        found = sparse.coo_matrix(matrix)
        entries = sorted(zip(found.row, found.col, found.data, strict=True))
        lines.append(f"{name}_ij {{ {', '.join(f'({i}, {j}): {float(a)!r}' for i, j, a in entries if a)} }}")
    for name, vector in vectors.items():
        lines.append(f"{name}_i {{ {', '.join(f'({i}): {float(a)!r}' for i, a in enumerate(vector))} }}")
    return "\n".join(
        [
            *lines,
            f"u_i {{ x = x0_i, y = y0_i, th = th0_i{unknowns} }}",
            heading,
            "rt_i { sqrt(w_i + m_i * (ex_i * ex_i + ey_i * ey_i)) } om_i { p_i / rt_i } ft_i { T_ij * th_j }",
            force,
            f"F_i {{ {rates} }}",
        ]
    )
