"""Functions and constants that an expression of a spec may use.

``Magnitude`` (abs) and ``Sgn`` are SymPy functions of our own: derivatives of SymPy's ``Abs`` and ``sign`` contain
Dirac deltas and complex cases, while friction is analysed between reversals, where the sign of a slip velocity is
constant.
"""

from typing import Any

import sympy


def _sign(argument: Any) -> Any:
    """The sign of a constant, such as pi - 3; None if the argument is not a constant, or its sign is not known."""
    if argument.is_Number:
        return sympy.sign(argument)
    if not argument.is_number:  # checked first, since SymPy takes milliseconds to find that a sum has no known sign
        return None
    known = (argument.is_positive, 1), (argument.is_negative, -1), (argument.is_zero, 0)
    return next((sympy.Integer(sign) for holds, sign in known if holds), None)


class Sgn(sympy.Function):
    """Sign function with sgn(0) = 0. It is constant between reversals, so its derivative is zero."""

    nargs = 1
    is_real = True

    @classmethod
    def eval(cls, argument: Any) -> Any:
        return _sign(argument)

    def fdiff(self, argindex: int = 1) -> Any:
        return sympy.Integer(0)

    def _sympystr(self, printer: Any) -> str:
        return f"sgn({printer._print(self.args[0])})"

    def _latex(self, printer: Any, exp: str | None = None) -> str:
        body = rf"\operatorname{{sgn}}\left({printer._print(self.args[0])}\right)"
        return rf"{body}^{{{exp}}}" if exp else body


class Magnitude(sympy.Function):
    """Absolute value; its derivative is ``Sgn``."""

    nargs = 1
    is_real = True
    is_nonnegative = True

    @classmethod
    def eval(cls, argument: Any) -> Any:
        sign = _sign(argument)
        return None if sign is None else sign * argument

    def fdiff(self, argindex: int = 1) -> Any:
        return Sgn(self.args[0])

    def _sympystr(self, printer: Any) -> str:
        return f"abs({printer._print(self.args[0])})"

    def _latex(self, printer: Any, exp: str | None = None) -> str:
        body = rf"\left|{printer._print(self.args[0])}\right|"
        return rf"{body}^{{{exp}}}" if exp else body


FUNCTIONS: dict[str, Any] = {
    "sin": sympy.sin,
    "cos": sympy.cos,
    "tan": sympy.tan,
    "exp": sympy.exp,
    "log": sympy.log,
    "sqrt": sympy.sqrt,
    "tanh": sympy.tanh,
    "abs": Magnitude,
    "sgn": Sgn,
}
OTHER_NAMES = {"sign": "sgn", "signum": "sgn", "fabs": "abs", "ln": "log", "power": "^", "pow": "^"}
"""Name of a function or operator in other languages → name in a spec."""
CONSTANTS: dict[str, Any] = {"pi": sympy.pi}
