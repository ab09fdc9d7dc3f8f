"""Measured logs with damage that knows their formats: CSV, .npy, .npz and .mat, and the description beside them.

The good log is written here byte by byte, so that lengths, types and headers can be wrong one at a time.
"""

from __future__ import annotations

import io
import random
import struct
import warnings
import zipfile
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

from codegen.cancellation import with_cancellation
from codegen.emit.package import emit_sources, make_header
from codegen.logs import preflight, read_log
from codegen.observers import observer_of
from codegen.program import Program, build_program
from codegen.replay.engine import Engine
from codegen.replay.over_log import replay_log
from codegen.replay.samples import Samples
from codegen.spec import Spec, parse_spec

from .case import Case, Stage
from .hostile import NAMES, NUMBERS, TEXTS

SPEC = (Path(__file__).parents[2] / "specs" / "one_mass.yaml").read_text("utf-8")
PERIOD = 0.001
Columns = dict[str, np.ndarray]


@cache
def observed() -> tuple[Spec, Program, Engine]:
    """The spec whose logs these are, and its observer, compiled once."""
    spec = parse_spec(SPEC, Path("one_mass.yaml"))
    program = build_program(with_cancellation(spec, observer_of(spec)), spec.code)
    return spec, program, Engine(program, emit_sources(program, make_header("one_mass.yaml", spec.sha256, "")))


def log(seed: int) -> Case:
    """The damaged log of that number: read and audited, and replayed."""
    with warnings.catch_warnings():  # of NumPy and zipfile, about names that a log should not have
        warnings.simplefilter("ignore")
        return _log(seed)


def _log(seed: int) -> Case:
    dice = random.Random(f"log {seed}")
    columns = damaged_columns(dice) if dice.random() < 0.5 else good(dice)
    kind = dice.choice([".csv"] * 8 + [".npy"] * 5 + [".npz"] + [".mat"] * 7)
    content = WRITERS[kind](columns, dice)
    if dice.random() < 0.2:
        content = damaged_bytes(content, dice)
    name = f"a{kind if dice.random() < 0.98 else dice.choice(['.CSV', '.txt', '.tsv', '.mat', '.npy', '.dat', ''])}"
    files = {name: content}
    if dice.random() < 0.2:
        files["meta.yaml"] = description(dice).encode("utf-8", "surrogatepass")
    return Case(files, stages(name, replayed=dice.random() < 0.5))


def stages(name: str, replayed: bool = True) -> tuple[Stage, ...]:
    """A log as a diagnosis takes it in, and as a replay does."""
    observed()

    def read() -> None:
        spec = observed()[0]
        preflight(read_log(name, spec), spec)

    def replay() -> None:
        spec, program, engine = observed()
        samples = Samples(spec, program, PERIOD, Path(name), None, None)
        replay_log(spec, program, engine, samples, {"F_hat_rail": 50.0}, Path("out.csv"))

    return (Stage("replay", replay), Stage("read", read)) if replayed else (Stage("read", read),)


# ---- columns --------------------------------------------------------------------------------------------------------


def good(dice: random.Random, rows: int | None = None) -> Columns:
    """A mass pushed to and fro; long enough to be used, or too short."""
    n = rows or dice.choice([1, 30, 250] + [4500] * 7)
    t = np.arange(n) * (PERIOD if n != 250 else 0.02)
    x = 0.1 * np.sin(2 * np.pi * 0.7 * t)
    v = 0.44 * np.cos(2 * np.pi * 0.7 * t)
    return {"t": t, "x": x, "v": v, "w": 50 * np.sign(v) - 2 * x}


def damaged_columns(dice: random.Random) -> Columns:
    columns = good(dice)
    for _ in range(dice.choice([1, 1, 2, 3])):
        name = dice.choice(list(columns))
        n = max(1, min(map(len, columns.values())))
        some = slice(a := dice.randrange(n), a + dice.choice([1, 1, 5, n]))
        value = dice.choice([np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 0.0, -0.0, 1e-300, 1e16, 2.0**53 + 1, 1e9])
        column = np.array(columns[name], dtype=float)
        match dice.randrange(12):
            case 0 | 1 | 2:
                column[some] = value
            case 3:
                column = column * dice.choice([0.0, 1e300, -1.0, 1e-300, 1e3, np.nan])
            case 4:
                column = column[: dice.randrange(n) + 1]
            case 5:
                column = np.repeat(column, dice.choice([1, 2]))[: len(column)]
            case 6:
                column = column[::-1].copy()
            case 7:
                column = np.sort(np.array([dice.random() * dice.choice([1, 10, 1e6]) for _ in range(len(column))]))
            case 8:
                column[some.start :] += dice.choice([1.0, 10.0, -10.0, 1e6, 1e300, PERIOD / 2])
            case 9:
                del columns[name]
                columns[dice.choice(["t", "x", "w", "time", "pos", "", *NAMES])] = column
                continue
            case 10:
                columns[dice.choice(["x", "extra", *NAMES])] = column
                continue
            case _:
                column[some] += np.array([dice.gauss(0, 1) for _ in range(len(column[some]))])
        columns[name] = column
    return columns


