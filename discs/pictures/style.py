"""Colours and labels of all pictures, distinct for colour-blind readers."""

# Okabe and Ito's colours
BLUE, ORANGE, GREEN, PURPLE, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#666666"
INK, PALE, GROUND = "#222222", "#dcebf5", "#e4e4e0"

# colour scales: for signed values, nearly white at zero; for unsigned values, darker where larger
SIGNED = (BLUE, "#f7f7f7", ORANGE)
UNSIGNED = ("#f2f7f5", "#8accb5", "#00704f")

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
