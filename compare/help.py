"""Help of the commands of `python -m compare`: in a few words, in sentences with the files written, and options of an example."""

HELP = {
    "lab": (
        "a page to play with: discs that move as you change them",
        "Open the lab in a browser: a live simulation in three dimensions. Choose the scene, the number of discs, the law and the "
        "method, move sliders, pull, kick or hold a disc, and see the field beside the discs. It runs on this machine only and "
        "needs no network. It ends when its page is closed, or by Ctrl-C.",
        "--n 64",
    ),
    "precision": (
        "speed against error beside other integrators",
        "Measure processor time against error of our methods and of other integrators on the same problem. Written: a table of all "
        "runs (precision.csv), a report (precision.md) and a picture (precision.png). An interrupted run keeps its results so far.",
        "--n 32 128 --repeats 3",
    ),
    "stability": (
        "hard cases by every method",
        "Run hard cases by every method and show which pass: stiff chains, long steps, long times. Written: stability.md, "
        "stability.csv, stability.png. After an interruption the same command continues.",
        "--quick",
    ),
    "trust": (
        "random scenes: whether errors stay below the tolerances",
        "Solve random scenes to random tolerances and count how often the error stays below. Written: trust.md and trust.csv. "
        "After an interruption the same command continues.",
        "--scenes 20 --seed 1",
    ),
    "loads": (
        "N to infinity under loads",
        "Compare N loaded discs with the loaded rod, for torques, a slope, damping and rest shapes. Written: loads.csv, loads.png.",
        "--n 33 65 129",
    ),
    "slip": (
        "discs that slide: which limit first?",
        "Let discs slide a little, and compare them with rolling discs and with the rod: which limit is to be taken first? "
        "Written: slip.csv, slip.png.",
        "--n 9 17 33",
    ),
    "crosscheck": (
        "the same problems by other programs",
        "Run the same problems by this program and by the others that are installed (the extra crosscheck has all), and "
        "show the difference, its order and both times. Written: crosschecks.md, crosschecks.csv.",
        "--peers SymPy SciPy",
    ),
    "report": (
        "everything on one page",
        "Write one page with the motion, N to infinity, the ground's force, both laws of rolling, energy, speed and stability: "
        "report.html with its pictures inside, report.md, and every picture with its data.",
        "--n 17 33 65",
    ),
}