def description(dice: random.Random) -> str:
    """A ``meta.yaml``, right or wrong."""
    number, word = dice.choice(["1", "0.001", *NUMBERS]), dice.choice(["x", "t", *NAMES])
    lines = [
        f"columns: {{x: {dice.choice(['x', 'v', 'none', '1', '[x]'])}}}",
        "columns: [t, x, v, w]",
        f"columns: [{word!r}, x]",
        f"scale: {{x: {number}}}",
        f"scale: {{{word!r}: 1}}",
        f"cutoff_hz: {number}",
        f"sample_rate_hz: {number}",
        f"parameter_tolerance: {number}",
        f"encoder_step: {number}",
        f"encoder_step: [{number}, {number}]",
        f"position_noise_rms: {number}",
        "missing: fill",
        f"missing: {word!r}",
        f"input_hold: {dice.choice(TEXTS)!r}",
        f"trim: {number}",
        f"{word!r}: {number}",
        "? ? ? a",
        "columns: &a {x: *a}",
    ]
    return "\n".join(dice.sample(lines, dice.randint(1, 3))) + "\n"


# ---- formats --------------------------------------------------------------------------------------------------------


def csv(columns: Columns, dice: random.Random) -> bytes:
    delimiter = dice.choice([","] * 12 + [";", ";", "\t", "\t", " ", "|", ":", ", "])
    n = max(map(len, columns.values()), default=0)
    form = dice.choice(["%.9g", "%.17g", "%.3f", "%r", "%g"])
    cells = [[form % float(column[k]) if k < len(column) else "" for column in columns.values()] for k in range(n)]
    if dice.random() < 0.2:
        for _ in range(dice.choice([1, 1, 3])):
            row = dice.randrange(max(n, 1))
            if n and cells[row]:
                odd = ["", "NA", "-", "#", "1,5", "1.5e", '"1"', '"', "=1+1", "0x1p3", "1e5000", "∞", "12:00", "a\tb"]
                cells[row][dice.randrange(len(cells[row]))] = dice.choice([*odd, *NUMBERS, *NAMES])
    lines = [delimiter.join(columns), *(delimiter.join(row) for row in cells)]
    for _ in range(dice.choice([0, 0, 0, 0, 1, 2])):
        at = dice.randrange(len(lines))
        odd_line = [
            "",
            "#",
            "# a comment",
            delimiter,
            delimiter * 40,
            '"' * 9,
            "\\",
            "x" * 4000,
            '"unclosed',
            "\x0c",
            "\x1a",
            "sep=,",
        ]
        match dice.randrange(5):
            case 0:
                lines.insert(at, dice.choice(odd_line))
            case 1:
                lines[at] = dice.choice(odd_line)
            case 2:
                lines[at] += delimiter + dice.choice(["", "1", "x"])
            case 3:
                lines[at] = lines[at][: dice.randrange(len(lines[at]) + 1)]
            case _:
                lines = lines[dice.choice([0, 1]) :][: max(1, dice.randrange(len(lines) + 1))] or [""]
    text = dice.choice(["\n"] * 12 + ["\r\n", "\r\n", "\r", "\n\n", "\x85", "\u2028"]).join(lines) + dice.choice(
        ["\n", ""]
    )
    coding = dice.choice(["utf-8"] * 30 + ["utf-8-sig", "utf-16", "utf-32", "utf-7", "cp500", "latin-1"])
    return text.encode(coding, "replace" if coding in ("latin-1", "cp500") else "surrogatepass")


KINDS = [">f8", "<f4", "<f2", "<i8", "<i2", "|u1", "|b1", "<c16", "<U8", "|S4", "<M8[s]", "<f8,<f8", "(2,)<f8", "V3"]


def table(columns: Columns, dice: random.Random) -> np.ndarray:
    """A structured array of the columns as far as all of them go."""
    n = min(map(len, columns.values()))
    kinds = [dice.choice(["<f8"] * 80 + KINDS) for _ in columns]
    made = np.zeros(
        n, dtype=[(name or f"f{k}", kind) for k, (name, kind) in enumerate(zip(columns, kinds, strict=True))]
    )
    for name, column in columns.items():
        if name and made.dtype[name].kind in "fiub" and not made.dtype[name].shape:
            with np.errstate(all="ignore"):
                made[name] = column[:n]
    return made


