"""``stiction gains`` as a user calls it: text, JSON, picture, the spec with the suggested numbers, refusals."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace

import matplotlib.image
import numpy as np
import pytest

import stiction as api
from codegen.app import gains as suggesting
from codegen.report.style import figure_bytes
from codegen.spec import read_spec
from tests.slow_cases import slow_except

from .command import SPECS, Result, contents, is_one_message, stiction

TWO_LEVELS = {"between": 10.0, "ground": 20.0}
FREE = "gains:\n    K_F: {free: [0.1, 1e4]}   # not known yet\n    K_v: {free: [1, 1e4]}"

pytestmark = pytest.mark.usefixtures("unrendered")


@pytest.fixture(scope="module")
def two_mass(tmp_path_factory: pytest.TempPathFactory) -> tuple[Result, Path]:
    """What ``stiction gains`` prints of the two masses, and the folder that it wrote."""
    folder = tmp_path_factory.mktemp("two_mass") / "a"
    result = stiction("gains", SPECS / "two_mass.yaml", "-o", folder)
    assert result.code == 0
    return result, folder


@pytest.fixture
def free(tmp_path: Path) -> Path:
    text = (SPECS / "one_mass.yaml").read_text()
    path = tmp_path / "free.yaml"
    path.write_text(text.replace("gains: {K_F: 10, K_v: 100}", FREE))
    return path


def test_a_free_gain_is_checked_but_not_certified_or_generated(free: Path, tmp_path: Path) -> None:
    checked = stiction("check", free)
    assert checked.code == 0
    rows = {line.split()[0]: line.split()[1:] for line in checked.out.splitlines() if "free," in line}
    assert rows == {"K_F": ["free,", "0.1", "to", "10000", "N*s/m"], "K_v": ["free,", "1", "to", "10000", "1/s"]}
    gains = json.loads(stiction("check", free, "--json").out)["observer"]["gains"]
    assert gains["K_F"] == {"free": [0.1, 10000], "unit": "N*s/m"} and set(gains) == {"K_F", "K_v"}
    for verb in (["certify"], ["generate", "-o", tmp_path / "out"]):
        result = stiction(verb[0], free, *verb[1:])
        assert is_one_message(result)
        assert "the gain `K_F` is free (0.1 to 10000)" in result.err
        assert f"stiction gains {free}" in result.err
        assert "free.yaml:23" in result.err or "free.yaml:24" in result.err
    assert not (tmp_path / "out").exists()


def test_a_free_gain_is_derived_as_its_symbol(free: Path, tmp_path: Path) -> None:
    """Psi and the conditions need no number; those that are printed are of the middle of the ranges, and say so."""
    chosen = tmp_path / "chosen.yaml"
    chosen.write_text(free.read_text().replace(FREE, "gains: {K_F: 31.622776601683793, K_v: 100}"))
    one, other = (json.loads(stiction("derive", path, "--json").out) for path in (free, chosen))
    assert one.pop("free_gains_taken") == {"K_F": pytest.approx(31.6228), "K_v": 100}
    assert other.pop("free_gains_taken") == {}
    for key in ("psi", "characteristic_polynomial", "sampled"):
        assert one[key] == other[key]
    words = stiction("derive", free).out
    assert "K_F = 31.6228 N*s/m, K_v = 100 1/s" in words and "At the spec's gains" not in words
    assert "At the spec's gains" in stiction("derive", chosen).out


def test_a_log_is_diagnosed_with_free_gains(free: Path, tmp_path: Path) -> None:
    """A diagnosis needs no gain; no code is generated, and the reason is said."""
    t = np.arange(4000) * 1e-3
    x = 0.3 * np.sin(3 * t) + 0.02 * np.sin(11 * t)
    force = -2.7 * np.sin(3 * t) - 2.42 * np.sin(11 * t) + 50 * np.sign(0.9 * np.cos(3 * t) + 0.22 * np.cos(11 * t))
    np.savetxt(tmp_path / "log.csv", np.column_stack([t, x, -force]), delimiter=",", header="t,x,w", comments="")
    done = stiction("diagnose", free, tmp_path / "log.csv", "-o", tmp_path / "out")
    assert "verdict: unfit" in done.out, done.err
    assert "the gain `K_F` is free (0.1 to 10000)" in done.out
    assert not (tmp_path / "out" / "generated").exists() and (tmp_path / "out" / "report.html").exists()


def test_the_suggested_spec_keeps_comments_and_is_certified(free: Path, tmp_path: Path) -> None:
    folder = tmp_path / "gains"
    result = stiction("gains", free, "-o", folder)
    assert result.code == 0
    assert "Suggested gains" in result.out
    assert "Why: " in result.out
    assert sorted(p.name for p in folder.iterdir()) == ["gains.json", "gains.png", "spec.yaml"]
    text = (folder / "spec.yaml").read_text()
    assert "not known yet; K_F suggested by stiction gains, was free 0.1 to 10000" in text
    assert "# the operating region for which the certificate speaks" in text
    suggested = json.loads((folder / "gains.json").read_text())["suggested"]["gains"]
    choice = read_spec(folder / "spec.yaml").observer
    assert choice is not None
    assert {k: float(v) for k, v in choice.gains.items()} == pytest.approx(suggested)
    assert stiction("certify", folder / "spec.yaml").code == 0


def test_the_same_call_replaces_its_files_by_the_same_bytes_and_a_picture_with_content(
    free: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("codegen.report.gain_map.figure_bytes", figure_bytes)
    folder = tmp_path / "gains"
    assert stiction("gains", free, "-o", folder).code == 0
    first = contents(folder)
    assert set(first) == {"gains.json", "gains.png", "spec.yaml"}
    assert stiction("gains", free, "-o", folder).code == 0
    assert contents(folder) == first
    picture = matplotlib.image.imread(folder / "gains.png")
    assert picture.shape[0] > 900
    assert len(set(map(tuple, picture[::8, ::8, :3].reshape(-1, 3).tolist()))) > 50


def test_gains_of_two_contacts_are_suggested_in_the_place_of_the_written_ones(two_mass: tuple[Result, Path]) -> None:
    assert "K_F suggested by stiction gains, was 500, 700" in (two_mass[1] / "spec.yaml").read_text()


def is_kept(folder: Path) -> None:
    """Gains that were suggested are suggested again, by the same rule, and the text of the spec is unchanged."""
    before = json.loads((folder / "gains.json").read_text("utf-8"))
    again = stiction("gains", folder / "spec.yaml", "-o", folder / "again")
    assert again.code == 0 and "these are the spec's own gains" in again.out
    assert (folder / "again" / "spec.yaml").read_bytes() == (folder / "spec.yaml").read_bytes()
    after = json.loads((folder / "again" / "gains.json").read_text("utf-8"))
    assert after["kept"] and not before["kept"] and after["suggested_divided_by"] == 1
    assert after["suggested"]["gains"] == pytest.approx(before["suggested"]["gains"], rel=1e-5)  # written in 6 digits
    bounds = [report["error_bounds"][-1]["bound"]["steady"] for report in (before, after)]
    assert bounds[1] == pytest.approx(bounds[0], rel=1e-4)


def test_what_was_suggested_for_two_masses_is_kept(two_mass: tuple[Result, Path]) -> None:
    """The ranges are those around the spec's gains: other ones each time, and so were the gains, with a worse bound."""
    is_kept(two_mass[1])


