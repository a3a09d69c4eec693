"""Colours, marks and labels of all pictures, distinct for colour-blind readers.

Each has one colour in all pictures: a method (`look`), a rolling law (`LAW_COLOUR`), a kind of ends (`ENDS`), a coordinate
(`COORDINATE`).
"""

from typing import Any

# Okabe and Ito's colours
BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#666666"
SKY, AMBER = "#56B4E9", "#E69F00"
INK, PALE, GROUND = "#222222", "#dcebf5", "#e4e4e0"

# colour scales: for signed values, nearly white at zero; for unsigned values, darker where larger
SIGNED = (BLUE, "#f7f7f7", ORANGE)
UNSIGNED = ("#f2f7f5", "#8accb5", "#00704f")

LAW_COLOUR = {"field": BLUE, "unit": ORANGE}
ENDS = {"springs": ORANGE, "consistent": BLUE, "paper": GREEN, "ring": ORANGE, "own": GREEN, "elements": PURPLE}
COORDINATE = {"x": BLUE, "y": ORANGE, "theta": GREEN, "phi": PURPLE}

# our methods: colour and mark; one family, one hue where there are many
METHOD = {
    "midpoint": (BLUE, "o"),
    "suzuki4": (ORANGE, "o"),
    "kahanli6": (AMBER, "s"),
    "gauss4": (SKY, "o"),
    "gauss6": (GREEN, "o"),
    "gauss8": (PURPLE, "o"),
    "radau3": ("#B8860B", "D"),
    "radau5": ("#843C39", "D"),
    "rk4": (GREY, "v"),
    "leapfrog": ("#882255", "^"),
    "mclachlan-perlmutter": ("#808000", "<"),
    "DOP853": ("#332288", "P"),
    "auto": ("black", "o"),
    "default": ("black", "X"),
}
# peers: a hue for each library, a mark for each of its methods
PEER = {
    "SciPy RK45": ("#393B79", "s"),
    "SciPy DOP853": ("#5254A3", "P"),
    "SciPy LSODA": ("#6B6ECF", "<"),
    "SciPy Radau": ("#9C9EDE", "^"),
    "SciPy BDF": ("#7F86C9", "v"),
    "CVODE BDF-2": ("#637939", ">"),
    "CVODE BDF-2, atol 0.1 rtol": ("#637939", "4"),
    "CVODE BDF-2, atol 1 rtol": ("#637939", "3"),
    "CVODE BDF-2 for rates, atol 0.1 rtol": ("#9FB35A", "2"),
    "CVODE BDF-2 for rates, atol 1 rtol": ("#9FB35A", "1"),
    "CVODE BDF-5": ("#8CA252", "p"),
    "CVODE Adams": ("#B5CF6B", "*"),
    "IDA, multipliers": ("#4A5D23", "h"),
    "diffrax Dopri8": ("#8C6D31", "+"),
    "diffrax Tsit5": ("#BD9E39", "x"),
    "diffrax Kvaerno5": ("#D6AE45", "d"),
    "diffsol bdf": ("#7B4173", "v"),
    "diffsol tr_bdf2": ("#A55194", "^"),
    "diffsol esdirk34": ("#CE6DBD", "D"),
    "diffsol tsit45": ("#B97FAE", "x"),
    "Exudyn, generic": ("#AD494A", "d"),
    "Exudyn, wheels and beams": ("#AD494A", "d"),
    "MuJoCo, friction": ("#D6616B", "H"),
    "MuJoCo, friction, damped": ("#E7969C", "8"),
    "saddle point, DOP853": ("#999999", "X"),
}


def look(method: str) -> dict[str, Any]:
    """Keywords for a line of matplotlib: how a method or a peer is drawn in every picture.

    Our methods have solid lines and are in front; peers have thinner, dashed ones, and those without a line in `PEER` are grey.
    """
    if method in METHOD:
        colour, mark = METHOD[method]
        return {"color": colour, "marker": mark, "linestyle": "-", "linewidth": 1.6, "markersize": 4, "zorder": 3}
    colour, mark = PEER.get(method) or PEER.get(f"SciPy {method}", (GREY, "."))  # integrators of SciPy have its names
    return {"color": colour, "marker": mark, "linestyle": "--", "linewidth": 0.9, "markersize": 4, "zorder": 2}


LABEL = {
    "t": "time t",
    "s": "place along the rod s (length)",
    "x": "x (length)",
    "y": "y (length)",
    "theta": "roll angle θ (rad)",
    "omega": "roll rate ω (rad/time)",
    "stretch": "|r'|",
    "force": "ground force |λ|",
}
