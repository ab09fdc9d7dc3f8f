"""Excel workbooks: the same numbers as a text table, and damaged or hostile files that end in BadInput.

The workbooks are written here, part by part; those of openpyxl and XlsxWriter were read alike.
"""

from __future__ import annotations

import time
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slider_log import rows

from codegen.base.errors import BadInput
from codegen.logs import read_log
from codegen.logs.description import EMPTY_DESCRIPTION
from codegen.logs.formats import source
from codegen.logs.formats.source import Allowance
from codegen.logs.formats.xlsx_file import open_xlsx
from tests.expected_errors import matches

MADE = rows(duration=4.0)
HEAD = '<?xml version="1.0"?>\n'
DAY = 46085.75  # 2026-03-04 18:00


def cell(at: str, value: Any) -> str:
    """A cell; a text as an inline string."""
    if isinstance(value, str):
        return f'<c r="{at}" t="inlineStr"><is><t>{value}</t></is></c>'
    return f'<c r="{at}"><v>{value!r}</v></c>'


def sheet(*lines: str) -> str:
    return f"{HEAD}<worksheet><sheetData>{''.join(lines)}</sheetData></worksheet>"


def line(number: int, *values: Any, first: str = "A") -> str:
    """A row with these cells from a column on; None for an empty one."""
    cells = (cell(f"{chr(ord(first) + k)}{number}", v) for k, v in enumerate(values) if v is not None)
    return f'<row r="{number}">{"".join(cells)}</row>'


def write_workbook(
    path: Path, sheets: dict[str, str], parts: dict[str, str] | None = None, method: int = zipfile.ZIP_DEFLATED
) -> Path:
    """A workbook of sheets (name → XML); ``parts``: further ones, or in place of these."""
    names = "".join(f'<sheet name="{name}" r:id="rId{k}"/>' for k, name in enumerate(sheets))
    kind = "http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet"
    targets = "".join(
        f'<Relationship Id="rId{k}" Type="{kind}" Target="worksheets/s{k}.xml"/>' for k in range(len(sheets))
    )
    made = {
        "xl/workbook.xml": f"{HEAD}<workbook><sheets>{names}</sheets></workbook>",
        "xl/_rels/workbook.xml.rels": f"{HEAD}<Relationships>{targets}</Relationships>",
        **{f"xl/worksheets/s{k}.xml": text for k, text in enumerate(sheets.values())},
    }
    with zipfile.ZipFile(path, "w", method) as archive:
        for part, text in (made | (parts or {})).items():
            archive.writestr(part, text)
    return path


def numbers(first: str = "A", begins: int = 1) -> list[str]:
    given = zip(MADE["t"].tolist(), (1e3 * MADE["x"]).tolist(), MADE["w"].tolist(), strict=True)
    return [line(k, *values, first=first) for k, values in enumerate(given, begins)]


def test_a_table_with_units_that_begins_in_the_second_column(tmp_path, spec):
    notes = sheet(line(1, "Rig &quot;3&quot;"))
    table = sheet(line(3, "Time", "x", "w", first="B"), line(4, "s", "mm", None, first="B"), *numbers("B", 5))
    log = read_log(write_workbook(tmp_path / "a.xlsx", {"Notes": notes, "Data": table}), spec)
    np.testing.assert_allclose(log.positions[:, 0], MADE["x"], atol=1e-12)
    np.testing.assert_allclose(log.inputs[:, 0], MADE["w"], atol=1e-12)
    assert "sheet `Data` is read; the others (Notes)" in " ".join(log.notes)


def test_shared_texts_dates_formulas_and_truths(tmp_path, spec):
    shared = (
        f"{HEAD}<sst><si><t>Stamp</t></si><si><r><t>x </t></r><r><t>[mm]</t></r></si><si><t>w</t></si>"
        "<si><t>on</t></si></sst>"
    )
    styles = (
        f'{HEAD}<styleSheet><numFmts><numFmt numFmtId="164" formatCode="dd.mm.yyyy\\ hh:mm:ss.000"/>'
        '<numFmt numFmtId="165" formatCode="0.0 &quot;mm&quot;"/></numFmts><cellStyleXfs><xf numFmtId="14"/>'
        '</cellStyleXfs><cellXfs><xf numFmtId="0"/><xf numFmtId="164"/><xf numFmtId="165"/></cellXfs></styleSheet>'
    )
    head = "".join(f'<c t="s"><v>{k}</v></c>' for k in range(4))
    body = "".join(
        f'<row><c s="1"><v>{DAY + t / 86400!r}</v></c><c s="2"><f>C1*2</f><v>{1e3 * x!r}</v></c><c><v>{w!r}</v></c>'
        '<c t="b"><v>1</v></c></row>'
        for t, x, w in zip(MADE["t"].tolist(), MADE["x"].tolist(), MADE["w"].tolist(), strict=True)
    )
    parts = {"xl/sharedStrings.xml": shared, "xl/styles.xml": styles}
    path = write_workbook(tmp_path / "a.xlsm", {"Data": sheet(f"<row>{head}</row>", body)}, parts)
    log = read_log(path, spec, columns={"x": "x [mm]"})
    assert log.sample_time == pytest.approx(0.002, rel=1e-6)
    np.testing.assert_allclose(log.positions[:, 0], MADE["x"], atol=1e-6)  # of times rounded to 1 us
    assert read_log(path, spec, columns={"x": "x [mm]", "w": "w*on"}).size == log.size


