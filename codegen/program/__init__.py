"""Intermediate representation of an observer: Program (named blocks over SX), and Code, its printed operations."""

from codegen.program.build import build_program
from codegen.program.code import Code
from codegen.program.lower import lower
from codegen.program.model import Block, Field, Program

__all__ = ["Block", "Code", "Field", "Program", "build_program", "lower"]
