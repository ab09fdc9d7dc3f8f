"""The verbs of the command line ``stiction``, and their options.

A verb imports its modules when it runs, since help, version and errors of usage need none of the libraries. A long verb
imports them while its progress is shown.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from codegen.base.errors import BadInput, refuse_unknown
from codegen.base.files import named_path
from codegen.base.input_files import identity
from codegen.base.progress import progress
from codegen.base.result import Result, json_text, plain
from codegen.base.terminal import PlainConsole, output
from codegen.base.terminal import errors as error_output
from codegen.base.version import VERSION

if TYPE_CHECKING:
    from codegen.app.generate import Generated, GeneratedFmu
    from codegen.diagnosis.case import Findings

REFUSED, STALE = 3, 4

app = typer.Typer(
    help="Friction observers from a specification: derived, certified, generated, and checked against measured data.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help takes a tenth of a second less
    context_settings={"max_content_width": 120},
)


def argument(what: str, help: str | None = None) -> Any:
    """An argument of a verb; ``what`` is its placeholder in the help. A file is read, or refused, by the verb."""
    return typer.Argument(metavar=what, help=help, readable=False)


def option(names: str, what: str | None, help: str) -> Any:
    """An option of a verb, with its names separated by blanks; ``what``: None for a flag or a placeholder by type."""
    return typer.Option(*names.split(), metavar=what, help=help, readable=False)


def written(what: str, help: str) -> Any:
    """The option -o of a verb, for the file or folder to write."""
    return typer.Option("-o", "--output", parser=named_path, metavar=what, help=help)


AsJson = Annotated[bool, option("--json", None, "print JSON")]

SpecPath = Annotated[Path, argument("SPEC", "the spec file (YAML)")]
Description = Annotated[
    Path | None, option("--description -d", None, "read this file in place of meta.yaml beside the log")
]
Columns = Annotated[
    list[str] | None,
    option("--column -c", "NAME=COLUMN", "the column of a variable in all logs; for one log, meta.yaml in its folder"),
]


def _refuse_json(asked: bool) -> None:
    if asked:
        raise BadInput("--json", "it stands before the verb", "it behind: `stiction check SPEC --json`", code="CALL001")


def _print_version(asked: bool) -> None:
    if asked:
        output.print(VERSION)
        raise typer.Exit


@app.callback()
def common(
    effects: Annotated[
        list[Path] | None, option("--effects", "FILE", "a Python file with effects of your own; it is run")
    ] = None,
    version: Annotated[
        bool, typer.Option("--version", help="print the version", is_eager=True, callback=_print_version)
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", hidden=True, callback=_refuse_json)] = False,
) -> None:
    """Friction observers from a specification: derived, certified, generated, and checked against measured data."""
    if effects:
        from codegen.effects.register import load_effects

        for path in effects:
            load_effects(path)


@app.command(short_help="Write a commented spec to start from.")
def init(
    name: Annotated[str, argument("NAME", "of the machine, or a robot file; NAME.yaml is written")],
    source: Annotated[
        str | None, option("--from", "FILE", "a spec, a shipped one (two_mass), a robot.urdf, or MJCF")
    ] = None,
    log: Annotated[Path | None, option("--log", "LOG", "of the robot: its columns are matched by name")] = None,
) -> None:
    """Write NAME.yaml, a commented spec to start from."""
    from codegen.app.init import init

    for path in init(name, source, log=log):
        output.print(str(path))


@app.command(short_help="Print the JSON Schema of a spec, for an editor.")
def schema(out: Annotated[Path | None, written("FILE", "write it here, as .json")] = None) -> None:
    """Print the JSON Schema of a spec, by which an editor completes and checks its keys."""
    from codegen.base.files import refuse_target, write_atomically
    from codegen.spec.schema import json_schema

    text = json_text(json_schema())
    if out is not None:
        refuse_target(out, None, (".json",))
        write_atomically(out, text)
    output.print(text if out is None else f"{out}\n", end="")


@app.command()
def check(spec: SpecPath, as_json: AsJson = False) -> None:
    """Read and validate a spec; print the system in readable form."""
    from codegen.app.check import check, check_json, check_text

    machine = check(spec)
    _print(as_json, lambda: check_json(machine), lambda: check_text(machine))


@app.command()
def derive(
    spec: SpecPath, latex: Annotated[bool, option("--latex", None, "print LaTeX")] = False, as_json: AsJson = False
) -> None:
    """Derive Ψ, its characteristic polynomial and the gain conditions."""
    from codegen.app.derive import analysis_json, derive, derive_text

    if latex and as_json:
        raise BadInput("--latex", "given with --json", "one of them", code="CALL002")
    analysis = derive(spec)
    _print(as_json, lambda: analysis_json(analysis), lambda: derive_text(analysis, latex))


@app.command(short_help="Certify the sampled observer, or state why not.")
def certify(
    spec: SpecPath,
    out: Annotated[Path | None, written("FILE", "write certificate.json alone here")] = None,
    details: Annotated[
        bool, option("--details", None, "print the claim, checks and all assumptions too; --json has them")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Certify the sampled observer over the envelope, or state why not, with a counterexample and a remedy."""
    with progress():
        from codegen.app.certify import certify

        found = certify(spec, out)
    target = None if found.certificate is None else out
    on = error_output if found.certificate is None else output
    _print(as_json, lambda: found.content, lambda: on.fitted(found.text(target=target, details=details)), on)
    raise typer.Exit(REFUSED if found.certificate is None else 0)


