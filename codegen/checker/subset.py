"""The subset of Python that a generated twin is written in: what is not of it is refused, before anything is replayed.

Standard library only; part of the checker (verify.py). The replay (twin.py) follows the lines that it meets; this reads
all of them. A twin is four records, its helpers in the one form that they have, and functions of assignments and loops:
no branch but the guard of a step, no comparison, no other call, no import, no second definition of a name. So a step is
one formula of its states and inputs, cut only where the argument of a sign or of an absolute value turns.
"""

import ast
import re
from typing import Any

LARGEST = (1e150, 1e18)
IMPORTS = {
    "import math",
    "import numpy",
    "import ctypes",
    "import ctypes.util",
    "from numpy import float32",
    "from dataclasses import dataclass",
    "from dataclasses import dataclass, field",
}
RECORDS = ("Parameters", "State", "Inputs", "Outputs")
RECORD_NAMES = ("state", "parameters", "inputs", "outputs")
LIBRARY = re.compile(
    r"_LIBRARY = ctypes\.CDLL\(ctypes\.util\.find_library\('m'\)\)|_LIBRARY\.(sin|cos|tan|exp|log|sqrt|tanh|pow)f\."
    r"(restype = ctypes\.c_float|argtypes = \[ctypes\.c_float(, ctypes\.c_float)?\])"
)
# Helpers without annotations, docstrings and float32(...): in double, and in single the C library's.
SINGLE = {name: f"def _{name}(u): return _LIBRARY.{name}f(u)" for name in ("sin", "cos", "tan", "exp", "log", "sqrt")}
HELPERS = {
    "_sign": ["def _sign(u): return 1.0 if u > 0.0 else (-1.0 if u < 0.0 else 0.0)"],
    **{
        f"_{name}": [f"def _{name}(u): return math.{name}(u) if math.isfinite(u) else math.nan", SINGLE[name]]
        for name in ("sin", "cos", "tan")
    },
    "_exp": ["def _exp(u):\n try:\n  return math.exp(u)\n except OverflowError:\n  return math.inf", SINGLE["exp"]],
    "_log": [
        "def _log(u): return math.log(u) if u > 0.0 else (-math.inf if u == 0.0 else math.nan)",
        SINGLE["log"],
    ],
    "_sqrt": ["def _sqrt(u): return math.sqrt(u) if not u < 0.0 else math.nan", SINGLE["sqrt"]],
    "_tanh": ["def _tanh(u): return _LIBRARY.tanhf(u)"],
    "_pow": [
        "def _pow(u, n):\n try:\n  return math.pow(u, n)\n except OverflowError:\n"
        "  return -math.inf if u < 0.0 and n % 2.0 == 1.0 else math.inf\n except ValueError:\n"
        "  return math.nan if u < 0.0 else math.inf",
        "def _pow(u, n): return _LIBRARY.powf(u, n)",
    ],
    "_quotient": [
        "def _quotient(a, b):\n if b != 0.0:\n  return a / b\n"
        " return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)"
    ],
    "_handle_fault": [
        "def _handle_fault(state, parameters, inputs, outputs, valid):\n if not valid:\n  if state.mode != STARTING:\n"
        "   _predict(state, parameters, outputs)\n elif state.mode == HOLDING:\n"
        "  _resume(state, parameters, inputs, outputs)\n else:\n  fresh = init(parameters, inputs)\n"
        "  for name in State.__slots__:\n   setattr(state, name, getattr(fresh, name))\n outputs.fault = 1"
    ],
    "__post_init__": [
        "def __post_init__(self):\n for name in self.__slots__:\n  setattr(self, name, getattr(self, name))",
        "def __post_init__(self):\n for name in self.__slots__:\n  value = getattr(self, name)\n"
        "  setattr(self, name, [v for v in value] if isinstance(value, list) else value)",
    ],
}
# A function's arguments, and whose fields it may set: nothing is remembered between samples but in the state.
FUNCTIONS = {
    "prepare": (["parameters"], ["parameters"]),
    "init": (["parameters", "inputs"], ["state"]),
    "_predict": (["state", "parameters", "outputs"], ["state"]),
    "_resume": (["state", "parameters", "inputs", "outputs"], ["state"]),
    "step": (["state", "parameters", "inputs", "outputs"], ["state", "outputs"]),
}
GUARD = "state.mode != RUNNING or not abs(check) <= LARGEST"
MODES = {"RUNNING": "0", "HOLDING": "1", "STARTING": "2"}
MODE_FIELDS = ("state.mode", "state.invalid_samples")  # set in these forms alone, and no part of a formula
FIRST = ("mode: int = RUNNING", "invalid_samples: int = 0")
RESUMED = ("state.mode = RUNNING", "state.invalid_samples = 0")
COUNTING = (
    r"if outputs\.fault == 0:\n    state\.invalid_samples = 0\nstate\.invalid_samples \+= 1\n"
    r"if state\.invalid_samples >= \d+:\n    state\.mode = HOLDING"
)
RESERVED = {*HELPERS, *FUNCTIONS, *RECORDS, *MODES, "LARGEST"}
RESERVED |= {"abs", "range", "float32", "math", "numpy", "field", "dataclass"}