def test_cells_as_excel_means_them(tmp_path):
    """Formats with spaces as wide as a letter, errors, cells without a place, how a text is pronounced."""
    styles = (
        f'{HEAD}<styleSheet><numFmts><numFmt numFmtId="164" formatCode="_-* #,##0.00\\ _D_M_-;0.0*d"/></numFmts>'
        '<cellXfs><xf numFmtId="0"/><xf numFmtId="164"/></cellXfs></styleSheet>'
    )
    shared = "<sst><si><t>\u4f4d\u7f6e</t><rPh><t>\u30a4\u30c1</t></rPh><phoneticPr/></si></sst>"
    head = '<row><c t="str"><v>t</v></c><c/><c t="s"><v>0</v></c><c t="str"><v>on</v></c></row>'
    body = (
        f'<row><c><v>{k * 0.1!r}</v></c><c/><c s="1"><v>{x}</v></c><c t="{kind}"><v>{on}</v></c></row>'
        for k, (x, kind, on) in enumerate([("1.125", "b", "true"), ("2", "b", "0"), ("-3.375", "e", "#NUM!")] * 3)
    )
    parts = {"xl/sharedStrings.xml": f"{HEAD}{shared}", "xl/styles.xml": styles}
    path = write_workbook(tmp_path / "a.xlsx", {"Data": sheet(head, *body)}, parts)
    source = open_xlsx(path, Allowance(), EMPTY_DESCRIPTION)
    assert source.names == ("t", "2", "\u4f4d\u7f6e", "on")
    values = source.load(["t", "\u4f4d\u7f6e", "on"]).values
    np.testing.assert_allclose(values[:, 0], 0.1 * np.arange(9))
    np.testing.assert_array_equal(values[:, 1], [1.125, 2, -3.375] * 3)
    np.testing.assert_array_equal(values[:, 2], [1, 0, np.nan] * 3)


def test_numbers_in_texts_may_have_thousands(tmp_path, spec):
    table = sheet(line(1, "t", "x", "w"), *(line(k + 2, 0.1 * k, ["1.234", "2", "3"][k % 3], 1) for k in range(9)))
    source = open_xlsx(write_workbook(tmp_path / "a.xlsx", {"Data": table}), Allowance(), EMPTY_DESCRIPTION)
    with pytest.raises(BadInput) as told:
        source.load(["x"])
    assert matches(told.value, "LOG005 a.xlsx:2: `1.234` `2`")


def test_one_of_several_sheets(tmp_path, spec):
    table = sheet(line(1, "t", "x", "w"), *numbers(begins=2))
    path = write_workbook(tmp_path / "a.xlsx", {"Run 1": table, "Run 2": table.replace("<v>0.0</v>", "<v>0</v>")})
    with pytest.raises(BadInput) as told:
        read_log(path, spec)
    assert matches(told.value, "LOG001 a.xlsx: 2 `records: NAME` Run 1, Run 2")
    (tmp_path / "meta.yaml").write_text("records: Run 2\n")
    assert read_log(path, spec).size == len(MADE["t"])
    (tmp_path / "meta.yaml").write_text("records: Run 3\n")
    with pytest.raises(BadInput) as told:
        read_log(path, spec)
    assert matches(told.value, "LOG001 a.xlsx: `Run 3` Run 1, Run 2")


