"""The diagnosis report: one self-contained HTML page, without scripts or external files."""

from codegen.report.page import render_report

__all__ = ["render_report"]
