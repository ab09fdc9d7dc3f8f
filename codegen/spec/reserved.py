"""Names that a specification cannot use, since they have a meaning in C, Python, generated code or formulas."""

import keyword
import re

from codegen.spec.functions import CONSTANTS, FUNCTIONS

_C_WORDS = re.compile(
    r"auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|"
    r"restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while|bool|true|"
    r"false|class|new|delete|this|template|typename|namespace|private|public|protected|virtual|operator|using|NULL|"
    r"NAN|INFINITY|HUGE_VAL|EOF|M_[A-Z0-9_]+|asm|explicit|friend|mutable|throw|catch|try|xor|typeof|unix|linux|"
    r"signbit|isnan|isinf|isfinite|isnormal|isunordered|is(less|greater|lessequal|greaterequal|lessgreater)|fpclassify|"
    r"stdin|stdout|stderr|errno|complex|imaginary|constexpr|nullptr|decltype|concept|and|or|not|"
    r"static_assert|alignas|alignof|and_eq|or_eq|not_eq|xor_eq|bitand|bitor|compl|noexcept|requires|thread_local|typeid|"
    r"char(8|16|32)_t|wchar_t|(const|dynamic|static|reinterpret)_cast|co_(await|return|yield)|const(eval|init)|export|"
    r"typeof_unqual|offsetof|math_errhandling|i386|AVR|WIN32|WIN64|WINNT|mips"
)
_C_MACROS = re.compile(
    r"(FLT|DBL|LDBL|DECIMAL|FP|MATH)_[A-Z0-9_]+|HUGE_VAL[FL]|BUFSIZ|SEEK_(CUR|END|SET)|L_(tmpnam|ctermid|cuserid)|P_tmpdir|"
    r"U?INT(8|16|32|64|MAX|PTR|_FAST\d+|_LEAST\d+)_(MAX|MIN|C)|(FILENAME|FOPEN|TMP|RAND|PTRDIFF|SIG_ATOMIC|SIZE|WCHAR|"
    r"WINT|MB_CUR)_(MAX|MIN)|EXIT_(SUCCESS|FAILURE)|DOMAIN|SING|OVERFLOW|UNDERFLOW|PLOSS|TLOSS|STICTION_\w+"
)
"""Of float.h, math.h, stdio.h, stdlib.h, stddef.h and stdint.h, and the guards of our own headers."""
_HEADERS = re.compile(
    r"assert|complex|ctype|errno|fenv|float|inttypes|iso646|limits|locale|math|setjmp|signal|std(align|arg|atomic|bool|"
    r"def|int|io|lib|noreturn)|string|tgmath|threads|time|uchar|wchar|wctype|alloca|endian|features|malloc|memory|"
    r"pthread|sched|strings|unistd"
)
_RESERVED = {"t", "state", "parameters", "inputs", "outputs", "sample_time", "lambda", "I", "E", "null"}
"""Words of the generated code, and names that denote the constants i and e in complex.h and formulas."""

_MODES = ("RUNNING", "HOLDING", "STARTING")
_IDENTIFIER = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def is_identifier(name: str) -> bool:
    """Whether a name is one in C, Python and FMI alike: ASCII letters, digits and ``_``, starting with a letter."""
    return _IDENTIFIER.fullmatch(name) is not None


def reserved(name: str) -> bool:
    """Whether a name has a meaning in C, in Python, in expressions of a spec or in the generated code."""
    return bool(
        _C_WORDS.fullmatch(name)
        or _C_MACROS.fullmatch(name)
        or keyword.iskeyword(name)
        or name in FUNCTIONS
        or name in CONSTANTS
        or name in _RESERVED
    )


def why_not_name(name: str, machine: str) -> str:
    """Why a quantity cannot have a name, such as ``a reserved word``; "" if it can.

    ``machine``: its name, with which the macros and functions of its C begin.
    """
    parts = ("PARAMETERS", "LANES", "COLD", *_MODES, *(f"LANE_{mode}" for mode in _MODES))
    macros = (*(f"{machine.upper()}_{part}" for part in parts), "SAMPLE_TIME", "STEP_TOLERANCE", "EXPORTED")
    if name in macros or name.startswith(("fmi2", "fmi3", "FMI2_", "FMI3_")):
        return "a macro of the generated code"
    if name == f"{machine}_sign":
        return "a function of the generated code"
    if name in ("I", "E"):
        return "which complex.h and formulas use for the constants i and e"
    return "a reserved word" if reserved(name) else ""


def why_not_file(name: str) -> str:
    """Why no file of generated code can have a machine's name, in words; "" if it can."""
    if _HEADERS.fullmatch(name.lower()):
        return f"whose {name}.h would hide a header of C"
    device = re.fullmatch(r"con|prn|aux|nul|(com|lpt)[0-9]", name.lower())
    return "which no file can have on Windows" if device else ""