BOMB = '<!DOCTYPE x [<!ENTITY a "0123456789"><!ENTITY b "&a;&a;&a;&a;&a;&a;">]>'
TABLE = sheet(line(1, "t", "x", "w"), line(2, 0, 1, 2), line(3, 1, 1, 2))
HOSTILE = {
    "entities": (
        {"xl/worksheets/s0.xml": TABLE.replace("<worksheet>", f"{BOMB}<worksheet>")},
        "LOG001 type declaration",
    ),
    "no XML": ({"xl/worksheets/s0.xml": "t,x,w"}, "LOG001 damaged"),
    "a part that is cut off": ({"xl/worksheets/s0.xml": TABLE[:-40]}, "LOG001 damaged"),
    "no list of sheets": ({"xl/_rels/workbook.xml.rels": "<a/>"}, "LOG001 0 sheets"),
    "a row far below": ({"xl/worksheets/s0.xml": TABLE.replace('row r="3"', 'row r="2000000000"')}, "LOG001 row"),
    "a row again": ({"xl/worksheets/s0.xml": TABLE.replace('row r="3"', 'row r="2"')}, "LOG001 row 2"),
    "a column far to the right": ({"xl/worksheets/s0.xml": TABLE.replace('"B2"', '"ZZZ2"')}, "LOG001 column 18278"),
    "a text that is not there": (
        {"xl/worksheets/s0.xml": TABLE.replace('<c r="B2">', '<c r="B2" t="s">')},
        "LOG001 IndexError",
    ),
    "a text before the first": (
        {
            "xl/worksheets/s0.xml": TABLE.replace('<c r="B2"><v>1<', '<c r="B2" t="s"><v>-1<'),
            "xl/sharedStrings.xml": "<sst><si><t>7</t></si></sst>",
        },
        "LOG001 text -1",
    ),
    "a comment that is read anew for each piece": (
        {"xl/worksheets/s0.xml": TABLE.replace("<sheetData>", f"<!--{'x' * 5_000_000}--><sheetData>")},
        "LOG001 1000000",
    ),
    "a tag of several megabytes": (
        {"xl/worksheets/s0.xml": TABLE.replace("<sheetData>", f'<sheetData a="{"x" * 5_000_000}">')},
        "LOG001 1000000",
    ),
    "elements nested a million deep": ({"xl/worksheets/s0.xml": "<a>" * 1_000_000}, "LOG001 nested 100"),
    "bzip2, which unpacks a few bytes to megabytes": ({}, "LOG001 compression"),
    "a year far off": (
        {
            "xl/worksheets/s0.xml": TABLE.replace('<c r="B2"><v>1<', '<c r="B2" s="0"><v>1e300<'),
            "xl/styles.xml": '<s><cellXfs><xf numFmtId="14"/></cellXfs></s>',
        },
        "LOG001 damaged",
    ),
}


@pytest.mark.parametrize("case", HOSTILE)
def test_hostile(tmp_path, spec, case):
    parts, words = HOSTILE[case]
    method = zipfile.ZIP_BZIP2 if "bzip2" in case else zipfile.ZIP_DEFLATED
    path = write_workbook(tmp_path / "a.xlsx", {"Data": TABLE}, parts, method)
    with pytest.raises(BadInput) as told:
        read_log(path, spec)
    assert matches(told.value, words), told.value


def test_too_large_when_unpacked(tmp_path, spec, monkeypatch):
    """Its parts, and lines that one long text in every cell makes long."""
    monkeypatch.setattr(source, "LARGEST", 100_000)
    path = write_workbook(tmp_path / "a.xlsx", {"Data": TABLE + " " * 100_000})
    with pytest.raises(BadInput) as told:
        read_log(path, spec)
    assert matches(told.value, "LOG010 a.xlsx 100000")
    for part in ("xl/styles.xml", "xl/workbook.xml"):
        write_workbook(path, {"Data": TABLE}, {part: "<a>" + " " * 20_000 + "</a>"})
        with pytest.raises(BadInput) as told:
            read_log(path, spec)
        assert matches(told.value, "LOG010 a.xlsx 100000")
    shared = f"<sst><si><t>{'x' * 5000}</t></si></sst>"
    write_workbook(path, {"Data": sheet(*[line(k, *["x" * 500] * 3) for k in range(1, 21)])})
    with pytest.raises(BadInput) as told:  # 32 kB, whose 30 kB of text are held in several copies
        read_log(path, spec)
    assert matches(told.value, "LOG010 a.xlsx 100000")
    many = sheet(*["<row>" + '<c t="s"><v>0</v></c>' * 50 + "</row>"] * 20)
    write_workbook(path, {"Data": many}, {"xl/sharedStrings.xml": shared})
    with pytest.raises(BadInput) as told:
        read_log(path, spec)
    assert matches(told.value, "LOG010 a.xlsx 100000")


def test_time_of_reading_is_linear(tmp_path, spec):
    """A format of 200 kB took 23 s, and 60000 rows with a cell at the right end of the sheet 48 s."""
    begun = time.process_time()
    table = sheet(line(1, "t", "x", "w"), *numbers(begins=2))
    styles = f'<s><numFmt numFmtId="170" formatCode="{"[" * 200_000}"/></s>'
    assert read_log(write_workbook(tmp_path / "a.xlsx", {"Data": table}, {"xl/styles.xml": styles}), spec).size
    sparse = sheet(*(f'<row><c r="XFD{k}"><v>1</v></c></row>' for k in range(30_000)))
    with pytest.raises(BadInput):
        read_log(write_workbook(tmp_path / "b.xlsx", {"Data": sparse}), spec)
    assert time.process_time() - begun < 8


@pytest.mark.parametrize("share", [0.2, 0.6, 0.95])
def test_cut_off(tmp_path, spec, share):
    data = write_workbook(tmp_path / "a.xlsx", {"Data": TABLE}).read_bytes()
    (tmp_path / "a.xlsx").write_bytes(data[: int(share * len(data))])
    with pytest.raises(BadInput) as told:
        read_log(tmp_path / "a.xlsx", spec)
    assert matches(told.value, "LOG001 a.xlsx damaged")