class Foreign(Exception):
    """The source is not as the generator writes a twin; the message says where."""


class _Plain(ast.NodeTransformer):
    """A function without annotations, decorators, its docstring and float32(...), so that both precisions are alike."""

    def visit_Call(self, node: ast.Call) -> Any:
        self.generic_visit(node)
        bare = isinstance(node.func, ast.Name) and node.func.id == "float32" and len(node.args) == 1
        return node.args[0] if bare and not node.keywords else node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> Any:
        node.returns, node.decorator_list = None, []
        if _is_docstring(node.body[0]) and len(node.body) > 1:
            node.body = node.body[1:]
        self.generic_visit(node)
        return node

    def visit_arg(self, node: ast.arg) -> Any:
        node.annotation = None
        return node


def plain(source: str | ast.stmt) -> str:
    """The text of a function in the form in which it is compared."""
    tree = ast.parse(source if isinstance(source, str) else ast.unparse(source))
    return ast.unparse(_Plain().visit(tree))


def _is_docstring(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def demand(condition: bool, node: Any, what: str) -> None:
    if not condition:
        raise Foreign(f"line {getattr(node, 'lineno', '?')}: {what}")


def require_twin(tree: ast.Module) -> None:
    """Raises Foreign where the source is not a twin."""
    seen: set[str] = set()
    for position, node in enumerate(tree.body):
        name = ""
        if isinstance(node, ast.Import | ast.ImportFrom):
            name = ast.unparse(node)
            demand(name in IMPORTS, node, f"`{name[:60]}` is no import of a twin")
        elif isinstance(node, ast.Assign):
            name = _constant(node)
        elif isinstance(node, ast.ClassDef):
            name = node.name
            _record(node)
        elif isinstance(node, ast.FunctionDef):
            name = node.name
            _function(node)
        else:
            demand(position == 0 and _is_docstring(node), node, "a statement that no twin has")
        demand(name == "" or name not in seen, node, f"{name} is defined twice")
        seen.add(name)
    missing = [name for name in (*RECORDS, "prepare", "init", "step") if name not in seen]
    demand(not missing, tree, f"there is no {', '.join(missing)}")


def _constant(node: ast.Assign) -> str:
    """The name of what a statement outside of functions sets."""
    text = ast.unparse(node)
    if LIBRARY.fullmatch(text):
        return text
    demand(len(node.targets) == 1 and isinstance(node.targets[0], ast.Name), node, "a statement that no twin has")
    name = getattr(node.targets[0], "id", "")
    if name == "LARGEST":
        value = getattr(ast.parse(plain(node)).body[0], "value", None)
        demand(isinstance(value, ast.Constant) and value.value in LARGEST, node, "LARGEST is another")
    elif name in MODES:
        demand(ast.unparse(node.value) == MODES[name], node, f"{name} is another")
    elif name == "ENVELOPE":
        ends = ast.literal_eval(node.value)
        shown = isinstance(ends, dict) and all(isinstance(k, str) and len(v) == 2 for k, v in ends.items())
        demand(shown, node, "ENVELOPE holds no ranges")
    else:
        demand(name in ("__all__", "SPEC_SHA256"), node, f"{name} is no name of a twin")
        ast.literal_eval(node.value)
    return name


def _record(node: ast.ClassDef) -> None:
    decorators = [ast.unparse(d) for d in node.decorator_list]
    good = node.name in RECORDS and not node.bases and not node.keywords and decorators == ["dataclass(slots=True)"]
    demand(good, node, f"class {node.name} is no record of a twin")
    names = []
    for item in node.body:
        if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name):
            names.append(item.target.id)
            demand(not item.target.id.startswith("__"), item, "a field that no twin has")
            demand(ast.unparse(item.annotation) in TYPES, item, "a field of another type")
            value = getattr(ast.parse(plain(item)).body[0], "value", None)
            if f"state.{item.target.id}" in MODE_FIELDS and node.name == "State":
                demand(ast.unparse(item) in FIRST, item, "another first mode or count")
                continue
            if isinstance(value, ast.Call):
                demand(ast.unparse(value).startswith("field(default_factory=lambda: ["), item, "another default")
                value = getattr(value.keywords[0].value, "body", None)
            demand(value is not None, item, "a field without a number")
            for part in ast.walk(value) if value is not None else ():
                demand(isinstance(part, NUMBERS), item, "a default that is no number")
        elif isinstance(item, ast.FunctionDef):
            names.append(item.name)
            demand(not item.decorator_list and _is_helper(item, "__post_init__"), item, f"{item.name} is another")
        else:
            demand(item is node.body[0] and _is_docstring(item), item, "a statement that no twin has")
    demand(len({*names}) == len(names), node, "a field appears twice")


