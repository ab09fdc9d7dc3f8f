"""Diagnosis → one HTML page that stands alone: no scripts, nothing fetched."""

from codegen.report.page import render_report

__all__ = ["render_report"]
