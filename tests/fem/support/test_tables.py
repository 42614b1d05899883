"""Tables in text files: units of the header become SI, and what could be read wrongly is refused with its line."""

import re

import numpy as np
import pytest
from paper_gears import paper_pair

import exugear
import fem
from fem.units import rpm, um

HEADER = "torque [N m], phase [1], te [um]\n"


def written(folder, text: str):
    path = folder / "table.csv"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("separator", [",", " ; ", "\t", "   "])
def test_columns_become_si_in_any_order_and_with_any_separator(tmp_path, separator):
    rows = [["te [µm]", "torque [kN m]", "phase [%]"], ["12.5", "0.35", "25"], ["-1e1", "0", "25"]]
    path = written(tmp_path, "# measured on a rig\n\n" + "\n".join(separator.join(row) for row in rows))
    table = fem.ste_from_table(path, paper_pair())
    assert table["te"].values[:, 0] == pytest.approx([-10 * um, 12.5 * um])
    assert table["torque"].values == pytest.approx([0.0, 350.0]) and table["phase"].values == pytest.approx([0.25])


def test_a_header_may_be_a_remark_and_the_text_may_begin_with_a_byte_order_mark(tmp_path):
    curve = exugear.MotorCurve.from_table(written(tmp_path, "\ufeff# torque [kN m] speed [rpm]\r\n0 90\r\n1 60\r\n"))
    assert curve.speed == pytest.approx([60 * rpm, 90 * rpm]) and curve.torque == pytest.approx([1000.0, 0.0])


def test_remarks_with_brackets_are_no_headers_and_quotation_marks_are_dropped(tmp_path):
    text = '# rig 7 [left flank]\n"speed [rpm]","torque [N m]"\n"60","90"\n"120","0"\n# [end]\n'
    curve = exugear.MotorCurve.from_table(written(tmp_path, text))
    assert curve.speed == pytest.approx([60 * rpm, 120 * rpm]) and curve.torque == pytest.approx([90.0, 0.0])


def test_a_grid_is_sorted_whatever_the_order_of_its_lines(tmp_path):
    torque, phase = np.meshgrid([0.0, 10.0, 20.0], [0.0, 0.25, 0.5], indexing="ij")
    te = torque + 1 + phase
    order = np.random.default_rng(0).permutation(9)
    rows = [f"{x} {y} {z}" for x, y, z in zip(*(a.ravel()[order] for a in (torque, phase, te)), strict=True)]
    ste = fem.ste_from_table(written(tmp_path, HEADER + "\n".join(rows)), paper_pair())
    assert ste["torque"].values.tolist() == [0, 10, 20] and ste["phase"].values.tolist() == [0, 0.25, 0.5]
    assert ste["te"].values == pytest.approx(te * um)


REFUSED = {
    "torque, phase [1], te [um]\n0 0 0": "line 1 of .* gives 'torque' no unit; write it in brackets",
    "0, 0, 0\n": "line 1 of .* comes before a header with units; begin with: torque",
    "# nothing\n": "has no header with units; begin with: torque",
    HEADER: "holds no values below its header; add a line",
    HEADER.replace("um", "deg") + "0 0 0": "line 1 of .* gives te in .deg., which must be one of .'m', 'mm'.*; convert",
    HEADER.replace("um", "inch") + "0 0 0": "gives te in .inch., which must be",
    HEADER.replace("um", "") + "0 0 0": r"gives te in \[\], which must be",
    "torque [N m], phase [1]\n0 0": r"lacks the columns \['te'\]; the header must hold",
    HEADER.replace("\n", ", speed [rpm]\n") + "0 0 0 0": r"has the columns \['speed'\], but may have .*; rename",
    "te [m], torque [N m], phase [1], te [um]\n0 0 0 0": "names a column twice",
    HEADER + "0, 0, 0\n1, 0\n": "line 3 of .* holds 2 values for 3 columns",
    HEADER + "0, 0, 0\n\n0,5; 0,1; 1,0\n": "line 4 of .* holds '0,5' for torque; write numbers with a decimal point",
    HEADER + "0,5, 0,1, 1,0\n": "line 2 of .* holds 6 values for 3 columns .*; write numbers with a decimal point",
    HEADER.replace(", ", ";") + "0;1,5;\n": "line 2 of .* holds 2 values for 3 columns",
    HEADER.replace(", ", "\t") + "0\t1,5\t\n": "line 2 of .* holds 2 values for 3 columns",
    HEADER + "0, 0, 0\n1, 0, nan\n": "line 3 of .* holds nan for te, which must be finite; complete or remove",
    HEADER + "0, 0, x\n": "line 2 of .* holds 'x' for te; write numbers",
    HEADER + "0,, 1\n": "line 2 of .* holds '' for phase",
    HEADER + "0, 0, 0\n1, 0, 0\n0.0, 0, 5\n": "lines 2 and 4 of .* give the same point; remove one",
    HEADER + "0, 0, 0\n1, 0.5, 0\n1, 0, 0\n": "lacks 1 of 2 x 2 points of its grid; add .* torque 0 N m, phase 0.5$",
}  # fmt: skip


@pytest.mark.parametrize("text", REFUSED, ids=lambda text: re.sub(r"\W+", " ", text)[:40])
def test_what_could_be_read_wrongly_is_refused(tmp_path, text):
    with pytest.raises(ValueError, match=REFUSED[text]):
        fem.ste_from_table(written(tmp_path, text), paper_pair())


def test_files_that_are_no_tables_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match="does not exist; correct the path"):
        fem.ste_from_table(tmp_path / "none.csv", paper_pair())
    with pytest.raises(ValueError, match="is a folder"):
        fem.ste_from_table(tmp_path, paper_pair())
    (tmp_path / "table.xls").write_bytes(b"\xd0\xcf\x11\xe0")
    with pytest.raises(ValueError, match="is no text in UTF-8"):
        fem.ste_from_table(tmp_path / "table.xls", paper_pair())
