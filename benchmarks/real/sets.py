"""Which files of each measured set train and which test, by which spec, and what an expert finds there."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared" / "data"
SPECS = ROOT / "specs" / "data"
PAGES = ROOT / "docs"


@dataclass(frozen=True)
class Diagnosed:
    """One diagnosis of a set.

    Attributes:
        name: of the folder of its results. words: of its row in the page's table.
        spec, about: files in SPECS/set: the spec, and the description of the logs; "" where the spec has it.
        train, test: files in DATA/set; without ``test`` the end of the training log is held out.
        expert: relative held-out error by the set's README: of the base model, and of the best that it names.
        steady: whether each log runs at one constant speed, so that the page also has the errors of their means.
    """

    name: str
    words: str
    spec: str
    train: tuple[str, ...]
    test: tuple[str, ...] = ()
    expert: str = ""
    about: str = "meta.yaml"
    steady: bool = False


def spec_of(set_name: str, run: Diagnosed) -> Path:
    """The file of the spec of a diagnosis."""
    return (SPECS / set_name / run.spec).resolve()


def _ladder(drive: int, speeds: tuple[int, ...]) -> tuple[str, ...]:
    """Steady logs of a screw drive, both ways."""
    folder = f"experiments/driveNo{drive}/steady_state/0.096kg"
    return tuple(f"{folder}/{sign}{speed}.csv" for speed in speeds for sign in ("", "n"))


def _servo(*times: str) -> tuple[str, ...]:
    return tuple(f"2026-01-15_10h{time}.json" for time in times)


SLOW = _servo("28m10", "28m24", "28m42", "28m57", "29m14", "29m29", "29m47", "30m02")
FAST = _servo("28m32", "29m04", "29m37", "30m10")
RMS = "means of the logs, mN·m: "

PAGE_NAMES = {"dfki_double_pendulum": "double_pendulum", "odrive_cogging": "odrive"}
"""Of sets whose page is not named as they are."""
SETS: dict[str, tuple[Diagnosed, ...]] = {
    "emps": (
        Diagnosed(
            "pulses",
            "DATA_EMPS → DATA_EMPS_PULSES",
            "../../emps.yaml",
            ("DATA_EMPS.mat",),
            ("DATA_EMPS_PULSES.mat",),
            "5.98 % (friction by direction; other filters)",
            "",
        ),
    ),
    "odrive_cogging": (
        Diagnosed(
            "slow_turns",
            "slow_goodgains_2_nocomp_0, 1 → 2",
            "motor.yaml",
            ("slow_goodgains_2_nocomp_0.csv", "slow_goodgains_2_nocomp_1.csv"),
            ("slow_goodgains_2_nocomp_2.csv",),
            "none published",
        ),
    ),
    "dfki_double_pendulum": (
        Diagnosed(
            "excitation",
            "trajectory_00, 01 → 04",
            "pendulum.yaml",
            ("trajectory_00.csv", "trajectory_01.csv"),
            ("trajectory_04.csv",),
            "none published",
        ),
    ),
    "rvim_screw_drives": (
        Diagnosed(
            "drive_1",
            "drive 1, lead screw",
            "drive_1.yaml",
            _ladder(1, (2, 20, 40, 60, 80, 100, 140, 180)),
            _ladder(1, (10, 30, 50, 70, 90, 120, 160, 200)),
            f"{RMS}0.134 → 0.038 (Stribeck, wide)",
            steady=True,
        ),
        Diagnosed(
            "drive_2",
            "drive 2, anti-backlash",
            "drive_2.yaml",
            _ladder(2, (10, 30, 50, 70, 90, 120, 160, 200)),
            _ladder(2, (20, 40, 60, 80, 100, 140, 180)),
            f"{RMS}0.103, nothing better",
            steady=True,
        ),
        Diagnosed(
            "drive_3",
            "drive 3, worm gear",
            "drive_3.yaml",
            _ladder(3, (1, 4, 8, 13, 20, 30, 50, 70, 90, 120, 160, 200)),
            _ladder(3, (2, 6, 10, 17, 25, 40, 60, 80, 100, 140, 180)),
            f"{RMS}0.071 → 0.051 (Stribeck, one way only)",
            steady=True,
        ),
    ),
    "bam_xl330": (
        Diagnosed(
            "slow_to_fast",
            "slow motions → fast ones",
            "servo.yaml",
            SLOW,
            FAST,
            "54.4 %, nothing to be named by this split",
        ),
        Diagnosed(
            "as_stored",
            "the same, `load` read as stored",
            "servo.yaml",
            SLOW,
            FAST,
            "52.8 %; the answer is to point at `load`",
            "as_stored.yaml",
        ),
    ),
    "dfki_simple_pendulum": (
        Diagnosed(
            "two_to_collocation",
            "ddp, system_identification → direct_collocation",
            "pendulum.yaml",
            ("ddp.csv", "system_identification.csv"),
            ("direct_collocation.csv",),
            "17.3 %, nothing better",
        ),
        Diagnosed(
            "two_to_ddp",
            "system_identification, direct_collocation → ddp",
            "pendulum.yaml",
            ("system_identification.csv", "direct_collocation.csv"),
            ("ddp.csv",),
            "16.3 → 14.8 % (8 ms of delay)",
        ),
        Diagnosed(
            "ddp_to_collocation",
            "ddp → direct_collocation",
            "pendulum.yaml",
            ("ddp.csv",),
            ("direct_collocation.csv",),
            "18.4 → 16.6 % (8 ms of delay)",
        ),
        Diagnosed(
            "by_hand",
            "gravity_compensation, moved by hand",
            "pendulum.yaml",
            ("gravity_compensation.csv",),
            (),
            "cannot be fitted",
        ),
        Diagnosed(
            "energy_shaping",
            "energy_shaping, torque at most 1.5 N·m",
            "pendulum.yaml",
            ("energy_shaping.csv",),
            (),
            "cannot be fitted",
        ),
    ),
    "laas_cogging": (
        Diagnosed(
            "slow",
            "speed_test → speed_test_old, one turn a second",
            "motor.yaml",
            ("speed_test.txt",),
            ("speed_test_old.txt",),
            "51 → 26 % (five waves; smooth halves)",
        ),
        Diagnosed(
            "slow_back",
            "speed_test1 → speed_test",
            "motor.yaml",
            ("speed_test1.txt",),
            ("speed_test.txt",),
            "62 → 18 % (five waves; smooth halves)",
        ),
        Diagnosed(
            "fast",
            "acc_current, to 160 rad/s",
            "motor.yaml",
            ("acc_current.txt",),
            (),
            "6.8 → 4.7 % (friction that grows up to 20 rad/s)",
        ),
    ),
    "staubli_tx40": (
        Diagnosed(
            "wrist",
            "wrist, joint by joint",
            "wrist.yaml",
            ("pos_read_data.csv",),
            (),
            "242 and 81 % (first 60 % → rest)",
        ),
        Diagnosed(
            "wrist_coupled",
            "wrist with its coupling",
            "wrist_coupled.yaml",
            ("pos_read_data.csv",),
            (),
            "44.6 and 39.7 %, nothing better",
        ),
    ),
}