TYPES = ("float", "int", "float32", "list[float]", "list[float32]")
NUMBERS = (ast.Constant, ast.List, ast.Load, ast.UnaryOp, ast.USub, ast.BinOp, ast.Mult)


def _is_helper(node: ast.FunctionDef, name: str) -> bool:
    given = node.args
    simple = not (given.defaults or given.kwonlyargs or given.vararg or given.kwarg or given.posonlyargs)
    return simple and node.name == name and plain(node) in [plain(form) for form in HELPERS[name]]


def _function(node: ast.FunctionDef) -> None:
    if node.name in HELPERS:
        demand(not node.decorator_list and _is_helper(node, node.name), node, f"{node.name} is another function")
        return
    demand(node.name in FUNCTIONS, node, f"{node.name} is no function of a twin")
    arguments, sets = FUNCTIONS[node.name]
    given = node.args
    good = [a.arg for a in given.args] == arguments
    good = good and not (given.kwonlyargs or given.vararg or given.kwarg or given.posonlyargs)
    defaults = [ast.unparse(d) for d in given.defaults]
    good = good and defaults == (["None"] if node.name == "step" else [])
    decorators = [ast.unparse(d) for d in node.decorator_list]
    good = good and (not decorators or (node.name in ("init", "step") and decorators == [QUIET]))
    demand(good, node, f"{node.name} is not declared as a twin's")
    body = node.body[1:] if _is_docstring(node.body[0]) else node.body
    _Body(node.name, sets).block(body)


QUIET = "numpy.errstate(all='ignore')"