@app.command(short_help="Check a certificate or a proof, and the C that it is about.")
def verify(
    certificate: Annotated[Path, argument("CERT")],
    spec: Annotated[Path | None, option("--spec", None, "check that the certificate is of this spec")] = None,
    smt: Annotated[
        Path | None, typer.Option("--smt", parser=named_path, metavar="FILE", help="write it for z3 or cvc5 too")
    ] = None,
    details: Annotated[
        bool, option("--details", None, "print what it rests on and all assumptions too; --json has them")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Check a certificate, that of a generated folder, or proof.json by the independent checker (codegen/checker/).

    Exit status: 0 verified, and proved of the C in the same folder; 4 the same where the printed conditions hold; 5
    the algebra holds, and it was not bound to code; 3 refused.
    """
    from codegen.app.verify import certificate_in, print_verification, verification_json

    certificate = certificate_in(certificate)
    if smt is not None:
        from codegen.app.smt_lib import refuse_smt_target, write_smt

        refuse_smt_target(certificate, smt)
    if as_json:
        content, status = verification_json(certificate, spec)
    else:
        content, status = {}, print_verification(certificate, spec, details)
    written = write_smt(certificate, smt) if status not in (2, REFUSED) and smt is not None else None
    if as_json:
        print_json(content)  # last: what could not be written is the one JSON text in its place
    elif written is not None:
        output.print(str(written))
    raise typer.Exit(status)


@app.command(short_help="Write C, Python, certificate and README of an observer.")
def generate(
    specs: Annotated[list[Path], argument("SPEC...", "spec files")],
    out: Annotated[Path | None, written("DIR", "folder; generated/NAME by default")] = None,
    check_only: Annotated[bool, option("--check", None, "write nothing; fail if the files are not current")] = False,
    uncertified: Annotated[bool, option("--uncertified", None, "write the code even without a certificate")] = False,
    force: Annotated[bool, option("--force", None, "replace generated files that were edited, too")] = False,
    target: Annotated[
        list[str] | None, option("--target", "TARGET", "c, python (these two by default), simd, all; or fmu alone")
    ] = None,
    precision: Annotated[
        str | None, option("--precision", "WORD", "double or single; as in the spec by default")
    ] = None,
    fault: Annotated[str | None, option("--fault", "WORD", "hold or none, where a sample is not finite")] = None,
    fmi: Annotated[str | None, option("--fmi", "VERSION", "of the FMU: 3.0 (by default) or 2.0")] = None,
    as_json: AsJson = False,
) -> None:
    """Write C, Python, certificate and README into generated/NAME/, or NAME.fmu."""
    _refuse_specs(specs, out)
    fmu = target == ["fmu"]
    if fmi is not None and not fmu:
        raise BadInput("--fmi", "a version without an FMU", "--target fmu with it", code="CALL002")
    results, codes = [], []
    for spec in specs:
        made: Generated | GeneratedFmu
        with progress():
            from codegen.app.derived import Overrides
            from codegen.app.generate import generate, generate_fmu

            overrides = Overrides(precision, fault, () if fmu else tuple(target or ()))
            if fmu:
                made = generate_fmu(spec, out, fmi or "3.0", check_only, uncertified, overrides, force)
            else:
                made = generate(spec, out, check_only, uncertified, overrides, force)
        results.append(made.content)
        codes.append(STALE if check_only and made.stale else REFUSED if made.refused and not uncertified else 0)
        if not as_json:
            output.print(made.text(), end="")
    if as_json:
        print_json({"format": "stiction-generation/1", "machines": results})
    raise typer.Exit(max(codes))


def _refuse_specs(specs: Sequence[Path], out: Path | None) -> None:
    """Raise BadInput for one folder for several specs, and for a spec that is given twice."""
    if out is not None and len(specs) > 1:
        found = f"one folder for {len(specs)} specs"
        raise BadInput("-o", found, "one spec with -o, or several without", code="CALL002")
    again = next((spec for k, spec in enumerate(specs) if identity(spec) in map(identity, specs[:k])), None)
    if again is not None:
        raise BadInput(str(again), "the same spec again", "each spec once", code="CALL002")


@app.command(short_help="Show which gains are stable, and suggest some.")
def gains(
    spec: SpecPath,
    out: Annotated[Path | None, written("DIR", "folder for gains.json, gains.png, spec.yaml")] = None,
    over: Annotated[
        tuple[str, str] | None, option("--over", "NAME NAME", "axes of the map; h is the sample time")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show which gains are stable, with what margin, and suggest some; for free gains or around chosen ones."""
    with progress():
        from codegen.app.gains import gains

        report = gains(spec, out, over or ())
    _show(report, as_json)
    raise typer.Exit(REFUSED if report.feasibility.infeasible is not None else 0)


@app.command(short_help="Say which friction the inputs can cancel.")
def cancel(
    spec: SpecPath,
    out: Annotated[Path | None, written("DIR", "folder for the results")] = None,
    hunt: Annotated[bool, option("--hunt", None, "look for limit cycles of the closed loop")] = False,
    as_json: AsJson = False,
) -> None:
    """Say which friction the inputs can cancel, why, and by which input."""
    with progress() as display:
        from codegen.app.cancel import cancel

        report = cancel(spec, out, hunt, display)
    _show(report, as_json)
    raise typer.Exit(REFUSED if report.refusal is not None else 0)


@app.command(short_help="Write a log from the plant of a spec.")
def simulate(
    spec: SpecPath,
    out: Annotated[Path, written("LOG", "the CSV file to write")],
    plant: Annotated[str, option("--plant", None, "own, or mujoco: the exported model in MuJoCo")] = "own",
    as_json: AsJson = False,
) -> None:
    """Write a log from the plant of the spec, with its declared effects."""
    with progress() as display:
        from codegen.app.simulate import simulate

        result = simulate(spec, out, display, plant)
    if not as_json:
        error_output.print(result.text(paths=False), end="")
    _print(as_json, lambda: result.content, lambda: f"{result.path}\n")


@app.command(short_help="Write the machine for a simulator, firmware or controller.")
def export(
    spec: SpecPath,
    to: Annotated[str, option("--to", "FORMAT", "such as mjcf, urdf, csv-map, odrive, arduino or ros2_control")],
    out: Annotated[Path, written("FILE", "file, or folder of a library")],
    on: Annotated[str | None, option("--on", "NAME", "the coordinate of a map")] = None,
    counts: Annotated[int | None, option("--counts", None, "rows of a turn in csv-map; 3600 by default")] = None,
    gear: Annotated[float | None, option("--gear", "N", "turns of the motor a turn of the joint, in a map")] = None,
    into: Annotated[Path | None, option("--into", "MODEL", "your MuJoCo model: only its friction is changed")] = None,
    as_json: AsJson = False,
) -> None:
    """Write the machine as a simulator's model or a firmware's map, or its observer as a library; list what is lost."""
    from codegen.app.export import export

    result = export(spec, to, out, on, counts, gear, into)
    _show(result, as_json)


@app.command(short_help="Find the effect that the model lacks in a measured log.")
def diagnose(
    spec: SpecPath,
    log: Annotated[list[Path], argument("LOG...", "measured log, CSV or .mat; or several of one experiment")],
    test: Annotated[list[Path] | None, option("--test", "LOG2", "log to measure the error on; may be repeated")] = None,
    out: Annotated[Path | None, written("DIR", "folder for the results; by default run_diagnosis for run.csv")] = None,
    description: Description = None,
    column: Columns = None,
    propose: Annotated[bool, option("--propose", None, "where nothing known fits, a term by PySINDy")] = False,
    material: Annotated[
        str | None, option("--material", "SHARE", "of the drive force: less is immaterial; 2% by default")
    ] = None,
    force: Annotated[
        bool, option("--force", None, "replace the diagnosis of another log, and files that you edited, too")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Find the effect that the model lacks; write diagnosis.json, spec.yaml (augmented) and report.html."""
    with progress(lines=True) as display:
        gc.disable()
        from codegen.app.diagnose import diagnose, findings_text
        from codegen.base.parallel import allow_processes

        gc.freeze()  # the objects of the libraries stay to the end; the collector need not search them again
        gc.enable()
        allow_processes()

        def print_findings(found: Findings) -> None:
            if as_json:
                return
            display.above(lambda: output.print(findings_text(found), end=""))
            sys.stdout.flush()  # for a pipe

        columns = _columns(column or [])
        result = diagnose(spec, log, test, out, description, columns, display, propose, material, print_findings, force)
    _show(result, as_json, preflight_shown=True)
    raise typer.Exit(REFUSED if result.diagnosis.verdict == "unfit" else 0)


@app.command(short_help="Run the generated observer over a log.")
def replay(
    spec: SpecPath,
    log: Annotated[Path, argument("LOG", "measured log, CSV, .npy or .mat")],
    out: Annotated[Path | None, written("OUT", "CSV or .npy to write")] = None,
    description: Description = None,
    column: Columns = None,
    only: Annotated[list[str] | None, option("--only", "OUTPUT", "write this output")] = None,
    as_json: AsJson = False,
) -> None:
    """Run the generated observer over a log at compiled speed; write its estimates."""
    from codegen.app.replay import replay

    result = replay(spec, log, out, description, _columns(column or []), only or ())
    _show(result, as_json)


@app.command(short_help="Run the observer on rows as they arrive from a machine.")
def watch(
    spec: SpecPath,
    log: Annotated[
        str, option("--log", "LOG", "a CSV file or - for standard input, as rows arrive; or a log of another format")
    ],
    column: Columns = None,
    dwell: Annotated[
        str | None,
        option("--dwell", "S", "time outside of the bound before it is reported, in s or such as 10ms; 10 samples"),
    ] = None,
    follow: Annotated[bool, option("--follow", None, "wait at the end of the file for more rows")] = False,
    as_json: AsJson = False,
) -> None:
    """Run the observer on rows as they arrive from a machine; report when friction leaves its certified bound.

    Ends with the rows, or by Ctrl-C, with a short report. Exit status 3 where the bound was left, 2 where no sample
    could be compared with it.
    """
    from codegen.app.watch import alarm_text, watch

    on_alarm = None if as_json else lambda alarm: output.print(alarm_text(alarm), end="")
    result = watch(spec, log, _columns(column or []), dwell, follow, on_alarm)
    _show(result, as_json)
    fault = result.fault or result.useless
    if fault is not None and not result.alarms and not as_json:
        raise fault
    raise typer.Exit(REFUSED if result.alarms else 2 if fault is not None else 0)


@app.command(short_help="Run all steps of the main job on a shipped example.")
def demo(out: Annotated[Path, written("DIR", "its folder")] = Path("demo")) -> None:
    """Diagnose a belt-driven axis with an effect that its spec lacks; certify and generate, before and after."""
    with progress() as display:
        from codegen.app.demo import run_demo

        run_demo(out, output.print, display)


@app.command()
def version() -> None:
    """Print the version."""
    output.print(VERSION)


@app.command(short_help="List the friction laws, or show one in full.")
def laws(
    name: Annotated[str | None, argument("LAW", "this one alone, in full")] = None, as_json: AsJson = False
) -> None:
    """List the friction laws, or show one in full."""
    from codegen.friction import ALSO_CALLED, LAWS
    from codegen.report.laws import law_groups, law_view

    if name is None:
        groups = {"groups": law_groups()}
        _print_entries("laws", groups, "laws", groups, as_json)
        return
    refuse_unknown_entry(name, {**LAWS, **ALSO_CALLED}, "laws")
    view = law_view(LAWS[ALSO_CALLED.get(name, name)])
    _print_entries("laws", {"laws": [view]}, "law", {"law": view}, as_json)


@app.command(short_help="List the effects that a model may lack, or show one in full.")
def effects(
    name: Annotated[str | None, argument("KIND", "this one alone, in full")] = None, as_json: AsJson = False
) -> None:
    """List the effects that a model may lack, or show one in full."""
    from codegen.effects import CATALOGUE
    from codegen.report.effects import effect_view, effect_views

    if name is None:
        views = {"effects": effect_views()}
        _print_entries("effects", views, "effects", views, as_json)
        return
    refuse_unknown_entry(name, CATALOGUE, "effects")
    view = effect_view(CATALOGUE[name])
    _print_entries("effects", {"effects": [view]}, "effect", {"e": view}, as_json)


@app.command(short_help="List the codes of error messages, or show one with advice.")
def errors(
    code: Annotated[str | None, argument("CODE", "this one alone, such as LOG003")] = None, as_json: AsJson = False
) -> None:
    """List the codes of error messages, or show one, with what each says and what to do."""
    from codegen.base.error_codes import CODES

    if code is not None:
        refuse_unknown_entry(code.upper(), CODES, "errors")
    codes = CODES if code is None else {code.upper(): CODES[code.upper()]}
    rows = [{"code": code, "meaning": meaning, "advice": advice} for code, (meaning, advice) in codes.items()]
    _print_entries("error-codes", {"codes": rows}, "errors", {"codes": codes}, as_json)


@app.command(short_help="Compare the thesis' printed formulas with our derivation.")
def audit(
    out: Annotated[Path | None, written("FILE", "write docs/audit.md here")] = None, as_json: AsJson = False
) -> None:
    """Compare the printed formulas of the thesis with our own derivation of them."""
    with progress() as display:
        from codegen.base.own_files import write_page
        from codegen.thesis.audit.claim import audit_document, audit_json, audit_summary
        from codegen.thesis.audit.judge import run_audit

        findings = run_audit(lambda share: display("audit", share))
    if out is not None:
        write_page(out, audit_document(findings))
    path = "" if out is None else f"{out}\n"
    content = {"format": "stiction-audit/1", "findings": audit_json(findings)}
    _print(as_json, lambda: content, lambda: path + audit_summary(findings))


@app.command(short_help="Run the thesis' figures, and check its statements on them.")
def gallery(
    out: Annotated[Path, written("DIR", "folder for pictures and table")] = Path("docs/gallery"),
    only: Annotated[list[str] | None, option("--only", "FIGURE", "such as 4.3; the others stay as last run")] = None,
    as_json: AsJson = False,
) -> None:
    """Run the figures of the thesis, and check what its text says of them."""
    from codegen.base.parallel import allow_processes

    allow_processes()
    with progress() as display:
        from codegen.thesis.gallery.build import run_gallery
        from codegen.thesis.gallery.page import gallery_json, gallery_summary, write_gallery

        results = run_gallery(only or (), lambda share: display("gallery", share))
    files = write_gallery(results, out)
    content = {"format": "stiction-gallery/1", "figures": gallery_json(results), "files": files}
    _print(as_json, lambda: content, lambda: "".join(f"{path}\n" for path in files) + gallery_summary(results))


def refuse_unknown_entry(name: str, known: Mapping[str, object], verb: str) -> None:
    """Raise BadInput for a name that a verb does not list."""
    refuse_unknown(name, known, f"stiction {verb}", "", f"a name that `stiction {verb}` lists", code="CALL001")


def _print_entries(kind: str, content: dict[str, Any], template: str, view: dict[str, Any], as_json: bool) -> None:
    """Print entries of a reference as JSON, or by a template."""
    from codegen.base.text import render

    content = {"format": f"stiction-{kind}/1", **content}
    _print(as_json, lambda: content, lambda: render(f"text/{template}.txt.j2", **view))


def print_json(content: object) -> None:
    """Print a result as one JSON object, whose ``format`` names its content and version."""
    output.print(json_text(plain(content)), end="")


def _show(result: Result, as_json: bool, **options: object) -> None:
    _print(as_json, lambda: result.content, lambda: result.text(**options))


def _print(as_json: bool, content: Callable[[], object], text: Callable[[], str], on: PlainConsole = output) -> None:
    """Print a result as JSON, or as text on a console."""
    if as_json:
        print_json(content())
    else:
        on.print(text(), end="")


def _columns(pairs: list[str]) -> dict[str, str]:
    split = {pair: pair.partition("=") for pair in pairs}
    for pair, (name, _, column) in split.items():
        if not name or not column:
            raise BadInput("--column", f"`{pair}`", "NAME=COLUMN, such as x=qm", code="CALL001")
    columns: dict[str, str] = {}
    for name, _, column in split.values():
        first = columns.setdefault(name.strip(), column.strip())
        if first != column.strip():
            found = f"`{name.strip()}` with two columns, `{first}` and `{column.strip()}`"
            raise BadInput("--column", found, "one column for each name", code="CALL001")
    return columns
