"""Reading of specifications, text → Spec: safe expression parser, schema, units; and writing that keeps comments."""

from codegen.spec.model import Spec
from codegen.spec.reader import parse_spec, read_spec

__all__ = ["Spec", "parse_spec", "read_spec"]
