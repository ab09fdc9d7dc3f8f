"""Stiction: friction observers from a specification.

The stations of the line, each one function with one typed value in and one out::

    read_spec -> build_system -> build_observer -> analyse -> certify -> build_program -> write_package
    read_log -> diagnose -> augmented spec, and round again

See docs/architecture.md.
"""

from codegen.base.errors import BadInput
from codegen.base.version import VERSION

__all__ = ["VERSION", "BadInput"]
__version__ = VERSION
