"""Small wrong changes of a module: the kinds of slips that a person makes in formulas and loops."""

import ast
from collections.abc import Iterator
from typing import NamedTuple

SWAPS: dict[type[ast.AST], str] = {
    ast.Add: "-",
    ast.Sub: "+",
    ast.Mult: "/",
    ast.Div: "*",
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.And: "or",
    ast.Or: "and",
}
SIGNS: dict[type[ast.AST], str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">"}
SIGNS |= {ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=", ast.And: "and", ast.Or: "or"}


class Change(NamedTuple):
    """A mutant: the text of a line from `start` to `end` (columns, characters) is replaced."""

    line: int
    start: int
    end: int
    new: str


def changes(source: str) -> Iterator[Change]:
    """All changes of a module: operators swapped, numbers changed, signs and `not` dropped, statements `x += …` left out.

    Texts, annotations, default values of options and what `raise` says are left alone: they are not what computes.
    """
    lines = source.splitlines()
    tree = ast.parse(source)
    for node in _computing(tree):
        if isinstance(node, ast.BinOp):
            yield from _between(lines, node.left, node.right, node.op)
        elif isinstance(node, ast.BoolOp):
            yield from _between(lines, node.values[0], node.values[1], node.op)
        elif isinstance(node, ast.Compare) and len(node.ops) == 1:
            yield from _between(lines, node.left, node.comparators[0], node.ops[0])
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            new = repr(node.value + 1) if isinstance(node.value, int) else repr(1.5 * node.value or 1.0)
            yield from _whole(lines, node, new)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.Not):
            yield from _whole(lines, node, ast.get_source_segment(source, node.operand) or "")
        elif isinstance(node, ast.AugAssign):
            yield from _whole(lines, node, "pass")


def _computing(node: ast.AST) -> Iterator[ast.AST]:
    for name, field in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list", "defaults", "kw_defaults"):
            continue
        for child in field if isinstance(field, list) else [field]:
            if isinstance(child, ast.AST) and not isinstance(child, ast.Raise | ast.JoinedStr | ast.Assert | ast.ImportFrom):
                yield child
                yield from _computing(child)


def _between(lines: list[str], left: ast.expr, right: ast.expr, op: ast.AST) -> Iterator[Change]:
    """The operator between two operands on one line."""
    if type(op) in SWAPS and left.end_lineno == right.lineno and left.end_lineno and left.end_col_offset is not None:
        text = lines[right.lineno - 1].encode()
        gap = text[left.end_col_offset : right.col_offset].decode()
        if gap.count(SIGNS[type(op)]) == 1:
            at = len(text[: left.end_col_offset].decode()) + gap.index(SIGNS[type(op)])
            yield Change(right.lineno, at, at + len(SIGNS[type(op)]), SWAPS[type(op)])


def _whole(lines: list[str], node: ast.expr | ast.stmt, new: str) -> Iterator[Change]:
    if node.lineno == node.end_lineno and node.end_col_offset is not None:
        text = lines[node.lineno - 1].encode()
        yield Change(node.lineno, len(text[: node.col_offset].decode()), len(text[: node.end_col_offset].decode()), new)


def applied(source: str, change: Change) -> str:
    """The module with one change."""
    lines = source.splitlines(keepends=True)
    line = lines[change.line - 1]
    lines[change.line - 1] = line[: change.start] + change.new + line[change.end :]
    return "".join(lines)
