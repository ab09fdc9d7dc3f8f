"""Plants whose contacts have laws with states: against SciPy's stiff integrator, closed forms, energy, order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from codegen.base.errors import BadInput
from codegen.diagnosis.fit.measure import free_run
from codegen.friction import LAWS, MemoryLaw
from codegen.simulate.closed_loop import simulate
from codegen.simulate.plant import Plant
from tests.machines import SPRING_MASS, TWO_SPRINGS, read_machine, two_mass
from tests.simulate.open_loop import free_run_from_rest, simulate_open_loop
from tests.slow_cases import slow_except

from . import stiff_integrator as exact

COULOMB = "law: coulomb, a: {a}"
DAMPED = "effects: [{kind: viscous, on: rail, parameters: {b: 50}}]\n"
EXTENDED = "a1: 2, a2: 1, a3: 5, a4: 0.5, c: 200"


def extended_level(speed: float) -> float:
    return 2 + np.exp(-5 * speed) + 0.5 * speed


SMOOTH = {
    "law: dahl, a: 3, c: 200": exact.dahl(3, 200),
    "law: dahl, a: 3, c: 200, i: 2": exact.dahl(3, 200, 2),
    "law: dahl, a: 3, c: 200, i: 1.5": exact.dahl(3, 200, 1.5),
    "law: reset_integrator, a: 3, c: 100": exact.reset_integrator(3, 100, 1000, 1e-4),
    "law: reset_integrator, a: 3, c: 1, D1: 100, D2: 0.1": exact.reset_integrator(3, 1, 100, 0.1),
    "law: lugre, sigma_0: 1e5, sigma_1: 300, sigma_2: 0.4, F_c: 2, F_s: 3, v_s: 0.01": exact.lugre(
        1e5, 300, 0.4, 2, 3, 0.01
    ),
    "law: lugre, sigma_0: 1e4, sigma_1: 100, sigma_2: 0.4, F_c: 2, F_s: 3, v_s: 0.1": exact.lugre(
        1e4, 100, 0.4, 2, 3, 0.1
    ),
    f"law: extended_dynamic, {EXTENDED}": exact.extended(extended_level, exact.dahl(1, 200)),
    f"law: extended_reset_integrator, {EXTENDED}, D1: 1000, D2: 0.001": exact.extended(
        extended_level, exact.reset_integrator(1, 200, 1000, 1e-3)
    ),
}
TIME = np.arange(0, 2, 0.01)
COMMAND = 6 * np.sin(3 * TIME) + 2 * np.sin(7.7 * TIME)
STILL = np.zeros(1)
RUN = {n for n, one in LAWS.items() if not isinstance(one, MemoryLaw)} - {"ruina", "linker_dieterich"} | {"karnopp"}


def sliding(law: str, m: float = 2, k: float = 20, more: str = ""):
    """The mass of ``SPRING_MASS`` on another law."""
    return read_machine(SPRING_MASS.replace(COULOMB, law).format(m=m, k=k, b=0) + more)


def run(system, time, w, substeps: int, **start):
    return simulate_open_loop(system, time, np.reshape(w, (-1, 1)), STILL, STILL, substeps, **start)


@pytest.mark.parametrize("law", slow_except(list(SMOOTH), list(SMOOTH)[::2]))
def test_law_follows_radau(law: str):
    path = exact.integrate(SMOOTH[law], 2, 20, TIME, COMMAND, np.zeros(3))
    assert np.max(np.abs(path[:, 1])) > 0.2
    assert np.min(np.diff(np.sign(path[:, 1]))) < 0
    system = sliding(law)[1]
    x, v = run(system, TIME, COMMAND, 100)
    assert np.max(np.abs(x[:, 0] - path[:, 0])) < 1e-7
    predicted = free_run_from_rest(system, TIME, COMMAND[:, None], 100)[:, 0]
    assert np.max(np.abs(predicted - path[:, 0])) < 2e-7
    assert np.max(np.abs(v[:, 0] - path[:, 1])) < 5e-7


def test_lugre_with_bristles_of_ten_million_newton_a_metre_follows_radau():
    law = "law: lugre, sigma_0: 1e7, sigma_1: 3000, sigma_2: 0.4, F_c: 2, F_s: 3, v_s: 0.01"
    time = np.arange(0, 1, 0.01)
    w = 6 * np.sin(6 * time) + 2 * np.sin(7.7 * time)
    path = exact.integrate(exact.lugre(1e7, 3000, 0.4, 2, 3, 0.01), 2, 20, time, w, np.zeros(3))
    x, v = run(sliding(law)[1], time, w, 100)
    assert np.max(np.abs(x[:, 0] - path[:, 0])) < 1e-7
    assert np.max(np.abs(v[:, 0] - path[:, 1])) < 5e-7
    assert np.max(np.abs(path[:, 1])) > 0.2


def test_dahl_with_an_exponent_below_one_gains_what_the_push_leaves():
    # i = 1/2: √(1 − f) = 1 − c x/2 up to x = 2/c, where f = 1 is reached; so m v²/2 = w x − a ∫f dx in closed form.
    a, c, m, w = 3.0, 200.0, 2.0, 3.5
    _, system = sliding(f"law: dahl, a: {a}, c: {c}, i: 0.5", m=m, k=0)
    time = np.arange(0, 0.6, 0.002)
    x, v = run(system, time, np.full(len(time), w), 100)
    x, v = x[:, 0], v[:, 0]
    assert np.sum((x > 1e-4) & (x < 2 / c)) > 20 and x[-1] > 3 / c
    area = x - 2 / (3 * c) * (1 - np.maximum(1 - c * x / 2, 0) ** 3)
    gained = w * x - a * area
    assert np.max(np.abs(m * v**2 / 2 - gained)) < 1e-5 * np.max(gained)


def test_walrath_switches_and_is_first_order():
    # Its rate jumps at u = 0: the step of a reversal has an error of its own order, which no smooth scheme avoids.
    path = exact.integrate(exact.walrath(3, 0.02), 2, 20, TIME, COMMAND, np.zeros(3))
    x, v = run(sliding("law: walrath, T: 3, tau: 0.02")[1], TIME, COMMAND, 100)
    assert np.max(np.abs(x[:, 0] - path[:, 0])) < 1e-3
    assert np.max(np.abs(v[:, 0] - path[:, 1])) < 3e-3


SECOND_ORDER = ["law: dahl, a: 3, c: 200", "law: reset_integrator, a: 3, c: 100", list(SMOOTH)[6]]


@pytest.mark.parametrize("law", slow_except(SECOND_ORDER, SECOND_ORDER[:1]), ids=lambda s: s[5:10])
def test_error_falls_with_the_square_of_the_substep(law: str):
    path = exact.integrate(SMOOTH[law], 2, 20, TIME, COMMAND, np.zeros(3))
    _, system = sliding(law)
    errors = [np.max(np.abs(run(system, TIME, COMMAND, n)[0][:, 0] - path[:, 0])) for n in (10, 160)]
    assert errors[0] / errors[1] > 16**2 / 3
    assert errors[0] < 1e-5


def test_stiffness_far_above_the_substep_is_stable():
    # c D1 = 1e5 1/s; substeps of 2.5 ms, at which explicit Euler would need rates below 800 1/s.
    law = "law: reset_integrator, a: 50, c: 100"
    time = np.arange(0, 2, 0.01)
    x, v = run(sliding(law, m=1, k=0)[1], time, np.full(200, 70.0), 4)
    assert v[-1, 0] == pytest.approx(20 * time[-1], rel=0.05)
    assert np.all(np.diff(v[5:, 0]) > 0)
    fine = run(sliding(law, m=1, k=0)[1], time, np.full(200, 70.0), 400)
    assert np.max(np.abs(x - fine[0])) < 1e-4 * np.max(x)


def test_presliding_gives_back_what_it_stored():
    # A Dahl contact near rest is a spring of stiffness a c: the mass swings, and slips little.
    a, c, m = 3.0, 200.0, 2.0
    _, system = sliding(f"law: dahl, a: {a}, c: {c}", m=m, k=0)
    time = np.arange(0, 0.5, 0.001)
    small = 1e-7
    x, _ = simulate_open_loop(system, time, np.zeros((500, 1)), STILL, np.full(1, small), 20)
    omega = np.sqrt(a * c / m)
    assert np.max(np.abs(x[:, 0] - small / omega * np.sin(omega * time))) < 1e-3 * small / omega


@pytest.mark.parametrize("law", slow_except(list(SMOOTH)[:7], list(SMOOTH)[2:7:2]), ids=lambda s: s[5:])
def test_no_law_creates_energy_over_a_closed_loop_of_slip(law: str):
    spec, system = sliding(law, more="simulation: {duration: 3, sample_time: 1e-4, inputs: {w: 8*sin(4*t)}}")
    log = simulate(spec, system)
    x, v, force = log.true_positions[:, 0], log.true_velocities[:, 0], log.contact_forces[:, 0]
    energy = v**2 + 10 * x**2
    lost = np.cumsum(force[:-1] * np.diff(x))
    work = np.cumsum(log.inputs[:-1, 0] * np.diff(x))
    assert np.max(np.abs(energy[1:] - work + lost)) < 2e-3 * lost[-1]
    # From one turn to the next at the same state of the spring, friction only takes.
    turns = np.flatnonzero(np.diff(np.sign(v)) < 0)
    assert np.all(np.diff(lost[turns[1:]]) > 0)


@pytest.mark.parametrize(("exponent", "slope"), [(1, 1.5), (2, 1.5)])
def test_dahl_holds_a_mass_on_a_slope_where_its_spring_balances(exponent: int, slope: float):
    # f(x) = 1 − exp(−c x) for i = 1 and 1 − 1/(1 + c x) for i = 2: no creep, since f' = 0 at u = 0.
    a, c = 3.0, 200.0
    _, system = sliding(f"law: dahl, a: {a}, c: {c}, i: {exponent}", k=0, more=DAMPED)
    time = np.arange(0, 4, 0.01)
    x, v = run(system, time, np.minimum(time, 1) * slope, 20)
    share = slope / a
    where = -np.log(1 - share) / c if exponent == 1 else share / (1 - share) / c
    assert x[-1, 0] == pytest.approx(where, rel=2e-3)
    assert np.max(np.abs(v[-50:, 0])) < 1e-6


def test_reset_integrator_creeps_on_a_slope_at_the_speed_its_law_says():
    # In balance f = w/a, and f' = 0 at u = D2 f: 1.5 N against 3 N creep at D2/2.
    _, system = sliding("law: reset_integrator, a: 3, c: 100, D2: 0.01", k=0)
    time = np.arange(0, 20, 0.01)
    _, v = run(system, time, np.full(len(time), 1.5), 20)
    assert v[-1, 0] == pytest.approx(0.005, rel=1e-3)


def test_steady_sliding_has_the_level_of_the_law():
    _, system = sliding(list(SMOOTH)[6], k=0)
    plant = Plant(system, 50)
    state = plant.start(STILL, np.full(1, 1.0))
    state[-1] = 2 / 1e4
    force = plant.sample(state, np.array([0, 2e-4, *[2.4] * 50]))[1]
    assert float(force) == pytest.approx(2.4, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("contact", [0, 1])
def test_one_contact_set_valued_and_another_with_a_state(contact: int):
    # The stiffer the Dahl contact, the closer to the machine with two Coulomb contacts: its gap falls as 1/√c.
    time = np.arange(0, 2, 0.01)
    w = 14 * np.sin(4 * time)[:, None]
    rigid = simulate_open_loop(two_mass()[1], time, w, np.zeros(2), np.zeros(2), 200)[0]
    declared, level = (("a: {between}", 2), ("a: {ground}", 5))[contact]
    gaps = []
    for c in ("1e4", "1e6"):
        text = TWO_SPRINGS.replace(f"law: coulomb, {declared}", f"law: dahl, c: {c}, a: {level}")
        _, mixed = read_machine(text.format(between=2, ground=5))
        gaps.append(np.max(np.abs(simulate_open_loop(mixed, time, w, np.zeros(2), np.zeros(2), 200)[0] - rigid)))
    assert gaps[0] / gaps[1] == pytest.approx(10, rel=0.05)
    assert gaps[1] < 1e-3


def test_mixed_machine_follows_radau():
    _, mixed = read_machine(
        TWO_SPRINGS.replace("law: coulomb, a: {between}", "law: dahl, a: 2, c: 300").format(ground=5)
    )
    time = np.arange(0, 1.0, 0.01)
    w = 14 * np.sin(4 * time)

    def rate(_, y, w):
        u = y[2] - y[3]
        between, ground = 2 * y[4], 5 * np.tanh(y[3] / 1e-6)
        return [y[2], y[3], -40 * y[0] - between, (w - 60 * y[1] + between - ground) / 2, 300 * (u - abs(u) * y[4])]

    path = [np.zeros(5)]
    for j in range(len(time) - 1):
        solved = solve_ivp(rate, (time[j], time[j + 1]), path[-1], "Radau", args=(w[j],), rtol=1e-8, atol=1e-11)
        path.append(solved.y[:, -1])
    x, v = simulate_open_loop(mixed, time, w[:, None], np.zeros(2), np.zeros(2), 100)
    assert np.max(np.abs(x - np.array(path)[:, :2])) < 2e-5
    assert np.max(np.abs(v - np.array(path)[:, 2:4])) < 5e-4


ADDED = {
    "kind: viscous, on: rail, parameters: {b: 2.5}": lambda u: 2.5 * u,
    "kind: coulomb_asymmetry, on: rail, parameters: {d: 0.7}": lambda u: 0.7,
    "kind: stribeck, on: rail, parameters: {delta: 1.5, v_s: 0.2}": lambda u: (
        np.tanh(u / 1e-6) * 1.5 * np.exp(-((u / 0.2) ** 2))
    ),
}


@pytest.mark.parametrize("share", slow_except([0.7, 1], [0.7]))
@pytest.mark.parametrize("effect", ADDED, ids=lambda words: words.split(",")[0][6:])
def test_declared_effects_on_a_law_with_states(effect: str, share: float):
    # Viscous friction adds b u; a Stribeck effect adds its set-valued level beside the law's own force.
    law = "law: dahl, a: 3, c: 200"
    base = exact.dahl(3, 200)
    count = round(share * len(TIME))  # in make test through its first reversal
    time, command = TIME[:count], COMMAND[:count]

    def whole(u, f):
        force, rate = base(u, f)
        return force + ADDED[effect](u), rate

    path = exact.integrate(whole, 2, 20, time, command, np.zeros(3))
    x, v = run(sliding(law, more=f"effects: [{{{effect}}}]")[1], time, command, 100)
    assert np.max(np.abs(x[:, 0] - path[:, 0])) < 5e-6
    assert np.min(v) < -0.05 and np.max(v) > 0.05


@pytest.mark.parametrize("law", ["static_viscous", "karnopp"])
def test_static_level_holds_and_lets_go(law: str):
    band = ", D_v: 0.001" if law == "karnopp" else ""
    _, system = sliding(f"law: {law}, F_c: 2, F_s: 3, F_v: 0.5{band}", k=0)
    time = np.arange(0, 3, 0.01)
    x, v = run(system, time, time + 1.5, 10)
    assert np.all(x[time <= 1.505] == 0)
    last = 1 - np.exp(-(time[-1] - 1.51) / 4)
    assert v[-1, 0] > 0.3 * last
    slow, speed = run(system, time, np.full(300, 2.5), 10)
    assert np.all(slow == 0) and np.all(speed == 0)
    moving = simulate_open_loop(system, time, np.full((300, 1), 2.5), STILL, np.full(1, 0.2), 10)[1][:, 0]
    assert moving == pytest.approx(1 - 0.8 * np.exp(-time / 4), abs=1e-5)


def test_free_run_takes_up_the_states_of_the_log():
    _, system = sliding("law: dahl, a: 3, c: 20")
    time = np.arange(0, 3, 0.002)
    w = 8 * np.sin(4 * time)
    x, v = run(system, time, w, 10)
    error = np.max(np.abs(free_run(system, 0.002, x, v, w[:, None], restart_s=0.3) - x))
    assert error < 2e-5
    assert np.max(np.abs(free_run(sliding("law: coulomb, a: 3")[1], 0.002, x, v, w[:, None], 0.3) - x)) > 50 * error


@pytest.mark.parametrize("law", [name for name in LAWS if name not in RUN])
def test_law_that_no_plant_runs_is_refused_at_its_line_and_free_run_takes_its_steady_level(law: str):
    words = f"law: {law}" + "".join(f", {p.name}: {20 if p.name == 'N' else 1}" for p in LAWS[law].parameters)
    spec, system = sliding(words, more="simulation: {duration: 1, sample_time: 0.01}")
    with pytest.raises(
        BadInput, match=rf"machine.yaml:\d+: friction.contacts\[0\].law: the law {law} at rail .* such as"
    ):
        simulate(spec, system)
    time = np.arange(0, 1, 0.01)
    x, v = 0.1 * np.sin(5 * time)[:, None], 0.5 * np.cos(5 * time)[:, None]
    assert np.all(np.isfinite(free_run(system, 0.01, x, v, np.sin(time)[:, None])))


@pytest.mark.parametrize("law", sorted(RUN))
def test_every_other_law_is_simulated(law: str):
    values = {"D2": 0.1, "c": 100, "sigma_0": 1e4, "tau": 0.1, "i": 1}
    words = f"law: {law}" + "".join(f", {p.name}: {values.get(p.name, 1)}" for p in LAWS[law].parameters)
    log = simulate(*sliding(words, more="simulation: {duration: 1, sample_time: 0.01, inputs: {w: 20*sin(9*t)}}"))
    assert np.all(np.isfinite(log.contact_forces)) and np.max(np.abs(log.contact_forces)) > 0.5


def test_same_log_twice():
    spec, system = sliding("law: dahl, a: 3, c: 200", more="simulation: {duration: 1, sample_time: 0.01}")
    first, second = simulate(spec, system), simulate(spec, system)
    for name in ("positions", "contact_forces", "true_velocities"):
        assert np.array_equal(getattr(first, name), getattr(second, name))


def test_laws_of_zero_memory_are_as_they_were():
    _, system = two_mass()
    assert Plant(system).state_size == 6