class _Body:
    """The statements of one function."""

    def __init__(self, function: str, sets: list[str]) -> None:
        self.function, self.sets = function, sets
        self.arrays: set[str] = set()

    def block(self, body: list[ast.stmt], inner: bool = False) -> None:
        for node in body:
            if isinstance(node, ast.Assign | ast.AugAssign):
                self.assignment(node)
            elif isinstance(node, ast.For):
                self.loop(node)
            elif isinstance(node, ast.If) and not inner:
                self.branch(node)
            else:
                last = isinstance(node, ast.Return) and node is body[-1] and not inner
                wanted = {"step": "return outputs", "init": "return state"}.get(self.function, "")
                demand(last and ast.unparse(node) == wanted, node, "a statement that no twin has")

    def loop(self, node: ast.For) -> None:
        name = getattr(node.target, "id", "")
        ends = re.fullmatch(r"range\(-?\d+, -?\d+(, -1)?\)", ast.unparse(node.iter))
        demand(name == "i" and ends is not None and not node.orelse, node, "a loop that no twin has")
        self.block(node.body, inner=True)

    def branch(self, node: ast.If) -> None:
        test = ast.unparse(_Plain().visit(ast.parse(ast.unparse(node.test))))
        body = [ast.unparse(line) for line in node.body]
        demand(not node.orelse, node, "a branch that no twin has")
        if (self.function, test) == ("step", "outputs is None"):
            demand(body == ["outputs = Outputs()"], node, "a branch that no twin has")
        elif (self.function, test) == ("init", "not abs(check) <= LARGEST"):
            demand([plain(line) for line in node.body] == ["state = State(mode=STARTING)"], node, "another guard")
        elif (self.function, test) == ("_predict", "state.mode == RUNNING"):
            demand(re.fullmatch(COUNTING, "\n".join(body)) is not None, node, "another count")
        else:
            demand((self.function, test) == ("step", GUARD), node, "a branch that no twin has")
            held = ["_handle_fault(state, parameters, inputs, outputs, abs(given) <= LARGEST)", "return outputs"]
            demand(body[-2:] == held, node, "another guard")
            self.block(node.body[:-2], inner=True)
            for part in ast.walk(node):
                if isinstance(part, ast.Assign | ast.AugAssign):
                    targets = part.targets if isinstance(part, ast.Assign) else [part.target]
                    demand([ast.unparse(t) for t in targets] == ["given"], part, "another guard")

    def assignment(self, node: ast.Assign | ast.AugAssign) -> None:
        targets = node.targets if isinstance(node, ast.Assign) else [node.target]
        demand(len(targets) == 1, node, "two targets")
        target, value = targets[0], node.value
        if isinstance(node, ast.AugAssign):
            demand(isinstance(node.op, ast.Add), node, "an operation that no twin has")
        if isinstance(target, ast.Name):
            self.local(target, value, node)
        else:
            place = target.value if isinstance(target, ast.Subscript) else target
            owner = getattr(getattr(place, "value", None), "id", "")
            own = isinstance(place, ast.Name) and place.id in self.arrays
            demand(own or owner in self.sets, node, f"`{ast.unparse(target)[:60]}` is not {self.function}'s to set")
            if ast.unparse(target) in MODE_FIELDS:
                resumed = self.function == "_resume" and ast.unparse(node) in RESUMED
                demand(resumed, node, f"`{ast.unparse(node)[:60]}`, another mode or count")
                return
            self.expression(target.slice if isinstance(target, ast.Subscript) else ast.Constant(0))
            self.expression(value)

    def local(self, target: ast.Name, value: ast.expr, node: ast.stmt) -> None:
        name = target.id
        begun = self.function == "init" and name == "state" and isinstance(node, ast.Assign)
        demand(begun or name not in RESERVED | {*RECORD_NAMES}, node, f"{name} is set anew")
        if begun:
            call = isinstance(value, ast.Call) and ast.unparse(value.func) == "State" and not value.args
            demand(call, node, "another state")
            for keyword in getattr(value, "keywords", []):
                demand(f"state.{keyword.arg}" not in MODE_FIELDS, node, "another mode or count")
                self.expression(keyword.value)
        elif isinstance(value, ast.BinOp) and isinstance(value.left, ast.List):
            demand(re.fullmatch(r"\[0\.0\] \* \d+", plain(ast.Expr(value))) is not None, node, "another array")
            self.arrays.add(name)
        else:
            if name in ("check", "given"):  # what the guard looks at is a plain sum
                good = all(isinstance(part, SUM) for part in ast.walk(ast.parse(plain(ast.Expr(value))).body[0]))
                demand(good, node, f"{name} is no sum")
            self.expression(value)

    def expression(self, node: ast.expr) -> None:
        if isinstance(node, ast.Constant):
            number = isinstance(node.value, int | float) and not isinstance(node.value, bool)
            demand(number, node, "a constant that is no number")
        elif isinstance(node, ast.Name):
            demand(node.id not in RESERVED, node, f"{node.id} as a value")
        elif isinstance(node, ast.Attribute):
            owner = getattr(node.value, "id", "")
            kept = owner == "outputs" and self.function == "step"  # would be a state that is not in State
            kept = kept or ast.unparse(node) in MODE_FIELDS
            demand(owner in RECORD_NAMES and not kept, node, f"`{ast.unparse(node)[:60]}` as a value")
        elif isinstance(node, ast.Subscript):
            self.expression(node.value)
            self.expression(node.slice)
        elif isinstance(node, ast.BinOp):
            demand(isinstance(node.op, ast.Add | ast.Sub | ast.Mult | ast.Div), node, "an operation that no twin has")
            self.expression(node.left)
            self.expression(node.right)
        elif isinstance(node, ast.UnaryOp):
            demand(isinstance(node.op, ast.USub), node, "an operation that no twin has")
            self.expression(node.operand)
        elif isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            good = called in HELPERS.keys() - {"_handle_fault", "__post_init__"} | {"abs", "float32", "math.tanh"}
            demand(good and not node.keywords, node, f"a call of `{called[:60]}`")
            for argument in node.args:
                self.expression(argument)
        else:
            demand(False, node, f"`{ast.unparse(node)[:60]}`, which no twin has")


SUM = (ast.Expr, ast.BinOp, ast.Add, ast.Name, ast.Attribute, ast.Subscript, ast.Constant, ast.Load, ast.Sub)
