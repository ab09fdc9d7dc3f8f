"""Text → Spec: a safe expression parser, the schema, units, and writing back with comments kept."""

from codegen.spec.model import Spec
from codegen.spec.reader import parse_spec, read_spec

__all__ = ["Spec", "parse_spec", "read_spec"]
