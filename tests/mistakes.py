"""Small mistakes in the source of kernels: where each could be made, and some drawn by chance."""

import ast
import random
import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parent.parent
#: Rooms of kernels, in the order of the floors.
ROOMS = ["geometry", "integrate", "earth", "orbit", "environment", "wheel_array"]
ROOMS += ["spacecraft", "estimation", "control", "simulation"]
KERNEL = re.compile(r"^@(kernel|released|inlined)$", re.MULTILINE)
#: A file without kernels that decides about a run as they do.
RESTORE = "restore.py"
AT_MOST_OF_A_FILE = 3
PAIRS = [(ast.Add, ast.Sub), (ast.Mult, ast.Div), (ast.Lt, ast.LtE), (ast.Gt, ast.GtE)]
PAIRS += [(ast.Eq, ast.NotEq), (ast.And, ast.Or), ("min", "max"), ("sin", "cos")]
OTHER = dict(PAIRS) | {b: a for a, b in PAIRS} | {ast.USub: ast.UAdd}


class Mutant(NamedTuple):
    """A mistake in a node, the so many-th of the functions of a file; `text`: of its line."""

    file: str
    function: str
    line: int
    text: str
    change: str
    kind: str
    node: int


def corrupt(node: ast.AST) -> str:
    """Make a mistake in a node, if there is one to make; the kind of node, '' for others."""
    if isinstance(node, ast.BinOp | ast.AugAssign | ast.BoolOp | ast.UnaryOp):
        node.op = OTHER.get(type(node.op), type(node.op))()
        return type(node).__name__
    if isinstance(node, ast.Compare):
        node.ops[0] = OTHER.get(type(node.ops[0]), type(node.ops[0]))()
        return "Compare"
    if isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
        node.value = other_than(node.value)
        return "Constant"
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        node.func.id = OTHER.get(node.func.id, node.func.id)
        return "Call"
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
        node.func.attr = OTHER.get(node.func.attr, node.func.attr)
        return "Call"
    return ""


def other_than(value: float) -> float:
    """The other truth, the next integer, a float one per cent greater, 1.0 for 0.0."""
    if isinstance(value, bool):
        return not value
    return float(f"{1.01 * value or 1.0:.10g}") if isinstance(value, float) else value + 1


def nodes_in(function: ast.FunctionDef) -> list[ast.AST]:
    """Nodes of a function's body but those of messages and annotations, in a fixed order."""
    found, waiting = [], list(function.body)
    while waiting:
        node = waiting.pop(0)
        if isinstance(node, ast.Raise | ast.JoinedStr | ast.FunctionDef):
            continue
        found.append(node)
        hidden = getattr(node, "annotation", None)
        waiting += [each for each in ast.iter_child_nodes(node) if each is not hidden]
    return found


def nodes_of(tree: ast.Module) -> list[tuple[str, ast.AST]]:
    """Nodes of all functions of a file, with the names of these."""
    functions = [each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef)]
    return [(function.name, node) for function in functions for node in nodes_in(function)]


def spoiled(source: str, which: int) -> str:
    """The source with a mistake in that node."""
    tree = ast.parse(source)
    corrupt(nodes_of(tree)[which][1])
    return ast.unparse(tree)


def mutants_of(path: Path) -> list[Mutant]:
    """Every mutant of a file."""
    source, found = path.read_text(), []
    file, lines = str(path.relative_to(ROOT)), source.splitlines()
    for k, (function, node) in enumerate(nodes_of(ast.parse(source))):
        before, kind = ast.unparse(node), corrupt(node)
        if kind and ast.unparse(node) != before:
            change, text = f"{before} -> {ast.unparse(node)}", lines[node.lineno - 1].strip()
            found.append(Mutant(file, function, node.lineno, text, change, kind, k))
    return found


def drawn_of(folder: str, seed: int, count: int) -> list[Mutant]:
    """Mutants of all files of a folder, such as "torquer/campaign", each as probable as any."""
    paths = sorted((ROOT / folder).rglob("*.py"))
    return random.Random(seed).sample([each for path in paths for each in mutants_of(path)], count)


def drawn(seed: int, count: int) -> list[Mutant]:
    """Mutants of all rooms and kinds alike, few of a file; more of them begin as fewer do."""
    draw, left, taken = random.Random(seed), {room: {} for room in ROOMS}, []
    for room, kinds in left.items():
        for path in sorted((ROOT / "torquer" / room).rglob("*.py")):
            if KERNEL.search(path.read_text()) or path.name == RESTORE:
                for each in mutants_of(path):
                    kinds.setdefault(each.kind, []).append(each)
    while len(taken) < count and (rooms := [room for room in ROOMS if left[room]]):
        kinds = left[draw.choice(rooms)]
        places = kinds[kind := draw.choice(sorted(kinds))]
        each = places.pop(draw.randrange(len(places)))
        if [m.file for m in taken].count(each.file) < AT_MOST_OF_A_FILE:
            taken.append(each)
        if not places:
            del kinds[kind]
    return taken