@pytest.mark.parametrize("name", slow_except(["rig", "emps"], ["rig"]))
def test_what_was_suggested_is_kept(name: str, tmp_path: Path) -> None:
    assert stiction("gains", SPECS / f"{name}.yaml", "-o", tmp_path).code == 0
    is_kept(tmp_path)


def test_a_suggested_spec_that_the_user_edited_or_wrote_is_not_replaced(free: Path, tmp_path: Path) -> None:
    folder = tmp_path / "gains"
    assert stiction("gains", free, "-o", folder).code == 0
    (folder / "spec.yaml").write_text((folder / "spec.yaml").read_text() + "# tried on the machine\n")
    before = contents(folder)
    told = stiction("gains", free, "-o", folder)
    assert is_one_message(told) and "[FILE008]" in told.err and "spec.yaml, edited" in told.err
    numbers = json.loads((folder / "gains.json").read_text())
    del numbers["files_sha256"]["spec.yaml"]  # as of a run that suggested none
    (folder / "gains.json").write_text(json.dumps(numbers))
    told = stiction("gains", free, "-o", folder)
    assert is_one_message(told) and "[FILE004]" in told.err and "spec.yaml, which no gains.json lists" in told.err
    assert {**contents(folder), "gains.json": b""} == {**before, "gains.json": b""}


