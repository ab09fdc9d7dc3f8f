"""Observer → Program: the intermediate form that every language is printed from."""

from codegen.program.build import build_program
from codegen.program.model import Block, Field, Program

__all__ = ["Block", "Field", "Program", "build_program"]
