"""Laws in state-space form: λ = force(u, z), dz/dt = rates(u, z)."""

from typing import ClassVar

import sympy

from codegen.friction.law import DynamicLaw, LawParameter, LawState, Ranges, States, Values
from codegen.friction.zero_memory import ExtendedCoulomb, gaussian_slope
from codegen.spec.functions import Magnitude, Sgn

PRESLIDING = LawParameter(
    "c", "1/{q}", True, "inverse of the presliding distance; the hysteresis is the wider the smaller c"
)


class _Normalized(DynamicLaw):
    """A law λ = a f with a normalized friction force f, |f| ≤ 1, and a constant level a."""

    states = (LawState("f", "1", "normalized friction force"),)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return p[self.scale] * z[0]

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """[−1, 1]: at |f| = 1, f' is zero or directed inwards."""
        return ((sympy.Integer(-1), sympy.Integer(1)),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p[self.scale]


class Dahl(_Normalized):
    """F = a f, f' = c u |1 − f sgn(u)|^i sgn(1 − f sgn(u)), (1.1), (1.2) and (6.6) with φ = sgn.

    For i ≥ 1 the level is approached but never reached; for i < 1 it is reached in finite slip, and ∂ξ/∂f is unbounded
    there.
    """

    name = "dahl"
    source = "Dahl 1976; Mentzelopoulou 1994, (1.1) and (6.6)"
    parameters = (
        LawParameter("a", "{F}", False, "Coulomb level"),
        PRESLIDING,
        LawParameter("i", "1", False, "exponent of the presliding curve", default=1),
    )
    scale = "a"

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        gap = 1 - z[0] * Sgn(u)
        odd = p["i"].is_Integer and p["i"] % 2 == 1  # then |gap|^i sgn(gap) is gap^i, with its slope at a gap of zero
        power = gap ** p["i"] if odd else Magnitude(gap) ** p["i"] * Sgn(gap)
        return (p["c"] * u * power,)

    def bristles(self, p: Values) -> tuple[sympy.Expr, sympy.Expr] | None:
        """With the exponent 1, z = f/c: z' = u − |u| c z."""
        return (p["a"] * p["c"], sympy.Integer(0)) if p["i"] == 1 else None


class ResetIntegrator(_Normalized):
    """F = a f, f' = c [u − φ⁻¹(f)], (6.5), φ⁻¹ piecewise linear: slope D2 for |f| < 1, D1 beyond, (6.33).

    The thesis prints φ⁻¹(v) in chapter 1; (6.5) has φ⁻¹(f), which alone has the dimension and the limit. As
    φ⁻¹(f) = D2 f + (D1 − D2) dz(f) with the dead zone dz(f) = f − (|f + 1| − |f − 1|)/2, no case distinction is needed.
    """

    name = "reset_integrator"
    source = "Haessig and Friedland 1991; Mentzelopoulou 1994, (6.5) and (6.33)"
    parameters = (
        LawParameter("a", "{F}", False, "Coulomb level"),
        PRESLIDING,
        LawParameter("D1", "{q}/s", True, "slope of φ⁻¹ beyond the level", default=1000),
        LawParameter("D2", "{q}/s", True, "slope of φ⁻¹ within the level: the creep speed at it", default="0.0001"),
    )
    scale = "a"

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        f = z[0]
        dead_zone = f - (Magnitude(f + 1) - Magnitude(f - 1)) / 2
        return (p["c"] * (u - p["D2"] * f - (p["D1"] - p["D2"]) * dead_zone),)

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """±φ(top speed), where f' = c (u ∓ top speed) is directed inwards, since φ⁻¹ is monotone."""
        limit = _phi(top_speed, p)
        return ((-limit, limit),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["a"] * _phi(slip_speed, p)

    def in_sliding(self, p: Values) -> tuple[sympy.Expr, sympy.Expr] | None:
        """Above D2, f > 1 and f'' = c (u' − D1 f'), so that |f'| settles below |u'|/D1 with the rate c D1."""
        return p["D2"], p["a"] / p["D1"]

    def slope_bound(self, p: Values) -> sympy.Expr:
        return p["a"] * sympy.Max(1 / p["D1"], 1 / p["D2"])


def _phi(speed: sympy.Expr, p: Values) -> sympy.Expr:
    """φ for speed ≥ 0: speed/D2 up to D2, then 1 + (speed − D2)/D1."""
    below = (Magnitude(speed - p["D2"]) - (speed - p["D2"])) / 2
    return 1 + (speed - p["D2"]) / p["D1"] - below * (1 / p["D2"] - 1 / p["D1"])


class LuGre(DynamicLaw):
    """F = σ0 z + σ1 z' + σ2 u, z' = u − |u| z/g(u), σ0 g(u) = F_c + (F_s − F_c) exp(−(u/v_s)²)."""

    name = "lugre"
    source = "Canudas de Wit, Olsson, Åström and Lischinsky 1993; Mentzelopoulou 1994, section 1.1.2.2"
    parameters = (
        LawParameter("sigma_0", "{F}/{q}", True, "bristle stiffness"),
        LawParameter("sigma_1", "{F}*s/{q}", False, "bristle damping"),
        LawParameter("sigma_2", "{F}*s/{q}", False, "viscous slope"),
        LawParameter("F_c", "{F}", True, "Coulomb level"),
        LawParameter("F_s", "{F}", True, "static level"),
        LawParameter("v_s", "{q}/s", True, "Stribeck velocity"),
    )
    states = (LawState("z", "{q}", "mean deflection of the bristles"),)

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        return (u - p["sigma_0"] * Magnitude(u) * z[0] / _stribeck(u, p),)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return p["sigma_0"] * z[0] + p["sigma_1"] * self.rates(u, z, p)[0] + p["sigma_2"] * u

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """±max g, where z' = u − |u| z/g(u) is zero or directed inwards for any u."""
        limit = sympy.Max(p["F_c"], p["F_s"]) / p["sigma_0"]
        return ((-limit, limit),)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return _stribeck(slip_speed, p) + p["sigma_2"] * slip_speed

    def bristles(self, p: Values) -> tuple[sympy.Expr, sympy.Expr] | None:
        return p["sigma_0"], p["sigma_1"]

    def slope_bound(self, p: Values) -> sympy.Expr:
        """The slope of the level is extreme at standstill and where the Gaussian is steepest, at v_s/√2."""
        steepest = gaussian_slope(1 / sympy.sqrt(2), p["v_s"]) * (p["F_s"] - p["F_c"])
        return sympy.Max(abs(p["sigma_2"]), abs(p["sigma_2"] - steepest))


def _stribeck(speed: sympy.Expr, p: Values) -> sympy.Expr:
    """σ0 g: the level of steady sliding without its viscous part."""
    return p["F_c"] + (p["F_s"] - p["F_c"]) * sympy.exp(-((speed / p["v_s"]) ** 2))


class Walrath(_Normalized):
    """τ F' = −F + T sgn(u), here with F = T f: f' = (sgn(u) − f)/τ."""

    name = "walrath"
    source = "Walrath 1984; Mentzelopoulou 1994, section 1.1.2.2"
    parameters = (
        LawParameter("T", "{F}", False, "rolling friction level"),
        LawParameter("tau", "s", True, "time constant"),
    )
    scale = "T"

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        return ((Sgn(u) - z[0]) / p["tau"],)


_LEVEL = ExtendedCoulomb()


class ExtendedDynamic(_Normalized):
    """F = (a1 + a2 exp(−a3 |u|) + a4 |u|) f, (A.76), f' = ξ(u, f) of Dahl's law, (6.6).

    (A.73) leaves ξ open; ``extended_reset_integrator`` has (6.5) in its place.
    """

    name = "extended_dynamic"
    source = "Mentzelopoulou 1994, (A.71), (A.75) and (A.76)"
    parameters: ClassVar[tuple[LawParameter, ...]] = (*ExtendedCoulomb.parameters, *Dahl.parameters[1:])
    carrier: ClassVar[DynamicLaw] = Dahl()

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        return self.carrier.rates(u, z, p)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return _LEVEL.level(Magnitude(u), p) * z[0]

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        return self.carrier.state_range(top_speed, p)

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return _LEVEL.level(slip_speed, p) * self.carrier.level(slip_speed, {**p, "a": sympy.Integer(1)})

    def slope_bound(self, p: Values) -> sympy.Expr:
        """In steady sliding f = sgn(u), so Lemma 2.1 applies unchanged."""
        return _LEVEL.slope_bound(p)


class ExtendedResetIntegrator(ExtendedDynamic):
    """F = (a1 + a2 exp(−a3 |u|) + a4 |u|) f, (A.76), f' = c [u − φ⁻¹(f)], (6.5) and (6.33)."""

    name = "extended_reset_integrator"
    source = "Mentzelopoulou 1994, (6.5), (6.33), (A.71) and (A.76)"
    parameters = (*ExtendedCoulomb.parameters, *ResetIntegrator.parameters[1:])
    carrier = ResetIntegrator()

    def slope_bound(self, p: Values) -> sympy.Expr:
        """None in general: f = φ(u) grows with u, and a4 |u| φ(|u|) quadratically."""
        return sympy.oo


class _RateAndState(DynamicLaw):
    """A rate-and-state law of rock friction, λ = [F_0 + a ln(|u|/v_0) + …] sgn(u).

    In steady sliding the level is F_0 + (a − b) ln(|u|/v_0).
    """

    parameters = (
        LawParameter("F_0", "{F}", False, "level of steady sliding at v_0"),
        LawParameter("a", "{F}", False, "direct effect of the rate"),
        LawParameter("b", "{F}", False, "effect of the state"),
        LawParameter("L", "{q}", True, "characteristic slip"),
        LawParameter("v_0", "{q}/s", True, "reference velocity"),
    )
    drives = ""
    why_not = "ln(|u|/v_0) diverges at u = 0: the law has no force at standstill and through a reversal"
    instead = "lugre or tustin"

    def level(self, slip_speed: sympy.Expr, p: Values) -> sympy.Expr:
        return p["F_0"] + (p["a"] - p["b"]) * sympy.log(slip_speed / p["v_0"])

    def slope_bound(self, p: Values) -> sympy.Expr:
        """(a − b)/|u| has no bound."""
        return sympy.Piecewise((sympy.Integer(0), sympy.Eq(p["a"], p["b"])), (sympy.oo, True))


class Ruina(_RateAndState):
    """F = [F_0 + a ln(|u|/v_0) + f] sgn(u), f' = −(|u|/L) [f + b ln(|u|/v_0)].

    The source has it for u > 0; here for both directions, and not regularised.
    """

    name = "ruina"
    source = "Ruina 1980; Mentzelopoulou 1994, section 1.1.2.2"
    states = (LawState("f", "{F}", "force of the state"),)

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        speed = Magnitude(u)
        return (-speed / p["L"] * (z[0] + p["b"] * sympy.log(speed / p["v_0"])),)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        return (p["F_0"] + p["a"] * sympy.log(Magnitude(u) / p["v_0"]) + z[0]) * Sgn(u)

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """f follows −b ln(|u|/v_0), which is lowest at the top speed and has no upper bound."""
        return ((-p["b"] * sympy.log(sympy.Max(top_speed, p["v_0"]) / p["v_0"]), sympy.oo),)


class LinkerDieterich(_RateAndState):
    """F = [F_0 + a ln(|u|/v_0) + b ln(θ v_0/L)] sgn(u), θ' = 1 − |u| θ/L, under a constant normal load.

    The source adds −α θ N'/(b N) to θ' for a normal load N that varies; a contact of a spec has a constant one, and
    F_0, a and b are the source's coefficients times it. Not regularised.
    """

    name = "linker_dieterich"
    source = "Linker and Dieterich 1992; Mentzelopoulou 1994, section 1.1.2.2 (in words)"
    states = (LawState("theta", "s", "age of the contacts"),)

    def rates(self, u: sympy.Expr, z: States, p: Values) -> States:
        return (1 - Magnitude(u) * z[0] / p["L"],)

    def force(self, u: sympy.Expr, z: States, p: Values) -> sympy.Expr:
        rate = p["a"] * sympy.log(Magnitude(u) / p["v_0"])
        return (p["F_0"] + rate + p["b"] * sympy.log(z[0] * p["v_0"] / p["L"])) * Sgn(u)

    def state_range(self, top_speed: sympy.Expr, p: Values) -> Ranges:
        """θ follows L/|u|, which is lowest at the top speed; at rest it grows without bound."""
        return ((p["L"] / sympy.Max(top_speed, p["v_0"]), sympy.oo),)

    def rest_state(self, p: Values) -> States:
        """The age in steady sliding at v_0: at rest it has no stationary value."""
        return (p["L"] / p["v_0"],)
