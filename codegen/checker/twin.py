"""The generated Python twin, read as a syntax tree and never run: one sample of it in dual numbers over the rationals.

Standard library only; part of the checker (verify.py). What is here knows arithmetic, signs, loops and branches. A dual
number is (value, derivative along one direction of the states). Sine, cosine, exp and tanh of a rational are no
rationals; they are taken as numbers that belong to their argument, the same in code and certificate, with
cos^2 + sin^2 = 1: an identity that holds for such numbers is one of formulas. They are others in every run.
"""

import ast
import random
import secrets
import warnings
from fractions import Fraction
from typing import Any

Dual = tuple[Fraction, Fraction]
ZERO = Fraction(0)
MODES = ("RUNNING", "HOLDING", "STARTING")
COMPARISONS = (
    *((ast.Lt, (-1,)), (ast.LtE, (-1, 0)), (ast.Gt, (1,)), (ast.GtE, (0, 1))),
    *((ast.Eq, (0,)), (ast.NotEq, (-1, 1))),
)  # kind → signs of the difference for which it holds
SECRET = secrets.token_hex(16)
"""Of this run: whoever knew where a certificate is compared could write one that is right there and wrong elsewhere."""


class Unknown(Exception):
    """The twin holds what the replay has no word for; the message says what."""


def belonging(name: str, x: Fraction) -> Fraction:
    """A rational that is drawn for a function at an argument."""
    return Fraction(random.Random(f"{SECRET} {name} {x}").randrange(1, 2**20), 2**18)


def function(name: str, x: Fraction) -> tuple[Fraction, Fraction]:
    """(value, derivative) of sin, cos, exp, tanh or abs at x; of sqrt and others Unknown."""
    if name in ("sin", "cos"):
        t = belonging("turn", abs(x))
        cosine, sine = (1 - t * t) / (1 + t * t), (2 * t / (1 + t * t)) * sign(x)
        if x == 0:
            cosine, sine = Fraction(1), ZERO
        return (sine, cosine) if name == "sin" else (cosine, -sine)
    if name == "exp":  # on the side of 1 on which it is
        drawn = belonging(name, x) / 4
        return (Fraction(1) if x == 0 else drawn if x < 0 else 1 + drawn,) * 2
    if name == "tanh":
        value = belonging(name, abs(x)) * sign(x)
        return value, 1 - value * value
    if name == "abs":
        return abs(x), sign(x)
    raise Unknown(f"the replay has no word for {name}")


def sign(x: Fraction) -> Fraction:
    return Fraction((x > 0) - (x < 0))


