"""Export of the observer as a function block in Structured Text (IEC 61131-3) for a PLC.

The operations and their order are those of the C and its twin, in LREAL. Where C gives infinity or NaN and a PLC would
stop (division by zero, root or logarithm of a number that is not positive), a function returns 1E300: the sample is
then invalid, as in C.
"""

from collections.abc import Iterable

from codegen.base.errors import BadInput
from codegen.base.text import render
from codegen.emit.expression import Language
from codegen.emit.writer import Style, Writer
from codegen.export.generated_observer import GeneratedObserver
from codegen.program.code import Rolled
from codegen.program.lower import lower
from codegen.program.model import LARGEST

STRUCTS = {"parameters": "p_{name}", "state": "s_{name}", "inputs": "{name}", "outputs": "{name}"}
LOCAL = "l_{name}"
"""A local has a prefix, since an output of the same name is a variable of the block too."""
MODES = ("MODE_RUNNING", "MODE_HOLDING", "MODE_STARTING")
CALLS = {"sin": "SIN", "cos": "COS", "tan": "TAN", "exp": "EXP", "abs": "ABS", "pow": "EXPT"}
"""Functions of the standard."""
OWN = ("sign", "quotient", "sqrt", "log")
"""Functions that are defined together with the block."""
_KEYWORDS = """
    abs acos action add and any array asin at atan bool by byte case configuration constant cos dint div do dt
    dword else elsif end_if eq exit exp expt f_edge false for from function function_block ge gt if in
    initial_step int interval le len limit lint ln log lreal lt lword max min mod move mul mux ne not of on or
    pointer priority program r_edge read_only read_write real ref repeat replace reset resource retain return
    right rol ror sel shl shr sin single sint sqrt step string struct sub super tan task then this time to tod
    transition true trunc type udint uint ulint until usint using var var_input var_output while with within
    word wstring xor
"""
KEYWORDS = frozenset(_KEYWORDS.split())
"""Keywords of the standard and names of its functions, in lower case; the language ignores case."""


class LongReal(Language):
    """Language with LREAL literals: without the type, a literal would be rounded to single precision."""

    def literal(self, value: float) -> str:
        mantissa, _, exponent = super().literal(value).partition("e")
        number = mantissa if "." in mantissa else f"{mantissa}.0"
        return f"LREAL#{number}" + (f"E{int(exponent)}" if exponent else "")


def structured_text(observer: GeneratedObserver, header: list[str]) -> dict[str, str]:
    """The text of NAME.st, under the key "": a function block, called once a sample.

    Raises BadInput for a machine with numbered families (arrays), a law with tanh, or names that are not valid or not
    distinct in Structured Text, which ignores case.
    """
    program = observer.program
    code = lower(program)
    if program.arrays:
        found = f"{program.name}, whose code has loops over arrays"
        raise BadInput("--to", found, "a machine without numbered families, for Structured Text", code="SPEC036")
    missing = sorted(code.functions - {*CALLS, *OWN})
    if missing:
        found = f"the function {missing[0]}, which IEC 61131-3 does not have"
        raise BadInput("--to", found, "a law without it, for Structured Text", code="SPEC036")
    own = {name: f"{program.name}_{name}" for name in OWN}
    language = LongReal(CALLS | own)
    style = Style(language, STRUCTS, LOCAL, LOCAL, LOCAL, declares_locals=False, indent=4)
    text = Writer(program, code, style)
    functions = sorted((code.functions & {*OWN}) | ({"quotient"} if code.divides else set()))
    names = {
        "inputs": [f.name for f in program.inputs],
        "outputs": [name for name, _, _ in program.outputs],
        "parameters": [f"p_{f.name}" for f in program.parameters] + [f"p_{c.name}" for c in text.derived],
        "states": [f"s_{f.name}" for f in program.states] + ["s_mode", "s_invalid_samples", "s_started"],
        "locals": [*_locals_of(code.rolled, text), "check", "given"],
    }
    _refuse_names([program.name, "fault", *MODES, *own.values(), *(name for group in names.values() for name in group)])
    block = render(
        "export/structured_text.st.j2",
        program=program,
        header=header,
        claim=observer.claim,
        period=repr(observer.period),
        code=code,
        text=text,
        literal=language.literal,
        largest=language.literal(LARGEST["double"]),
        huge=language.literal(1e300),
        functions=functions,
        names=names,
        own=own,
    )
    return {"": block}


def _locals_of(rolled: Rolled, text: Writer) -> list[str]:
    """Names of the local variables, each once."""
    settings = (rolled.initial, rolled.predicted, rolled.resumed)
    stretches = [*rolled.step, *rolled.outputs, *rolled.following, *(s for each in settings for s in each.stretches)]
    return list(dict.fromkeys(text.target(line, s) for s in stretches for line in s.lines if not line.field))


def _refuse_names(names: Iterable[str]) -> None:
    """Raise BadInput for names that are equal without regard to case, or not valid in Structured Text."""
    seen: dict[str, str] = {}
    for name in names:
        other = seen.setdefault(name.lower(), name)
        if other != name:
            found = f"the names `{other}` and `{name}`, which are one in Structured Text"
            raise BadInput("--to", found, "names that differ by more than capitals", code="SPEC009")
        if name.lower() in KEYWORDS or "__" in name or name.endswith("_"):
            found = f"the name `{name}`, which Structured Text keeps or does not have"
            plain = "_".join(filter(None, name.split("_")))  # no name has two `_` in a row or one at its end
            nearest = f"{plain}_1" if name.lower() in KEYWORDS else plain
            raise BadInput("--to", found, "another name in the spec", nearest, code="SPEC009")
