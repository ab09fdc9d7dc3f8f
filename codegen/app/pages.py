"""The verbs of reference and thesis: ``laws``, ``effects``, ``errors``, ``audit`` and ``gallery``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from codegen.app.options import AsJson, argument, option, print_json, written
from codegen.base.errors import refuse_unknown
from codegen.base.progress import progress
from codegen.base.terminal import output

pages = typer.Typer()


@pages.command(short_help="List the friction laws, or show one in full.")
def laws(
    name: Annotated[str | None, argument("LAW", "this one alone, in full")] = None, as_json: AsJson = False
) -> None:
    """List the friction laws, or show one in full."""
    from codegen.friction import ALSO_CALLED, LAWS
    from codegen.report.laws import law_groups, law_view

    if name is None:
        groups = {"groups": law_groups()}
        _print("laws", groups, "laws", groups, as_json)
        return
    refuse_unknown_entry(name, {**LAWS, **ALSO_CALLED}, "laws")
    view = law_view(LAWS[ALSO_CALLED.get(name, name)])
    _print("laws", {"laws": [view]}, "law", {"law": view}, as_json)


@pages.command(short_help="List the effects that a model may lack, or show one in full.")
def effects(
    name: Annotated[str | None, argument("KIND", "this one alone, in full")] = None, as_json: AsJson = False
) -> None:
    """List the effects that a model may lack, or show one in full."""
    from codegen.effects import CATALOGUE
    from codegen.report.effects import effect_view, effect_views

    if name is None:
        views = {"effects": effect_views()}
        _print("effects", views, "effects", views, as_json)
        return
    refuse_unknown_entry(name, CATALOGUE, "effects")
    view = effect_view(CATALOGUE[name])
    _print("effects", {"effects": [view]}, "effect", {"e": view}, as_json)


@pages.command(short_help="List the codes of error messages, or show one with advice.")
def errors(
    code: Annotated[str | None, argument("CODE", "this one alone, such as LOG003")] = None, as_json: AsJson = False
) -> None:
    """List the codes of error messages, or show one, with what each says and what to do."""
    from codegen.base.error_codes import CODES

    if code is not None:
        refuse_unknown_entry(code.upper(), CODES, "errors")
    codes = CODES if code is None else {code.upper(): CODES[code.upper()]}
    rows = [{"code": code, "meaning": meaning, "advice": advice} for code, (meaning, advice) in codes.items()]
    _print("error-codes", {"codes": rows}, "errors", {"codes": codes}, as_json)


def refuse_unknown_entry(name: str, known: Mapping[str, object], verb: str) -> None:
    """Raise BadInput for a name that a verb does not list."""
    refuse_unknown(name, known, f"stiction {verb}", "", f"a name that `stiction {verb}` lists", code="CALL001")


def _print(kind: str, content: Mapping[str, Any], template: str, view: Mapping[str, Any], as_json: bool) -> None:
    """Print JSON, or a text."""
    from codegen.base.text import render

    if as_json:
        print_json({"format": f"stiction-{kind}/1", **content})
    else:
        output.print(render(f"text/{template}.txt.j2", **view), end="")


@pages.command(short_help="Compare the thesis' printed formulas with our derivation.")
def audit(
    out: Annotated[Path | None, written("FILE", "write docs/audit.md here")] = None,
    as_json: AsJson = False,
) -> None:
    """Compare the printed formulas of the thesis with our own derivation of them."""
    with progress() as tell:
        from codegen.thesis.audit.judge import run_audit
        from codegen.thesis.audit.output import audit_json, audit_summary, write_audit

        findings = run_audit(lambda share: tell("audit", share))
    written = None if out is None else write_audit(findings, out)
    if as_json:
        print_json({"format": "stiction-audit/1", "findings": audit_json(findings)})
    else:
        output.print(("" if written is None else f"{written}\n") + audit_summary(findings), end="")


@pages.command(short_help="Run the thesis' figures, and check its statements on them.")
def gallery(
    out: Annotated[Path, written("DIR", "folder for pictures and table")] = Path("docs/gallery"),
    only: Annotated[list[str] | None, option("--only", "FIGURE", "such as 4.3; the others stay as last run")] = None,
    as_json: AsJson = False,
) -> None:
    """Run the figures of the thesis, and check what its text says of them."""
    from codegen.base.parallel import allow_processes

    allow_processes()
    with progress() as tell:
        from codegen.thesis.gallery.build import run_gallery
        from codegen.thesis.gallery.page import gallery_json, gallery_summary, write_gallery

        results = run_gallery(only or (), lambda share: tell("gallery", share))
    written = write_gallery(results, out)
    if as_json:
        print_json({"format": "stiction-gallery/1", "figures": gallery_json(results), "files": written})
    else:
        output.print("".join(f"{path}\n" for path in written) + gallery_summary(results), end="")
