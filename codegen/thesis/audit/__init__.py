"""The printed formulas of the thesis against our own derivation: what holds, what does not."""

from codegen.thesis.audit.judge import run_audit
from codegen.thesis.audit.output import audit_document, audit_json, audit_summary, write_audit

__all__ = ["audit_document", "audit_json", "audit_summary", "run_audit", "write_audit"]
