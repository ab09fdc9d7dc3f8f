"""Log × Spec → findings: is this record fit to be diagnosed?"""

from __future__ import annotations

from codegen.logs.audit_force import audit_force
from codegen.logs.audit_input import audit_input
from codegen.logs.audit_motion import audit_motion
from codegen.logs.audit_record import audit_record
from codegen.logs.finding import Finding
from codegen.logs.log import Log
from codegen.logs.motion import measured_motion
from codegen.logs.steady import audit_steady, steady_speeds
from codegen.spec.model import Spec


def preflight(log: Log, spec: Spec) -> tuple[Finding, ...]:
    """Audit a log against its spec.

    Returns:
        Findings on the record, the motion, the inputs, and the sign and scale of forces; in this order.

    Raises:
        BadInput: if the spec's mechanics cannot be built.
    """
    motion = measured_motion(log)
    steady = steady_speeds(log, motion)
    return (
        *audit_record(log, turns=len(steady) < len(spec.coordinates)),
        *audit_motion(log, spec, motion),
        *audit_steady(steady, spec),
        *audit_input(log, spec),
        *audit_force(log, spec, motion, frozenset(s.coordinate for s in steady)),
    )