def test_json_holds_grid_values_and_boundary(free: Path) -> None:
    report = json.loads(stiction("gains", free, "--json", "--over", "h", "K_v").out)
    assert report["format"] == "stiction-gains/1"
    assert set(report) == {
        *("format", "spec", "observer", "sample_time", "operating_points", "position_noise_rms"),
        *(
            "position_noise_given",
            "position_noise_from",
            "axes",
            "notes",
            "chosen",
            "suggested",
            "rule",
            "noise_bound",
            "gain_factor",
        ),
        *("gain_sets_tried", "infeasible", "outside", "map", "error_bounds", "no_error_bound"),
        *("kept", "suggested_divided_by"),
    }
    assert report["chosen"] is None
    assert report["infeasible"] is None
    plane = report["map"]
    assert (plane["x"]["name"], plane["y"]["name"]) == ("h", "K_v")
    size = (len(plane["x"]["values"]), len(plane["y"]["values"]))
    for key in ("spectral_radius", "decay_rate", "spectral_abscissa", "noise_share"):
        assert np.array(plane[key], dtype=float).shape == size
    assert set(plane["boundary"]) == {"sampled", "continuous"}
    assert all(len(vertex) == 2 for line in plane["boundary"]["sampled"] for vertex in line)
    assert {m["of"] for m in report["suggested"]["margins"]} == {"K_F", "K_v", "all gains", "sample time"}


def test_infeasible_is_refused_with_condition_and_place(tmp_path: Path) -> None:
    text = (SPECS / "one_mass.yaml").read_text()
    text = text.replace("kind: cfo ", "kind: to ").replace("{K_F: 10, K_v: 100}", "{K_2: {free: [1, 100]}, K_v: 100}")
    (tmp_path / "wrong.yaml").write_text(text)
    result = stiction("gains", tmp_path / "wrong.yaml", "-o", tmp_path / "out")
    assert result.code == 3
    assert "Infeasible: no gain set in the range is stable" in result.out
    assert "fails: c0 > 0 (Routh-Hurwitz; c0 = -" in result.out
    assert not (tmp_path / "out" / "spec.yaml").exists()
    assert json.loads((tmp_path / "out" / "gains.json").read_text())["infeasible"]["of"] == "continuous"


def test_each_contact_has_its_own_share_of_noise(two_mass: tuple[Result, Path]) -> None:
    """Coulomb levels of the spec, 10 N and 20 N: the share printed is the RMS printed over the contact's own level."""
    result, _ = two_mass
    lines = re.findall(r"noise of \w+_(\w+): (\S+) N RMS, at most (\S+) % of the friction", result.out)
    assert {contact for contact, _, _ in lines} == set(TWO_LEVELS)
    for contact, rms, share in lines:
        assert float(share) == pytest.approx(100 * float(rms) / TWO_LEVELS[contact], rel=0.01)


def test_a_margin_is_a_factor(two_mass: tuple[Result, Path]) -> None:
    assert re.search(r"K_F +may be raised by a factor of [\d.]+ \(\+", two_mass[0].out)


@pytest.mark.parametrize("over", [("K_F", "K_x"), ("K_F", "K_F")])
def test_axes_that_are_not_there_are_told(over: tuple[str, str]) -> None:
    assert is_one_message(stiction("gains", SPECS / "one_mass.yaml", "--over", *over))


def test_a_sample_time_of_seconds_leaves_a_stable_suggestion(tmp_path: Path) -> None:
    """Every stable set has infinite noise there: the choice among them fell on an unstable one, again and again."""
    spec = tmp_path / "slow.yaml"
    spec.write_text((SPECS / "one_mass.yaml").read_text().replace("sample_time: 0.001", "sample_time: 3.14159"))
    found = json.loads(stiction("gains", spec, "--json").out)["suggested"]
    gain, filter_gain = (found["gains"][name] for name in ("K_F", "K_v"))
    # One mass of 1 kg: s^2 + K_v s + K_F K_v = 0, and z = 1 + h s for explicit Euler.
    multipliers = 1 + 3.14159 * np.roots([1, filter_gain, gain * filter_gain])
    assert np.abs(multipliers).max() == pytest.approx(found["spectral_radius"], rel=1e-6)
    assert found["spectral_radius"] < 1