def npy(columns: Columns, dice: random.Random) -> bytes:
    stream = io.BytesIO()
    try:
        array = table(columns, dice)
    except (ValueError, TypeError, UnicodeError):
        array = np.zeros(5, dtype=[("t", "<f8"), ("x", "<f8"), ("w", "<f8")])
    if dice.random() < 0.1:
        array = dice.choice([array.reshape(-1, 1), array[:0], array[:1].reshape(()), np.zeros((5, 3)), np.arange(9.0)])
    np.save(stream, array, allow_pickle=False)
    data = stream.getvalue()
    return npy_header(data, dice) if dice.random() < 0.35 else data


def npy_header(data: bytes, dice: random.Random) -> bytes:
    """The same numbers below another header."""
    size = struct.unpack_from("<H", data, 8)[0]
    header, body = data[10 : 10 + size].decode("latin-1"), data[10 + size :]
    shapes = [
        *("(5,)", "(-1,)", "(99999999999999999999,)", "(2**70,)", "(1e9,)", "(True,)", "5", "(5, 5)", "()"),
        *("[5]", "(None,)", "(4500, -1)"),
    ]
    shapes += [
        *("(9223372036854775807,)", "(0,)", "(0x10,)", "('5',)", "(5", "(" * 300 + ")" * 300, "(5,) * 10**9"),
        *("(1_0,)", "(4294967296, 4294967296)"),
    ]
    kinds = [
        *("'<f8'", "'|O'", "'<U9999999'", "'V0'", "''", "'<f9'", "'<f8,<f8'", "[]", "[('x', '<f8')]", "None"),
        *("5", "['x']", "'M8[9999999999999s]'"),
    ]
    kinds += [
        "[('x', '<f8', (999999999,))]",
        "[('x', [('y', '<f8')])]",
        "[" * 200 + "]" * 200,
        "[('', '<f8')]",
        "[('x', '<f8'), ('x', '<f8')]",
        "'|S2147483648'",
    ]
    kinds += [
        "{'names': ['x'], 'formats': ['<f8'], 'offsets': [-9]}",
        "[('x', '<f8', -1)]",
        "[(('a', 'x'), '<f8')]",
        "'object'",
        "'(99999,99999)f8'",
        "[('\\x00', '<f8')]",
    ]
    match dice.randrange(8):
        case 0 | 1:
            header = header.replace(
                header[header.index("'shape'") : header.rindex(")") + 1], f"'shape': {dice.choice(shapes)}"
            )
        case 2 | 3:
            end = header.index(", 'fortran_order'")
            header = "{'descr': " + dice.choice(kinds) + header[end:]
        case 4:
            header = dice.choice(
                [
                    *("", "{", "{}", "[]", "1", "{'descr': 1}", "(" * 5000, "{'a': {}}" * 3, "\0" * 40),
                    *("'" * 99, "__import__('os')", "{**{}}"),
                ]
            )
        case 5:
            header = header.replace("False", dice.choice(["True", "None", "1", "0", "'x'", "false", "False,"]))
        case 6:
            header = header.replace("}", dice.choice([", 'x': 1}", ", 'descr': 1}", "", "}}", ",,}", "} #", "} + {}"]))
        case _:
            k = dice.randrange(len(header))
            header = header[:k] + dice.choice("{}[](),:'\"\\#\n\0x9-") + header[k + 1 :]
    version = dice.choice([b"\x01\x00"] * 6 + [b"\x02\x00", b"\x03\x00", b"\x00\x00", b"\x09\x09", b"\x01\x01"])
    raw = header.encode("utf-8", "surrogatepass")
    told = dice.choice([len(raw)] * 6 + [0, len(raw) + 1, 65535, len(raw) - 1])
    length = (
        struct.pack("<H", max(told, 0) % 65536)
        if version[0] == 1
        else struct.pack("<I", dice.choice([max(told, 0), 0xFFFFFFFF]))
    )
    return data[:6] + version + length + raw + body


def npz(columns: Columns, dice: random.Random) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", dice.choice([zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])) as archive:
        for name, column in columns.items():
            inner = io.BytesIO()
            np.save(inner, column, allow_pickle=False)
            data = inner.getvalue() if dice.random() < 0.8 else npy_header(inner.getvalue(), dice)
            entry = f"{name}.npy" if dice.random() < 0.97 else dice.choice(["x", "../x.npy", "/x.npy", "x.npy", "y"])
            written = zipfile.ZipInfo(entry)  # by default it would hold the time of day
            written.compress_type = archive.compression
            archive.writestr(written, data)
    return stream.getvalue()


