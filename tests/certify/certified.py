"""Certificates of small specs, and what they say in floating point, written from docs/certificate_format.md."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from codegen.analysis.analysis import Analysis, analyse
from codegen.certify.certify import Certificate, Refusal, certify
from codegen.effects.declare import add_declared_effects
from codegen.mechanics import build_system
from codegen.observers import build_observer
from codegen.spec import parse_spec
from tests.machines import TEXTS, bare_machine

COMMAND = "stiction generate x.yaml"


def analysis_of(name: str, observer: str, envelope: str = "{}", effects: str = "[]") -> tuple[Any, Analysis]:
    """A machine's spec and analysis."""
    text = TEXTS[name] + f"observer: {observer}\nenvelope: {envelope}\neffects: {effects}\n"
    spec = parse_spec(text, Path(f"{name}.yaml"))
    system = bare_machine(name) if effects == "[]" else add_declared_effects(build_system(spec), spec)
    return spec, analyse(spec, build_observer(spec, system))


def outcome(name: str, observer: str, envelope: str = "{}", effects: str = "[]") -> Certificate | Refusal:
    spec, analysis = analysis_of(name, observer, envelope, effects)
    return certify(spec, analysis, {"a.c": "0" * 64}, COMMAND)


def value(expression: Any, at: Mapping[str, float]) -> float:
    """A prefix expression in floating point."""
    if isinstance(expression, str):
        return at[expression] if expression[0].isalpha() else float(Fraction(expression))
    op, *rest = expression
    if op == "^":
        return value(rest[0], at) ** int(rest[1])
    a = [value(r, at) for r in rest]
    one = {"neg": lambda z: -z, "sin": math.sin, "cos": math.cos, "exp": math.exp, "abs": abs, "sqrt": math.sqrt}
    match op:
        case "+":
            return sum(a)
        case "*":
            return math.prod(a)
        case "/":
            return a[0] / a[1]
    return one[op](a[0])


def step_matrix(content: Mapping[str, Any], at: Mapping[str, float]) -> Any:
    """I + hA at a point of the certificate's variables."""
    theta = {p["name"]: value(p["expression"], at) for p in content["parameters"]}
    a = np.array([[value(e, theta) for e in row] for row in content["matrix"]])
    return np.eye(len(a)) + float(Fraction(content["sample_time"])) * a


def lyapunov(content: Mapping[str, Any]) -> Any:
    return np.array([[float(Fraction(e)) for e in row] for row in content["lyapunov_matrix"]])


def fall(content: Mapping[str, Any]) -> float:
    """1 − 2αh."""
    return float(1 - 2 * Fraction(content["decay_rate"]) * Fraction(content["sample_time"]))


def worst_fall(content: Mapping[str, Any], points: list[dict[str, float]]) -> float:
    """The largest V(Φe)/V(e) over all e, at the worst of the points."""
    root = np.linalg.cholesky(lyapunov(content)).T
    inverse = np.linalg.inv(root)
    return max(np.linalg.norm(root @ step_matrix(content, at) @ inverse, 2) ** 2 for at in points)