def test_the_noise_of_a_semi_implicit_step(tmp_path: Path) -> None:
    """Its equations hold the sample time. At h K_v = 0.1 its noise is near that of the explicit step."""
    spec, text = tmp_path / "semi_implicit.yaml", (SPECS / "one_mass.yaml").read_text()
    spec.write_text(text.replace("velocity: estimated", "velocity: estimated\n  integration: semi_implicit"))
    explicit, other = (json.loads(stiction("gains", s, "--json").out) for s in (SPECS / "one_mass.yaml", spec))
    (before,), (after,) = (found["chosen"]["friction_noise_rms"].values() for found in (explicit, other))
    assert other["chosen"]["stable"] and after != before and after == pytest.approx(before, rel=0.15)


def test_slower_gains_are_suggested_where_the_bound_of_fast_ones_is_as_large_as_friction(tmp_path: Path) -> None:
    """A ball screw: the fastest set, whose bound is above the friction itself, was written, and the slower one told."""
    path = tmp_path / "axis.yaml"
    text = (SPECS / "one_mass.yaml").read_text().partition("envelope:")[0]
    text = text.replace("gains: {K_F: 10, K_v: 100}", "gains: {K_F: {free: [10, 1e5]}, K_v: {free: [10, 1000]}}")
    text = text.replace("value: 1, unit: kg", "value: 35, unit: kg").replace("a: 50", "a: 30")
    path.write_text(text + "envelope: {v: [-0.5, 0.5], v_dot: [-5, 5], x_noise: [-0.5e-6, 0.5e-6]}\n")
    report = json.loads(stiction("gains", path, "--json", "-o", tmp_path / "gains").out)
    first, slower = report["error_bounds"]
    assert first["bound"]["share"] > 0.2 >= slower["bound"]["share"]
    by = slower["gains_divided_by"]
    assert slower["numbers"] == {k: pytest.approx(v / by, rel=0.005) for k, v in first["numbers"].items()}
    written = read_spec(tmp_path / "gains" / "spec.yaml").observer
    assert written is not None
    assert {k: float(str(v)) for k, v in written.gains.items()} == slower["numbers"] == report["suggested"]["gains"]
    assert report["suggested_divided_by"] == by
    for one in (first, slower):
        chosen = path.read_text()
        for name, free in (("K_F", "[10, 1e5]"), ("K_v", "[10, 1000]")):
            chosen = chosen.replace(f"{name}: {{free: {free}}}", f"{name}: {one['numbers'][name]!r}")
        (tmp_path / "chosen.yaml").write_text(chosen)
        certified = json.loads(stiction("certify", tmp_path / "chosen.yaml", "--json").out)
        # what is proved of the C is larger: the invariant set that bounds the remainder has rounded numbers
        assert 1 <= certified["error_bounds"][0]["steady"] / one["bound"]["steady"] < 1 + 2e-5
        assert certified["decay_rate"] == one["certified_rate"]
    words = stiction("gains", path).out
    printed = [float(x) for x in re.findall(r"\|e_a_rail\| <= (\S+) N long after a reversal", words)]
    for shown, one in zip(printed, (first, slower), strict=True):  # rounded up
        assert one["bound"]["steady"] <= shown <= 1.001 * one["bound"]["steady"]
    assert f"all gains divided by {by}," in words


def test_an_axis_under_gravity_has_a_bound_and_one_with_drag_is_told_why_it_has_none(tmp_path: Path) -> None:
    """Gravity's slope counts in full at every position: that costs a little more than the linear force at x = 0."""
    path = tmp_path / "axis.yaml"
    text = (SPECS / "one_mass.yaml").read_text().partition("envelope:")[0]
    text = text.replace("gains: {K_F: 10, K_v: 100}", "gains: {K_F: 10, K_v: {free: [50, 200]}}")
    text = text.replace(
        "parameters:\n", "parameters:\n  l: {value: 1, unit: m}\n  G: {value: 9, unit: N}\n  s: {value: 1, unit: s}\n"
    )
    text += "envelope: {x: [-1, 1], v: [0.1, 5], v_dot: [-210, 210], x_noise: [-5e-6, 5e-6]}\n"
    found = {}
    for force in ("G*sin(x/l)", "G*x/l", "G*v*v*s*s/l/l"):
        path.write_text(text.replace("  - w\n", f"  - w - {force}\n"))
        found[force] = json.loads(stiction("gains", path, "--json").out)
    curved, linear, drag = found.values()
    assert curved["no_error_bound"] is None and linear["no_error_bound"] is None
    bounds = [told["error_bounds"][0]["bound"]["steady"] for told in (curved, linear)]
    assert bounds[1] < bounds[0] < 1.001 * bounds[1]
    assert drag["error_bounds"] == [] and "the damping dg/dv is not constant" in drag["no_error_bound"]
    assert drag["no_error_bound"] in stiction("gains", path).out
    chosen = tmp_path / "chosen.yaml"
    chosen.write_text(path.read_text().replace("{free: [50, 200]}", "100"))
    assert json.loads(stiction("certify", chosen, "--json").out)["error_bounds"] == drag["no_error_bound"]


