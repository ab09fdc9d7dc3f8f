"""The verbs as functions: each takes files, walks the line as far as it must, and returns a typed result.

A verb's module, with the libraries that it needs, is imported when the verb is first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from codegen.base.errors import BadInput
from codegen.base.lazy import lazily

if TYPE_CHECKING:
    from codegen.app.cancel import CancelReport, cancel
    from codegen.app.certify import Certified, certify, certify_in_full, write_certificate
    from codegen.app.check import check
    from codegen.app.derive import derive
    from codegen.app.diagnose import Diagnosed, diagnose
    from codegen.app.fmu import GeneratedFmu, generate_fmu
    from codegen.app.gains import GainReport, gains
    from codegen.app.generate import Generated, Overrides, generate
    from codegen.app.init import init
    from codegen.app.model import Model
    from codegen.app.replay import Replayed, replay
    from codegen.app.simulate import simulate
    from codegen.app.verify import verify
    from codegen.app.write_smt import write_smt
    from codegen.simulate.simulated import Simulated

VERBS = {
    "init": "codegen.app.init",
    "check": "codegen.app.check",
    "derive": "codegen.app.derive",
    "certify": "codegen.app.certify",
    "certify_in_full": "codegen.app.certify",
    "write_certificate": "codegen.app.certify",
    "verify": "codegen.app.verify",
    "write_smt": "codegen.app.write_smt",
    "generate": "codegen.app.generate",
    "generate_fmu": "codegen.app.fmu",
    "gains": "codegen.app.gains",
    "cancel": "codegen.app.cancel",
    "simulate": "codegen.app.simulate",
    "replay": "codegen.app.replay",
    "diagnose": "codegen.app.diagnose",
}
"""Function → its module."""
RESULTS = {
    "Model": "codegen.app.model",
    "Certified": "codegen.app.certify",
    "Generated": "codegen.app.generate",
    "Overrides": "codegen.app.generate",
    "GeneratedFmu": "codegen.app.fmu",
    "GainReport": "codegen.app.gains",
    "CancelReport": "codegen.app.cancel",
    "Simulated": "codegen.simulate.simulated",
    "Replayed": "codegen.app.replay",
    "Diagnosed": "codegen.app.diagnose",
}
"""What they return or take → its module."""
__getattr__ = lazily(__name__, VERBS | RESULTS)

__all__ = [
    "BadInput",
    "CancelReport",
    "Certified",
    "Diagnosed",
    "GainReport",
    "Generated",
    "GeneratedFmu",
    "Model",
    "Overrides",
    "Replayed",
    "Simulated",
    "cancel",
    "certify",
    "certify_in_full",
    "check",
    "derive",
    "diagnose",
    "gains",
    "generate",
    "generate_fmu",
    "init",
    "replay",
    "simulate",
    "verify",
    "write_certificate",
    "write_smt",
]
