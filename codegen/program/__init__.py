"""Observer → Program, the intermediate form, and Program → Code, the one order of operations that is printed."""

from codegen.program.build import build_program
from codegen.program.code import Code
from codegen.program.lower import lower
from codegen.program.model import Block, Field, Program

__all__ = ["Block", "Code", "Field", "Program", "build_program", "lower"]
