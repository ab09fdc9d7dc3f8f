"""Program and its C → a functional mock-up unit (FMI 2.0 and 3.0, co-simulation)."""

from codegen.emit.fmu.archive import VERSIONS, Fmu, emit_fmu

__all__ = ["VERSIONS", "Fmu", "emit_fmu"]
