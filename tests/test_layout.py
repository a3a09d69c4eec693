"""The arrows between modules and rooms: what may import what, and no circles but those of a lazy facade."""

import ast
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[1]
BELOW = {"discs": {"discs"}, "continuum": {"continuum", "discs"}, "compare": {"compare", "continuum", "discs"}}
FILES = [path for package in BELOW for path in sorted((ROOT / package).rglob("*.py"))]
MODULES = {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in FILES}

# A result plots, views and saves itself: that needs modules above it, imported when a method is called.
FACADES = {
    "discs.solution": ("discs.pictures", "discs.files"),
    "compare.results": ("compare.figures",),
    "compare.work_precision": ("compare.figures",),
}

# A link law takes a chain, which finds the law by its name: only the type is imported.
FACADES |= {f"discs.chains.links.{law}": ("discs.chains.chain",) for law in ("law", "linear", "true")}
# The rooms of `discs`, from the ground up. A module imports from its own room and from those before it,
ROOMS = (
    *("arrays", "warn", "differences", "checks", "skew", "kernels", "chains", "loads", "problem", "energy_by_kind"),
    *("integrators", "stats", "solution", "mechanics", "pictures", "files", "runs", "running", "linkage", "events", "simulation"),
    *("analysis", "command_line"),
)
# but for these arrows up, each with its reason.
UP = {
    ("kernels", "chains"): "the compiled form of a chain is made from the chain",
    ("kernels", "integrators"): "kernels of gradients follow a method's compiled step, which stands beside the plain one",
    ("chains", "problem"): "`twist` makes the problems of the command line and of examples",
    ("loads", "files"): "`tables` reads files of signals",
    ("mechanics", "running"): "sliding discs are a run with frames",
    ("pictures", "files"): "`schema`, the units of quantities",
    ("runs", "running"): "`outcome`, the blocks of many runs",
    ("running", "simulation"): "`simulate_many` runs by `simulate` what does not fit side by side",
}
# What is slow to import, or an extra: functions import it when they need it.
LATE = ("discs.kernels", "continuum.kernels", "compare.peers", "compare.figures", "compare.limit_figures", "compare.lab")


@cache
def named(module: str) -> dict[str, str]:
    """What a module imports of ours, anywhere in it: module or "module.name" -> the module that it stands in.

    Imports for types count, and imports within functions, unless they are what makes a facade lazy.
    """
    found = {}
    for node in ast.walk(ast.parse(MODULES[module].read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name: alias.name for alias in node.names if alias.name in MODULES}
        if isinstance(node, ast.ImportFrom):
            assert not node.level, f"{module} imports {node.module} relatively"
            for name in (f"{node.module}.{alias.name}" for alias in node.names):
                if name in MODULES or node.module in MODULES:
                    found[name] = name if name in MODULES else node.module
    return {name: there for name, there in found.items() if not any(there.startswith(f) for f in FACADES.get(module, ()))}


def arrows(module: str) -> set[str]:
    """The modules that a module imports from; a name of a package's face stands where the face has it from."""
    return {
        next((f for n, f in named(there).items() if n.endswith(name.removeprefix(there))), there)
        if MODULES[there].name == "__init__.py" and name != there
        else there
        for name, there in named(module).items()
    }


def test_packages_import_only_what_lies_below_them():
    for module in MODULES:
        outside = {name for name in arrows(module) if name.partition(".")[0] not in BELOW[module.partition(".")[0]]}
        assert not outside, f"{module} imports {outside}"


def test_rooms_import_from_those_below_them():
    inside = [module for module in MODULES if module.count(".") and not module.endswith("__main__")]
    pairs = {
        (m.split(".")[1], t.split(".")[1]) for m in inside for t in arrows(m) if m.startswith("discs") and t.startswith("discs.")
    }
    assert {room for pair in pairs for room in pair} == set(ROOMS), "a new room needs its place in ROOMS"
    assert {(one, other) for one, other in pairs if ROOMS.index(other) > ROOMS.index(one)} == UP.keys()


def test_no_circles_of_modules():
    graph = {module: arrows(module) for module in MODULES}
    assert sum(map(len, graph.values())) > 2 * len(graph) > 200  # imports are seen
    tuple(TopologicalSorter(graph).static_order())  # an error names the circle


def test_functions_import_only_what_is_slow_or_an_extra():
    for module, path in MODULES.items():
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.FunctionDef):
                late = [node for node in ast.walk(function) if isinstance(node, ast.ImportFrom)]
                names = [f"{node.module}.{alias.name}" for node in late for alias in node.names]
                ours = [name for name in names if name.partition(".")[0] in BELOW]
                outside = [name for name in ours if not name.startswith((*LATE, *FACADES.get(module, ())))]
                assert not outside, f"{module}.{function.name} imports {outside}: import it at the top"
