"""Every file that a spec or an option names: a device, a pipe, a folder or a huge file is one message, at once."""

from __future__ import annotations

import errno
import os
import shutil
import stat
from pathlib import Path

import pytest

from codegen.base.input_files import LARGEST_TEXT, opened, read_bytes
from codegen.checker import files as checker_files
from tests.expected_errors import refused

from .command import SPECS, is_one_message, process, stiction

LOG = "t,x,w\n" + "".join(f"{k / 1000},{k * k / 1e6},{k % 7}\n" for k in range(40))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(SPECS / "one_mass.yaml", "s.yaml")
    Path("log.csv").write_text(LOG)
    os.mkfifo("pipe")
    for name in ("pipe.csv", "pipe.npy", "pipe.mat", "pipe.py"):
        os.mkfifo(name)
        Path(name.replace("pipe", "zero")).symlink_to("/dev/zero")
    Path("zero").symlink_to("/dev/zero")
    return tmp_path


CALLS = {
    "spec": ("check", "{}"),
    "certificate": ("verify", "{}"),
    "log": ("diagnose", "s.yaml", "{}.csv"),
    "npy": ("replay", "s.yaml", "{}.npy"),
    "mat": ("diagnose", "s.yaml", "{}.mat"),
    "streamed": ("replay", "s.yaml", "{}.csv"),
    "test": ("diagnose", "s.yaml", "log.csv", "--test", "{}.csv"),
    "description": ("diagnose", "s.yaml", "log.csv", "-d", "{}"),
    "effects": ("--effects", "{}.py", "check", "s.yaml"),
}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("special", ["pipe", "zero"])
def test_a_pipe_or_a_device(folder, call, special):
    result = stiction(*(word.format(special) for word in CALLS[call]))
    if call == "certificate":  # the checker's own words
        assert result.code == 2 and result.err.startswith(f"error: {special}: ") and "[FILE001]" in result.err
    else:
        assert is_one_message(result) and "a device or a pipe" in result.err


@pytest.mark.parametrize("special", ["pipe", "zero", "."])
def test_a_robot_description(folder, special):
    text = (SPECS / "two_link_arm.yaml").read_text()
    Path("s.yaml").write_text(f"name: arm\nurdf: {special}\n{text.split(chr(10), 1)[1]}")
    result = stiction("check", "s.yaml")
    there = "a folder" if special == "." else "a device or a pipe"
    assert is_one_message(result) and result.err.startswith(f"error: s.yaml:2: urdf: `{special}`: {there}")


@pytest.mark.parametrize("special", ["pipe", "zero"])
@pytest.mark.parametrize("name", ["one_mass.h", "spec", "meta.yaml", "ellipsoid.json"])
def test_files_that_lie_beside(folder, special, name):
    generated = Path("generated")
    shutil.copytree(SPECS.parent / "generated" / "one_mass", generated)
    if name == "spec":
        result = stiction("verify", generated / "certificate.json", "--spec", special)
    elif name == "meta.yaml":
        Path(name).symlink_to(special)
        result = stiction("diagnose", "s.yaml", "log.csv")
    else:
        (generated / name).unlink()
        (generated / name).symlink_to(folder / special)
        result = stiction("verify", generated / "certificate.json")
    assert result.code == 2 and ("no regular file" in result.err or "a device or a pipe" in result.err)


def test_a_file_that_is_too_large(folder):
    for name in ("s.yaml", "log.csv", "log.npy", "big.py"):
        with Path(name).open("ab") as stream:
            stream.truncate(10**12)  # a hole, which takes no room
    (folder / "good.yaml").write_text((SPECS / "one_mass.yaml").read_text())
    for call in (("check", "s.yaml"), ("diagnose", "good.yaml", "log.csv"), ("replay", "good.yaml", "log.npy")):
        result = stiction(*call)
        assert is_one_message(result) and "1000000000000 bytes" in result.err
    assert "1000000000000 bytes" in stiction("--effects", "big.py", "check", "good.yaml").err


def test_what_is_examined_is_what_was_opened(tmp_path):
    """A file that has no size, as those of /proc: what is read counts."""
    assert read_bytes(Path("/proc/self/status"), "text", LARGEST_TEXT).startswith(b"Name:")
    with refused("FILE002 9") as told:
        read_bytes(Path("/proc/self/status"), "text", 9)
    assert told.value.code == "FILE002"
    (tmp_path / "a").write_text("abc")
    with opened(tmp_path / "a", "text", 9) as stream:
        assert stat.S_ISREG(os.fstat(stream.fileno()).st_mode) and stream.read() == b"abc"


