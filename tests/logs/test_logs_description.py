"""Descriptions, and whose word counts for a column."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from slider_log import TEXT, rows, write_csv

from codegen.base.errors import BadInput
from codegen.logs import read_description, read_log
from codegen.logs.description import LogDescription
from codegen.spec.reader import parse_spec
from tests.expected_errors import matches, refused


def described(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "about.yaml"
    path.write_text(text)
    return path


def test_every_key(tmp_path):
    d = read_description(
        described(
            tmp_path,
            "columns: {t: zeit, x: weg}\nscale: {t: 1e-3, x: '0.5'}\nparameter_tolerance: 1%\nsample_rate_hz: 500\n"
            "encoder_step: 1e-5\nposition_noise_rms: [0.1]\nvelocity_columns: false\ninput_is: command\n"
            "evaluation: {filter: B, cutoff_hz: 15, trim_s: 1.0, restart_s: 0.5}\n",
        )
    )
    assert d.columns == {"t": "zeit", "x": "weg"} and d.scale == {"t": 1e-3, "x": 0.5}
    assert (d.parameter_tolerance, d.sample_rate_hz, d.encoder_step, d.position_noise_rms) == (
        0.01,
        500,
        (1e-5,),
        (0.1,),
    )
    assert (d.cutoff_hz, d.evaluation.trim_s, d.evaluation.restart_s, d.velocity_columns) == (15, 1, 0.5, False)


def test_a_number_may_have_its_unit(tmp_path):
    """As everywhere in a spec: `encoder_step: 1 um` is 1e-6."""
    text = (
        "sample_time: 2 ms\nencoder_step: 1 um\nposition_noise_rms: [0.5 mm]\n"
        "evaluation: {cutoff_hz: 0.015 kHz, trim_s: 100 ms, restart_s: 0.5 s}\n"
    )
    d = read_description(described(tmp_path, text))
    assert (d.sample_rate_hz, d.encoder_step, d.position_noise_rms) == (500, (1e-6,), (5e-4,))
    assert (d.cutoff_hz, d.evaluation.trim_s, d.evaluation.restart_s) == (15, 0.1, 0.5)
    assert read_description(described(tmp_path, "sample_rate_hz: 2 kHz\ncutoff_hz: 9 Hz\n")).sample_rate_hz == 2000


def test_an_encoder_step_with_its_unit_is_that_of_the_coordinate(tmp_path, spec):
    log = write_csv(tmp_path / "a.csv", rows(1))
    assert read_log(log, spec, description=described(tmp_path, "encoder_step: 10 um\n")).encoder_step == (1e-5,)


REFUSED = {
    "columns: {x: x}\ncutof_hz: 3\n": "SPEC004 about.yaml:2 cutof_hz 'cutoff_hz'?)",
    "units: {x: m}\nwhatever: 3\n": "SPEC004 about.yaml:2 whatever",
    "evaluation: {cutof: 1}\n": "SPEC004 about.yaml:1 evaluation.cutof",
    "columns: 3\n": "SPEC006 about.yaml:1 `3`",
    "columns: {y: pos}\n": "LOG013 about.yaml:1 columns.y `y`",
    "columns:\n  t: t\n  vv: vel\n": "LOG013 about.yaml:3 columns.vv `vv`",
    "columns: {vv: vel}\n": "LOG013 'v'?)",
    "scale: {x: 0}\n": "SPEC006",
    "scale: {x: a}\n": "SPEC006 about.yaml:1 scale.x `a`",
    "scale: {t: -1}\n": "LOG013",
    "encoder_step: 1 deg\n": "SPEC014 about.yaml:1 encoder_step deg",
    "encoder_step: -1 um\n": "SPEC006 about.yaml:1 encoder_step `-1 um`",
    "cutoff_hz: 3 s\n": "SPEC014 about.yaml:1 cutoff_hz `3 s`",
    "cutoff_hz: -3\n": "SPEC006 about.yaml:1 cutoff_hz `-3`",
    "cutoff_hz: 300\n": "LOG013 about.yaml:1 cutoff_hz 300",
    "evaluation: {cutoff_hz: 250}\n": "LOG013 evaluation.cutoff_hz 250",
    "evaluation: 3\n": "SPEC006 about.yaml:1 `3`",
    "parameter_tolerance: 2\n": "SPEC007 about.yaml:1 parameter_tolerance `2%` `200%`",
    "encoder_step: [1, 2]\n": "LOG013 about.yaml:1 encoder_step 2 1",
    "columns: {x: t}\n": "LOG004 `t`",
    "columns: {v: speed}\n": "LOG003 `speed`",
    "[1]\n": "SPEC006",
    "a: [\n": "SPEC001 1.2",
    "sample_time: 0.001\nsample_rate_hz: 500\n": "LOG013 about.yaml:2 sample_rate_hz `sample_time` 500 1000",
    "sample_rate_hz: 10\nsample_time: 0.002\n": "LOG013 about.yaml:1 sample_rate_hz `sample_time` 10 500",
}


@pytest.mark.parametrize("text", REFUSED)
def test_refusals(tmp_path, spec, text):
    log = write_csv(tmp_path / "a.csv", rows(1))
    with pytest.raises(BadInput) as caught:
        read_log(log, spec, description=described(tmp_path, text))
    assert matches(caught.value, REFUSED[text])


def test_a_name_half_of_which_is_another_is_not_suggested(tmp_path, spec):
    with refused("LOG003 `th`") as caught:
        read_log(write_csv(tmp_path / "a.csv", rows(1)), spec, description=described(tmp_path, "columns: {x: th}\n"))
    assert caught.value.nearest is None


def test_precedence(tmp_path):
    made = rows(1)
    table = {"t": made["t"], "w": made["w"], **{n: np.full(500, k) for k, n in enumerate(["x", "s", "d", "o"])}}
    path = write_csv(tmp_path / "a.csv", table)
    plain = parse_spec(TEXT, Path("a.yaml"))
    named = parse_spec(TEXT + "log: {columns: {x: s}, scale: {x: 10}, cutoff_hz: 7}\n", Path("b.yaml"))
    about = described(tmp_path, "columns: {x: d}\nscale: {x: 100}\ncutoff_hz: 9\n")

    def first(**options):
        log = read_log(path, **options)
        return log.positions[0, 0], log.cutoff_hz

    assert first(spec=plain) == (0, None)
    assert first(spec=named) == (10, 7)
    assert first(spec=named, description=about) == (200, 9)
    assert first(spec=named, description=about, columns={"x": "o"}) == (300, 9)
    about.rename(tmp_path / "meta.yaml")
    assert first(spec=named) == (200, 9)
    with refused("LOG013 --column: `y`"):
        first(spec=named, columns={"y": "o"})


@pytest.mark.parametrize(("time", "rate"), [("0.002", "500"), ("0.033", "30"), ("4 ms", "240"), ("16.67 ms", "60")])
def test_a_sample_time_and_a_rate_may_differ_by_rounding(tmp_path, time, rate):
    about = read_description(described(tmp_path, f"sample_time: {time}\nsample_rate_hz: {rate}\n"))
    assert about.sample_rate_hz == pytest.approx(float(rate), rel=0.05)


def test_milliseconds(tmp_path, spec):
    made = rows(2)
    made["t"] = made["t"] * 1000
    path = write_csv(tmp_path / "a.csv", made)
    with refused("LOG012 a.csv:2: t: milliseconds `scale: {t: 0.001}`"):
        read_log(path, spec, description=described(tmp_path, "sample_rate_hz: 500\n"))
    log = read_log(path, spec, description=described(tmp_path, "sample_rate_hz: 500\nscale: {t: 0.001}\n"))
    assert log.sample_time == 0.002
    off = read_log(path, spec, description=described(tmp_path, "sample_rate_hz: 250\nscale: {t: 0.001}\n"))
    assert "which is 500 Hz; the description says 250 Hz" in off.notes[0]


def test_time_from_the_sample_rate(tmp_path, spec):
    made = rows(2)
    del made["t"]
    log = read_log(write_csv(tmp_path / "a.csv", made), spec, description=described(tmp_path, "sample_rate_hz: 500\n"))
    assert log.sample_time == 0.002 and log.size == 1000 and "no column t" in log.notes[0]


@pytest.mark.parametrize(("text", "name", "written"), [("F cmd*2", "F cmd", "F_cmd"), ("-2*F.cmd", "F.cmd", "F_cmd")])
def test_an_expression_with_a_name_as_it_stands_in_the_file_is_told_how_to_write_it(
    tmp_path, spec, text, name, written
):
    made = {"t": [0.0, 0.1], "x": [0.0, 1.0], name: [1.0, 2.0]}
    log = write_csv(tmp_path / "a.csv", made)
    (tmp_path / "meta.yaml").write_text(f"columns: {{w: {text}}}\n")
    with pytest.raises(BadInput, match=f"an expression, in which `{re.escape(name)}` is written `{written}`"):
        read_log(log, spec)


def test_a_measured_input_acts_between_two_rows_with_their_mean(tmp_path, spec):
    """x'' = w/m from w sampled at 100 Hz: the impulse of each step, against the integral of the sine itself."""
    h, omega = 0.01, 9.0
    t = h * np.arange(400)
    path = write_csv(tmp_path / "a.csv", {"t": t, "x": np.sin(t), "w": np.sin(omega * t)}, fmt="%.12g")
    impulse = (np.cos(omega * t) - np.cos(omega * (t + h))) / omega
    measured, held = (
        read_log(path, spec, description=described(tmp_path, f"input_hold: {hold}\n")) for hold in ("linear", "zoh")
    )
    errors = [np.abs(h * log.inputs[:-1, 0] - impulse[:-1]).max() for log in (measured, held)]
    assert errors[0] < 1e-5 and errors[1] > 4e-4
    assert "each input is taken as the mean of both" in measured.notes[0] and not held.notes
    typed = read_log(path, spec, description=described(tmp_path, "input_hold: zero_order\n"))
    assert "input_hold `zero_order` is neither `linear` nor `zero-order`" in typed.notes[0]


def test_a_measured_input_at_irregular_times_keeps_its_integral(tmp_path, spec):
    draw = np.random.default_rng(1)
    t = np.cumsum(0.01 * (1 + 0.3 * draw.uniform(-1, 1, 500)))
    path = write_csv(tmp_path / "a.csv", {"t": t, "x": np.sin(t), "w": np.cos(3 * t)}, fmt="%.12g")
    log = read_log(path, spec, description=described(tmp_path, "input_hold: linear\n"))
    reached = np.cumsum(log.inputs[:, 0]) * log.sample_time
    exact = (np.sin(3 * (log.time + log.sample_time)) - np.sin(3 * log.time[0])) / 3
    assert np.abs(reached - exact)[:-2].max() < 2e-4


def test_every_key_is_in_the_table_of_the_docs() -> None:
    text = (Path(__file__).parents[2] / "docs" / "logs.md").read_text("utf-8")
    table = text.split("| key | meaning |\n")[1].split("\n\n")[0]
    keys = {key for line in table.splitlines() for key in re.findall(r"`(\w+)`", line.split("|")[1])}
    assert keys == set(LogDescription.model_fields)


def test_a_held_name_that_is_nothing_of_the_log_is_refused_in_a_csv_too(tmp_path, spec):
    log = write_csv(tmp_path / "a.csv", rows(1))
    with refused("LOG013 about.yaml:1: hold: `ANYTHING`"):
        read_log(log, spec, description=described(tmp_path, "hold: ANYTHING\n"))


def test_keys_without_effect_are_named_where_the_key_that_they_need_is_absent(tmp_path, spec):
    """`evaluation: {filter: …}` and `input_is` were read and used by nothing, without a word."""
    log = write_csv(tmp_path / "a.csv", rows(1))

    def notes(text):
        return " ".join(read_log(log, spec, description=described(tmp_path, text)).notes)

    alone = notes("input_is: measured current\nevaluation: {filter: Butterworth 15 Hz}\n")
    assert "input_is `measured current` has no effect" in alone and "evaluation.filter has no effect" in alone
    cutoff = "cutoff_hz: 15"
    for stated in (f"{cutoff}\nevaluation: {{filter: Butterworth}}\n", f"evaluation: {{filter: B, {cutoff}}}\n"):
        assert "no effect" not in notes("input_is: measured current\ninput_hold: linear\n" + stated)


def test_a_description_may_be_made_by_a_program():
    """It ended in AttributeError: the validators asked the file for the place of a key."""
    assert LogDescription(late={"i": 0.002}, cutoff_hz="15 Hz").late == {"i": 0.002}
    with pytest.raises(ValueError, match=r"late\.i\n.*`2 m`"):
        LogDescription(late={"i": "2 m"})