class Twin:
    """The generated Python, read.

    Attributes:
        source: the text.
        envelope: its ENVELOPE, variable → (low, high).
        largest: its LARGEST, beyond which a step is not used.
        modes: its constants of State.mode.
        signs: of everything whose sign the last step asked for, in order: two samples with the same are of one branch.
    """

    def __init__(self, source: str) -> None:
        self.source = source
        self.largest = Fraction(10) ** 300
        self.functions: dict[str, ast.FunctionDef] = {}
        self.records: dict[str, ast.ClassDef] = {}
        self.envelope: dict[str, tuple[str, str]] = {}
        self.modes: dict[str, Dual] = {}
        self.signs: list[Fraction] = []
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # what Python warns of, as `1if`, no printer of ours writes
            tree = ast.parse(source)
        for node in tree.body:
            if isinstance(node, ast.FunctionDef):
                self.functions[node.name] = node
            elif isinstance(node, ast.ClassDef):
                self.records[node.name] = node
            elif isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "ENVELOPE":
                self.envelope = ast.literal_eval(node.value)
            elif isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "LARGEST":
                self.largest = self.value(node.value, {})[0]
            elif isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") in MODES:
                self.modes[ast.unparse(node.targets[0])] = self.value(node.value, {})

    def unit(self, field: str) -> str:
        """The unit of an output as the comment of its field says it: ``a_hat: float = 0.0  # N: friction level``."""
        places = [f for f in self.records["Outputs"].body if isinstance(f, ast.AnnAssign)]
        lines = [f.lineno for f in places if isinstance(f.target, ast.Name) and f.target.id == field]
        line = self.source.splitlines()[lines[0] - 1] if lines else ""
        return line.partition("# ")[2].partition(": ")[0]

    def record(self, name: str) -> dict[str, Any]:
        """A struct with its defaults."""
        fields = [f for f in self.records[name].body if isinstance(f, ast.AnnAssign) and isinstance(f.target, ast.Name)]
        return {f.target.id: self.value(f.value, self.modes) for f in fields if isinstance(f.target, ast.Name)}

    def run(self, name: str, **arguments: Any) -> dict[str, Any]:
        """One of its functions, on records that it changes; its names when it ends."""
        self.signs = []
        names = {"LARGEST": (self.largest, ZERO), **self.modes, **arguments}
        self.execute(self.functions[name].body, names)
        return names

    def execute(self, body: list[ast.stmt], env: dict[str, Any]) -> bool:
        """Whether it came to a ``return``."""
        for node in body:
            if isinstance(node, ast.Assign | ast.AugAssign):
                target = node.targets[0] if isinstance(node, ast.Assign) else node.target
                new = self.value(node.value, env)
                if isinstance(node, ast.AugAssign):
                    new = self.operation(node.op, self.value(target, env), new)
                self.assign(target, new, env)
            elif isinstance(node, ast.For) and isinstance(node.target, ast.Name):
                for k in self.value(node.iter, env):
                    env[node.target.id] = (Fraction(k), ZERO)
                    self.execute(node.body, env)
            elif isinstance(node, ast.If):
                mark = len(self.signs)
                holds = bool(self.value(node.test, env))
                self.signs[mark:] = [Fraction(holds)]  # what a guard compares may have any sign while it holds
                if self.execute(node.body if holds else node.orelse, env):
                    return True
            elif isinstance(node, ast.Return):
                return True
            elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
                raise Unknown(f"the twin has what the replay cannot read, line {node.lineno}")
        return False

    def assign(self, target: ast.expr, new: Any, env: dict[str, Any]) -> None:
        if isinstance(target, ast.Name):
            env[target.id] = new
        elif isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name):
            env[target.value.id][target.attr] = new
        elif isinstance(target, ast.Subscript):
            self.value(target.value, env)[int(self.value(target.slice, env)[0])] = new
        else:
            raise Unknown(f"the twin has what the replay cannot read, line {target.lineno}")

    def value(self, node: Any, env: dict[str, Any]) -> Any:
        """A dual number, a list, a truth value or a record."""
        if isinstance(node, ast.Constant):
            exact = isinstance(node.value, int | float) and not isinstance(node.value, bool)
            return (Fraction(repr(node.value)), ZERO) if exact else node.value
        if isinstance(node, ast.Name) and node.id in env:
            return env[node.id]
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id in env:
            return env[node.value.id][node.attr]
        if isinstance(node, ast.Subscript):
            return self.value(node.value, env)[int(self.value(node.slice, env)[0])]
        if isinstance(node, ast.List):
            return [self.value(item, env) for item in node.elts]
        if isinstance(node, ast.BinOp):
            return self.operation(node.op, self.value(node.left, env), self.value(node.right, env))
        if isinstance(node, ast.UnaryOp):
            inner = self.value(node.operand, env)
            return not inner if isinstance(node.op, ast.Not) else (-inner[0], -inner[1])
        if isinstance(node, ast.BoolOp):
            each = (bool(self.value(item, env)) for item in node.values)
            return all(each) if isinstance(node.op, ast.And) else any(each)
        if isinstance(node, ast.IfExp):
            return self.value(node.body if self.value(node.test, env) else node.orelse, env)
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            return self.compare(node.ops[0], self.value(node.left, env), self.value(node.comparators[0], env))
        if isinstance(node, ast.Call):
            return self.call(node, env)
        raise Unknown(f"the twin has what the replay cannot read, line {getattr(node, 'lineno', '?')}")

    def operation(self, op: ast.operator, a: Any, b: Any) -> Any:
        if isinstance(a, list):
            return [x for _ in range(int(b[0])) for x in a]
        if isinstance(op, ast.Add | ast.Sub):
            return (a[0] + b[0], a[1] + b[1]) if isinstance(op, ast.Add) else (a[0] - b[0], a[1] - b[1])
        if isinstance(op, ast.Mult):
            return a[0] * b[0], a[1] * b[0] + a[0] * b[1]
        if isinstance(op, ast.Div):
            return a[0] / b[0], (a[1] - a[0] / b[0] * b[1]) / b[0]
        raise Unknown(f"the replay has no word for {type(op).__name__}")

    def compare(self, op: ast.cmpop, a: Any, b: Any) -> bool:
        if isinstance(op, ast.Is):
            return a is b
        self.signs.append(sign(a[0] - b[0]))
        for kind, holds in COMPARISONS:
            if isinstance(op, kind):
                return self.signs[-1] in holds
        raise Unknown(f"the replay has no word for {type(op).__name__}")

    def call(self, node: ast.Call, env: dict[str, Any]) -> Any:
        name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
        if name == "field":  # a list by its default_factory
            made = node.keywords[0].value
            return self.value(made.body if isinstance(made, ast.Lambda) else made, env)
        args = [self.value(item, env) for item in node.args]
        if name in self.records:
            return self.record(name) | {item.arg: self.value(item.value, env) for item in node.keywords}
        if name == "range":
            return range(*(int(x[0]) for x in args))
        if name == "float32":  # single precision rounds; the formulas are the same
            return args[0]
        if name == "_quotient":
            return self.operation(ast.Div(), *args)
        (x, dx), name = args[0], name.lstrip("_")
        if name in ("sign", "abs"):
            self.signs.append(sign(x))
        if name == "sign":
            return sign(x), ZERO
        now, slope = function(name, x)
        return now, slope * dx