def test_the_checker_reads_no_more_than_it_says(tmp_path):
    (tmp_path / "a").write_text("abc")
    assert checker_files.read(tmp_path / "a") == b"abc"
    with pytest.raises(OSError, match="more than 2 bytes"):
        checker_files.read(tmp_path / "a", 2)


LONG = "a" * 300
NAMES = {
    "simulate": ("simulate", "s.yaml", "-o", f"{LONG}.csv"),
    "certify": ("certify", "s.yaml", "-o", f"{LONG}.json"),
    "generate": ("generate", "s.yaml", "-o", LONG),
    "gains": ("gains", "s.yaml", "-o", LONG),
    "cancel": ("cancel", "s.yaml", "-o", LONG),
    "diagnose": ("diagnose", "s.yaml", "log.csv", "-o", LONG),
    "replay": ("replay", "s.yaml", "log.csv", "-o", f"{LONG}.csv"),
    "check": ("check", LONG),
    "log": ("diagnose", "s.yaml", f"{LONG}.csv"),
    "ending": ("diagnose", "s.yaml", LONG),
    "fmu": ("generate", "s.yaml", "--target", "fmu", "-o", LONG),
}


@pytest.mark.parametrize("call", NAMES)
def test_a_name_that_is_too_long(folder, call):
    result = stiction(*NAMES[call])
    assert is_one_message(result) and len(result.err) < 1000


INTO = {
    "simulate": ("a.csv", "simulate", "s.yaml", "-o", "a.csv"),
    "certify": ("a.json", "certify", "s.yaml", "-o", "a.json"),
    "export": ("a.xml", "export", "s.yaml", "--to", "mjcf", "-o", "a.xml"),
    "generate": ("made/README.md", "generate", "s.yaml", "-o", "made"),
    "replay": ("a.csv", "replay", "s.yaml", "log.csv", "-o", "a.csv"),
    "init": ("mine.yaml", "init", "mine"),
}


@pytest.mark.parametrize("link", ["absent/mine", "itself"])
@pytest.mark.parametrize("call", INTO)
def test_a_link_to_nothing_is_kept(folder, call, link):
    """As to a file on a disk that is not mounted: it counted as a free name, and the link was replaced."""
    name, *words = INTO[call]
    path = Path(name)
    path.parent.mkdir(exist_ok=True)
    path.symlink_to(path.name if link == "itself" else link)
    before = sorted(folder.rglob("*"))
    result = stiction(*words)
    assert is_one_message(result) and f"{name}: cannot be written (a link" in result.err and "[FILE003]" in result.err
    assert path.is_symlink() and sorted(folder.rglob("*")) == before


@pytest.mark.parametrize("call", ["check", "log", "out", "effects", "usage"])
def test_a_name_that_is_not_utf8(folder, call):
    name = os.fsdecode(b"\xff.yaml")
    for copy in (name, f"{name}.csv", f"{name}.py"):
        shutil.copy("s.yaml", copy)
    words = {
        "check": ("check", name),
        "log": ("diagnose", "s.yaml", f"{name}.csv"),
        "out": ("simulate", "s.yaml", "-o", f"{name}.csv"),
        "effects": ("--effects", f"{name}.py", "check", "s.yaml"),
        "usage": (name,),
    }
    result = process(*words[call], cwd=folder) if call in ("check", "usage") else stiction(*words[call])
    assert result.code == 2 and "Traceback" not in result.err
    if call != "usage":
        assert is_one_message(result) and "a name that is not UTF-8" in result.err and r"\xff.yaml" in result.err


@pytest.mark.parametrize("verb", ["check", "verify", "certify"])
def test_a_name_that_is_too_long_is_one_message(folder, verb):
    """`verify` asked first whether it is a folder."""
    result = stiction(verb, "x" * 5000)
    assert is_one_message(result) and "File name too long" in result.err, result.err[-300:]


@pytest.mark.parametrize(
    "call",
    [
        ("check", "{}"),
        ("verify", "{}"),
        ("generate", "{}"),
        ("diagnose", "s.yaml", "{}"),
        ("replay", "{}", "l.csv", "-o", "o.csv"),
    ],
)
def test_a_file_that_may_not_be_read_has_the_code_of_a_file(
    call: tuple[str, ...], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Typer asked first, and its message has no code. Root may read any file: simulated."""
    access, real = os.access, os.open

    def refused_open(path, *args, **more):
        if Path(path).name == "secret.csv":
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        return real(path, *args, **more)

    Path("secret.csv").write_text(LOG)
    monkeypatch.setattr(os, "access", lambda path, mode, **more: mode != os.R_OK and access(path, mode, **more))
    monkeypatch.setattr(os, "open", refused_open)
    result = stiction(*(word.format("secret.csv") for word in call))
    assert result.code == 2
    assert "secret.csv: unreadable (Permission denied)" in result.err and "[FILE001]" in result.err
