"""Program, the intermediate form of an observer as named blocks, and Code, its printed order of operations."""

from codegen.program.build import build_program
from codegen.program.code import Code
from codegen.program.lower import lower
from codegen.program.model import Block, Field, Program

__all__ = ["Block", "Code", "Field", "Program", "build_program", "lower"]