def test_a_suggestion_at_an_end_of_its_range_says_so(free: Path) -> None:
    """The range of K_v ended above the optimum, and nothing told the user to widen it."""
    assert "an end of its range" not in stiction("gains", free).out
    free.write_text(free.read_text().replace("K_v: {free: [1, 1e4]}", "K_v: {free: [1, 20]}"))
    told = stiction("gains", free).out
    assert "K_v of this set is within 2 % of an end of its range, 1 to 20 1/s" in told and "K_F of this set" not in told
    shares = json.loads(stiction("gains", free, "--json").out)["suggested"]["noise_shares"]
    assert f"for its friction is F_hat_rail, with {100 * shares['F_hat_rail']:.3g} % where 5 % is the limit" in told


@pytest.mark.parametrize(
    ("acceleration", "noise", "part", "reason"),
    [("80", "5e-6", "displacement", "motion within a sample"), ("1", "5e-5", "noise", "noise of the positions")],
)
def test_why_a_bound_is_large_follows_from_its_largest_part(
    free: Path, acceleration: str, noise: str, part: str, reason: str
) -> None:
    """Noise was the largest part, and the motion within a sample was blamed."""
    free.write_text(free.read_text().replace("210", acceleration).replace("5e-6", noise))
    told = stiction("gains", free).out
    (line,) = [line for line in told.splitlines() if "Certified at those" in line]
    assert f"the largest part is {part}" in line and f"because fast gains amplify the {reason}." in told


def test_stable_gains_outside_the_range_are_named(tmp_path: Path) -> None:
    """A range that fits one inertia was answered with "Infeasible" for another, 10^4 times smaller."""
    text = (SPECS / "one_mass.yaml").read_text().replace("m: {value: 1,", "m: {value: 1e-4,")
    text = text.replace("{K_F: 10, K_v: 100}", "{K_F: {free: [10, 1000]}, K_v: 100}")
    (tmp_path / "small.yaml").write_text(text)
    done = stiction("gains", tmp_path / "small.yaml", "--json")
    assert done.code == 3
    outside = json.loads(done.out)["outside"]
    assert 0 < outside["K_F"] < 1
    (tmp_path / "right.yaml").write_text(text.replace("{free: [10, 1000]}", str(outside["K_F"])))
    assert stiction("certify", tmp_path / "right.yaml").code == 0


def test_the_line_of_a_result_has_gains_and_no_factors(tmp_path: Path) -> None:
    """two_mass has gains of its own, which the map scales by a common factor."""
    report = api.load(SPECS / "two_mass.yaml").gains()
    assert "suggested" in str(report) and report.feasibility.suggested is not None
    name, value = next(iter(report.feasibility.suggested.gains.items()))
    assert f"suggested {name} = {value:g}, " in str(report)
    assert "K_F = " not in str(report)


@pytest.mark.parametrize(
    ("shares", "suggested"),
    [((5.7, 3.0, 2.0, 1.5, 1.2, 1.12), [1]), ((5.7, 3.0, 2.0, 1.5, 1.2, 0.9), [1, 32]), ((5.7, 3.0, 0.2), [1, 4])],
)
def test_slower_gains_are_suggested_for_a_bound_below_the_friction(
    shares: tuple[float, ...], suggested: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Gains were divided by 32 for a bound of 112 % of the friction."""
    at = {2**k: share for k, share in enumerate(shares)}
    monkeypatch.setattr(suggesting, "error_response", lambda observer: None)
    monkeypatch.setattr(
        suggesting,
        "bound_at",
        lambda machine, axes, numbers, divisor: SimpleNamespace(divisor=divisor, share=at[divisor]),
    )
    machine, suggestion = SimpleNamespace(nominal=SimpleNamespace(observer=None)), SimpleNamespace(over=lambda k: {})
    found = suggesting.bounds_at(machine, (), suggestion)  # type: ignore[arg-type]
    assert [one.divisor for one in found] == suggested
