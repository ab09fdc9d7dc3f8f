"""Program and certificate → the files of generated/NAME/."""

import json
from collections.abc import Collection, Mapping, Sequence
from typing import Any

from codegen.base.files import sha256
from codegen.base.text import render
from codegen.emit import ALWAYS, PRINTERS
from codegen.emit.header import Header, make_header, manifest_text
from codegen.emit.writer import entries
from codegen.program import Program
from codegen.program.lower import lower
from codegen.program.model import LARGEST


def emit_sources(program: Program, header: Header, targets: Sequence[str] = ALWAYS) -> dict[str, str]:
    """The sources of every target, by file name."""
    code = lower(program)
    return {name: text for target in targets for name, text in PRINTERS[target](program, code, header).items()}


def proof_lines(name: str, proof: str) -> str:
    """The README's lines on the proof of a region of the envelope, from the text of its file."""
    return render("text/proof_lines.j2", name=name, content=json.loads(proof))


def emit_readme(
    program: Program,
    header: Header,
    certificate: Any,
    files: Sequence[str],
    proofs: Mapping[str, str] | None = None,
    kernel: bool = False,
    bounds: Sequence[Any] = (),
    regions: Collection[str] = (),
) -> str:
    """The README.md of generated/NAME/: its files, how to call the code, and what is certified.

    Args:
        certificate: a dict, or the reason of a refusal.
        files: names of those in the same folder.
        kernel: whether the kernel's proof of the C is among the files.
        bounds: on each friction error, as proved of the C.
        regions: which of the proofs are of a region of the envelope.
    """
    proofs = proofs or {}
    refused = certificate if isinstance(certificate, str) else None
    return render(
        "text/generated_readme.md.j2",
        program=program,
        inputs=entries(program, "inputs"),
        outputs=entries(program, "outputs"),
        header=header,
        certificate=certificate,
        refused=refused,
        files=files,
        proofs=proofs,
        kernel=kernel,
        bounds=bounds,
        proved="".join(proof_lines(name, text) for name, text in proofs.items() if name in regions),
        largest=f"{LARGEST[program.precision]:.0e}",
    )


def emit_manifest(header: Header, files: dict[str, str], not_made: Mapping[str, str] | None = None) -> str:
    """The manifest.json: hashes of the spec, of every generated file, and of the manifest itself.

    ``not_made``: file of a proof that does not exist → why, which ``stiction verify`` prints.
    """
    robot = {"robot": {"file": header.robot[0].raw, "sha256": header.robot[1]}} if header.robot else {}
    content = {
        "tool": {"name": "stiction", "version": header.version, "command": header.command.raw},
        "spec": {"file": header.spec_file.raw, "sha256": header.spec_sha256},
        **robot,
        "files": {name: sha256(text) for name, text in sorted(files.items())},
        **({"not_made": dict(not_made)} if not_made else {}),
    }
    return manifest_text(content)


__all__ = ["Header", "emit_manifest", "emit_readme", "emit_sources", "make_header", "proof_lines"]