def mat(columns: Columns, dice: random.Random) -> bytes:
    """Format 5, whose elements may lie about what they are; or format 4."""
    if dice.random() < 0.25:
        return b"".join(_mat_4(name, column, dice) for name, column in columns.items())
    order = dice.choice("<<<>")
    body = b""
    for name, column in columns.items():
        matrix = _matrix(name, column, order, dice)
        if dice.random() < 0.4:
            packed = zlib.compress(matrix)
            packed = (
                packed
                if dice.random() < 0.92
                else dice.choice([packed[: len(packed) // 2], b"", packed + b"x", zlib.compress(b"\0" * 10**7)])
            )
            matrix = _element(15, packed, order, dice, padded=False)
        body += matrix
    text = b"MATLAB 5.0 MAT-file".ljust(116) + bytes(8)
    return (
        text
        + struct.pack(f"{order}H", dice.choice([0x0100] * 40 + [0x0200, 0]))
        + (b"IM" if order == "<" else b"MI")
        + body
    )


def _element(kind: int, payload: bytes, order: str, dice: random.Random, padded: bool = True) -> bytes:
    size = len(payload)
    if dice.random() < 0.008:
        kind = dice.choice([0, 1, 2, 5, 7, 8, 9, 10, 12, 14, 15, 16, 17, 18, 255, 65535])
    if dice.random() < 0.008:
        size = dice.choice([0, 1, 7, size - 1, size + 1, size * 2, 0x7FFFFFFF, 0xFFFFFFFF, 0x80000000, 4 << 16])
    return (
        struct.pack(f"{order}II", kind, max(size, 0) & 0xFFFFFFFF) + payload + bytes(-len(payload) % 8 if padded else 0)
    )


def _matrix(name: str, column: np.ndarray, order: str, dice: random.Random) -> bytes:
    number = dice.choice([6] * 150 + [0, 1, 2, 3, 4, 5, 7, 8, 12, 15, 16, 17, 99])
    flags = dice.choice([0] * 60 + [0x0800, 0x0400, 0x0200, 0xFF00])
    shape = dice.choice(
        [(len(column), 1)] * 100
        + [
            (1, len(column)),
            (len(column), 2),
            (-1, len(column)),
            (0, 0),
            (len(column),),
            (),
            (2**31 - 1, 2**31 - 1),
            (1, 1, len(column)),
        ]
        + [(65536, 65536), (-2, -(len(column) // 2) or -1), tuple([1] * 40 + [len(column)])]
    )
    stored, kind = dice.choice([(9, "f8")] * 40 + [(7, "f4"), (5, "i4"), (3, "i2"), (2, "u1"), (12, "i8"), (13, "u8")])
    with np.errstate(all="ignore"):
        numbers = np.nan_to_num(column, posinf=1e9, neginf=-1e9).clip(-1e9, 1e9) if kind[0] != "f" else column
        data = numbers.astype(order + kind).tobytes()
    parts = [
        _element(6, struct.pack(f"{order}II", number | flags, 0), order, dice),
        _element(5, struct.pack(f"{order}{len(shape)}i", *shape), order, dice),
        _element(1, name.encode("utf-8", "surrogatepass"), order, dice),
        _element(stored, data, order, dice),
    ]
    if dice.random() < 0.05:
        parts = dice.sample(parts, dice.randint(0, 4))
    return _element(14, b"".join(parts), order, dice)


def _mat_4(name: str, column: np.ndarray, dice: random.Random) -> bytes:
    code = dice.choice([0] * 60 + [10, 20, 50, 60, 1, 2, 1000, 2000, -1, 4999, 2**31 - 1])
    rows, wide = dice.choice(
        [(len(column), 1)] * 60 + [(1, len(column)), (-1, -1), (2**31 - 1, 2**31 - 1), (0, 0), (len(column), 3)]
    )
    raw = name.encode("utf-8", "surrogatepass") + b"\0"
    length = dice.choice([len(raw)] * 60 + [0, -1, 2**31 - 1, len(raw) + 7])
    return (
        struct.pack("<5i", code, rows, wide, dice.choice([0] * 30 + [1]), length) + raw + column.astype("<f8").tobytes()
    )


WRITERS: dict[str, Callable[[Columns, random.Random], bytes]] = {".csv": csv, ".npy": npy, ".npz": npz, ".mat": mat}


def damaged_bytes(data: bytes, dice: random.Random) -> bytes:
    """Bytes anew, cut off, doubled or swapped; most of them near the start, where headers are."""
    damaged = bytearray(data)
    for _ in range(dice.choice([1, 1, 2, 8])):
        if not damaged:
            break
        at = dice.randrange(min(len(damaged), dice.choice([8, 128, 300, len(damaged)])))
        match dice.randrange(5):
            case 0:
                damaged[at] = dice.randrange(256)
            case 1:
                damaged[at] ^= 1 << dice.randrange(8)
            case 2:
                del damaged[at : at + dice.choice([1, 4, 100])]
            case 3:
                damaged[at:at] = bytes(dice.randrange(256) for _ in range(dice.choice([1, 4, 8])))
            case _:
                del damaged[dice.randrange(len(damaged)) :]
    return bytes(damaged)
