"""The verbs that write pages of docs/: ``laws``, ``effects``, ``errors``, ``audit`` and ``gallery``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from codegen.app.options import AsJson, argument, option, print_json, written
from codegen.base.errors import BadInput, refuse_unknown
from codegen.base.files import refuse_target
from codegen.base.progress import progress
from codegen.base.terminal import output

pages = typer.Typer()


@pages.command(short_help="List the friction laws, or show one in full.")
def laws(
    name: Annotated[str | None, argument("LAW", "this one alone, in full")] = None,
    out: Annotated[Path | None, written("DIR", "write laws.md and its pictures here")] = None,
    as_json: AsJson = False,
) -> None:
    """List the friction laws, show one in full, or write their page with a picture of each."""
    from codegen.friction import ALSO_CALLED, LAWS
    from codegen.report.laws import law_groups, law_view, write_laws

    if name is not None:
        known = _known(name, {**LAWS, **ALSO_CALLED}, "laws", out)
        view = law_view(LAWS[ALSO_CALLED.get(known, known)])
        _print("laws", {"laws": [view]}, "law", {"law": view}, as_json)
        return
    written = _page(out, "laws", write_laws)
    groups = {"groups": law_groups()}
    _print("laws", groups, "laws", groups, as_json, written)


@pages.command(short_help="List the effects that a model may lack, or show one in full.")
def effects(
    name: Annotated[str | None, argument("KIND", "this one alone, in full")] = None,
    out: Annotated[Path | None, written("DIR", "write effects.md and its pictures here")] = None,
    as_json: AsJson = False,
) -> None:
    """List the effects that a model may lack, show one in full, or write their page with a picture of each."""
    from codegen.effects import CATALOGUE
    from codegen.report.effects import effect_view, effect_views, write_effects

    if name is not None:
        view = effect_view(CATALOGUE[_known(name, CATALOGUE, "effects", out)])
        _print("effects", {"effects": [view]}, "effect", {"e": view}, as_json)
        return
    written = _page(out, "effects", write_effects)
    views = effect_views()
    _print("effects", {"effects": views}, "effects", {"effects": views}, as_json, written)


@pages.command(short_help="List the codes of error messages, or show one with advice.")
def errors(
    code: Annotated[str | None, argument("CODE", "this one alone, such as LOG003")] = None,
    out: Annotated[Path | None, written("DIR", "write errors.md here")] = None,
    as_json: AsJson = False,
) -> None:
    """List the codes of error messages, or show one, with what each says and what to do; or write their page."""
    from codegen.base.error_codes import CODES
    from codegen.base.own_files import write_page
    from codegen.base.text import render

    codes = CODES
    if code is not None:
        asked = _known(code.upper(), CODES, "errors", out)
        codes = {asked: CODES[asked]}
    if out is not None:
        write_page(out / "errors.md", render("text/errors.md.j2", codes=CODES))
    rows = [{"code": code, "meaning": meaning, "advice": advice} for code, (meaning, advice) in codes.items()]
    written = None if out is None else out / "errors.md"
    _print("error-codes", {"codes": rows}, "errors", {"codes": codes}, as_json, written)


def _known(name: str, known: Mapping[str, object], verb: str, out: Path | None) -> str:
    """The name that was given to a verb; raises BadInput for an unknown one, or together with ``out``."""
    if out is not None:
        raise BadInput("-o", f"a folder for the page, and `{name}` alone", "one of the two", code="CALL002")
    refuse_unknown(name, known, f"stiction {verb}", "", f"a name that `stiction {verb}` lists", code="CALL001")
    return name


def _page(out: Path | None, name: str, write: Callable[[Path], Path]) -> Path | None:
    """Write a page and its pictures if a folder is given; an unusable folder is refused before they are drawn."""
    if out is None:
        return None
    refuse_target(out / f"{name}.md")
    refuse_target(out / name / "_.svg")
    return write(out)


def _print(
    kind: str, content: Mapping[str, Any], template: str, view: Mapping[str, Any], as_json: bool, page: object = None
) -> None:
    """Print JSON, or the path of the written page, or else a text."""
    from codegen.base.text import render

    if as_json:
        print_json({"format": f"stiction-{kind}/1", **content})
    else:
        output.print(render(f"text/{template}.txt.j2", **view) if page is None else f"{page}\n", end="")


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
