"""Names that a specification cannot use, since C, Python, the generated code or readers of formulas keep them."""

from __future__ import annotations

import keyword
import re

from codegen.spec.functions import CONSTANTS, FUNCTIONS

_C_WORDS = re.compile(
    r"auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|inline|int|long|register|"
    r"restrict|return|short|signed|sizeof|static|struct|switch|typedef|union|unsigned|void|volatile|while|bool|true|"
    r"false|class|new|delete|this|template|typename|namespace|private|public|protected|virtual|operator|using|NULL|"
    r"NAN|INFINITY|HUGE_VAL|EOF|M_[A-Z0-9_]+|asm|explicit|friend|mutable|throw|catch|try|xor|typeof|unix|linux|"
    r"signbit|isnan|isinf|isfinite|stdin|stdout|stderr|errno|complex|imaginary|constexpr|nullptr|decltype|concept|and|or|not"
)
_RESERVED = {"t", "state", "parameters", "inputs", "outputs", "sample_time", "lambda", "I", "E"}
"""Words of the generated code, and names that complex.h and readers of formulas keep for i and e."""


def reserved(name: str) -> bool:
    """Whether a name is kept for something else."""
    return bool(
        _C_WORDS.fullmatch(name)
        or keyword.iskeyword(name)
        or name in FUNCTIONS
        or name in CONSTANTS
        or name in _RESERVED
    )
