"""Text tables: each is read as it was written, or refused; none is read in another way."""

from collections import Counter
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np
import pytest

from chipglow.text import TableError, read_matrix, read_named_table

SEED = 20_240_517
NUMBER_OF_TABLES = 1200

ROWS = (
    (20.25, 22.25, 24.5, 26.0),
    (20.75, 22.5, 24.75, 27.0),
    (21.25, 23.0, 25.25, 27.5),
    (21.5, 23.75, 26.0, 29.25),
)


def text_of(rows=ROWS, separator=";", decimal=","):
    lines = [separator.join(f"{value:.2f}".replace(".", decimal) for value in row) for row in rows]
    return "\n".join(lines) + "\n"


def with_cell(cell, row=0, column=0):
    lines = [line.split(";") for line in text_of().splitlines()]
    lines[row][column] = cell
    return "\n".join(";".join(line) for line in lines) + "\n"


def matrix_of(path, text, encoding="utf-8"):
    path.write_bytes(text.encode(encoding))
    return read_matrix(path)


def points_of(header=""):
    lines = [f"{x};{y};{value:.2f}\n" for y, row in enumerate(ROWS) for x, value in enumerate(row)]
    return header + "".join(lines).replace(".", ",")


NAMED = "Y/X;0;1;2;3\n" + "".join(
    f"{number};{line}\n" for number, line in enumerate(text_of().splitlines())
)
"""A first row and column of indices."""

READ = {
    "decimal comma": (text_of(), ""),
    "decimal comma, blanks": (text_of(separator="  "), ""),
    "tabs": (text_of(separator="\t", decimal="."), ""),
    "commas and blanks": (text_of(separator=", ", decimal="."), ""),
    "whole numbers in the first lines": (
        text_of().replace(",00", "").replace(",50", ",5"), ""
    ),
    "separators at line ends": (text_of().replace("\n", ";\n"), "All rows end with a separator"),
    "separators at line starts": (
        "".join(f";{line}\n" for line in text_of().splitlines()), "All rows begin with a separator"
    ),
    "statistics below": (text_of() + "\nMin;20,25\nMax;29,25\n", "lines 6 to 7"),
    "text above": ("Emissivity;0,95\nRefl. temp;20,0 °C\n\n" + text_of(), "lines 1 to 2"),
    "a spreadsheet's text above": ("Emissivity;0,95;;\n;;;\n" + text_of(), "line 1"),
    "indices": (NAMED, "The first column counts"),
    "indices, empty corner": (NAMED.replace("Y/X", ""), "The first row counts"),
    "indices, counted corner": (NAMED.replace("Y/X", "0"), "The first row counts"),
    "indices of rows": (NAMED.partition("\n")[2], "The first column counts"),
    "indices of columns": ("1;2;3;4\n" + text_of(), "The first row counts"),
    "names of columns": ("a;b;c;d\n" + text_of(), "line 1"),
    "no end of the last line": (text_of()[:-1], ""),
    "minus as in books": (text_of().replace("20,25", "\u221220,25"), "", -20.25),
    "quotes": (
        "".join(f'"{line}"\n'.replace(";", '";"') for line in text_of().splitlines()), ""
    ),
    "quoted decimal comma between commas": (
        "".join(f'"{line}"\n'.replace(";", '","') for line in text_of().splitlines()), ""
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", READ)
def test_a_table_of_this_kind_is_read(tmp_path, name):
    text, note, *first = READ[name]
    matrix = matrix_of(tmp_path / "t.csv", text)
    expected = np.array(ROWS)
    expected[0, 0] = first[0] if first else expected[0, 0]
    np.testing.assert_array_equal(matrix.values, expected[None])
    assert note in " ".join(matrix.notes.remarks)
    assert bool(note) == bool(matrix.notes.remarks)


@pytest.mark.parametrize("cell", ["<-20", "> 350,5", "---", "***", "", "n/a", "####", "#N/A"])
@pytest.mark.parametrize(("row", "column"), [(0, 0), (0, 3), (2, 1), (3, 3)])
def test_a_cell_without_a_number_is_missing(tmp_path, cell, row, column):
    matrix = matrix_of(tmp_path / "t.csv", with_cell(cell, row, column))
    expected = np.array(ROWS)
    expected[row, column] = np.nan
    np.testing.assert_array_equal(matrix.values, expected[None])
    place = f"'{cell}' in line {row + 1}, column {column + 1}"
    assert any(place in remark for remark in matrix.notes.remarks)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\r\r\n"])
def test_encodings_and_ends_of_lines(tmp_path, encoding, end):
    text = ("Temperature;20,0 °C\n" + text_of()).replace("\n", end)
    np.testing.assert_array_equal(matrix_of(tmp_path / "t.csv", text, encoding).values[0], ROWS)


def test_a_corner_without_a_number_is_no_missing_value(tmp_path):
    notes = matrix_of(tmp_path / "t.csv", NAMED.replace("Y/X", "")).notes
    assert not any("without a number" in text for text in notes.remarks)


@pytest.mark.parametrize("between", ["\n", "Frame 2\n", "\nFrame 2;0,02 s\n\n"])
def test_lines_without_numbers_separate_frames(tmp_path, between):
    later = np.array(ROWS) + 10
    matrix = matrix_of(tmp_path / "t.csv", text_of() + between + text_of(later))
    np.testing.assert_array_equal(matrix.values, [ROWS, later])
    assert "2 frames" in matrix.notes.remarks[-1]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1,5 1,234\n2,5 950,0\n", [[1.5, 1.234], [2.5, 950.0]]),
        ("1,234.5;950\n1,100;1,200\n", [[1234.5, 950.0], [1100.0, 1200.0]]),
        ("1,234,567;950\n1,100;1,200\n", [[1234567.0, 950.0], [1100.0, 1200.0]]),
        ("0,950;1,234\n1,100;1,200\n", [[0.95, 1.234], [1.1, 1.2]]),
        ("Emissivity;0,95;;\n1,234;1,100;1,3\n1,200;1,1;2,0\n", [[1.234, 1.1, 1.3], [1.2, 1.1, 2]]),
        ("1.234,5;950\n1.100;1.200\n", [[1234.5, 950.0], [1100.0, 1200.0]]),
        ("1'234.5;950\n1’100;1'200\n".replace("’", "'"), [[1234.5, 950.0], [1100.0, 1200.0]]),
        ("1 234,5;950\n1 100;1 200\n", [[1234.5, 950.0], [1100.0, 1200.0]]),
        ("1\u00a0234,5;950\n1\u00a0100;1\u00a0200\n", [[1234.5, 950.0], [1100.0, 1200.0]]),
        ("20,25 222,25\n20,50 333,50\n", [[20.25, 222.25], [20.5, 333.5]]),
        ('"1,234.50","950.00"\n"1,100.00","1,200.00"\n', [[1234.5, 950.0], [1100.0, 1200.0]]),
        ("1e3,2.5E-1\n-4.,+.5\n", [[1000.0, 0.25], [-4.0, 0.5]]),
    ],
)
def test_the_whole_file_decides_on_marks(tmp_path, text, expected):
    np.testing.assert_array_equal(matrix_of(tmp_path / "t.csv", text).values[0], expected)


def test_three_decimals_everywhere_are_noted(tmp_path):
    matrix = matrix_of(tmp_path / "t.csv", "20.123;21.456\n22.789;23.012\n")
    np.testing.assert_array_equal(matrix.values[0], [[20.123, 21.456], [22.789, 23.012]])
    assert matrix.notes.assumed == [
        "'.' is the decimal mark: each number has three digits after it."
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "there is no number in it"),
        ("20,25\n21,50 C\n", "line 2"),
        ("a b\nc d\n", "line 1, column 1: 'a' is not a number"),
        ("1,234;1,100\n1,200;1,300\n", "line 1, column 1: '1,234': ',' may be the decimal mark"),
        ("1.234;950\n1.200;1.300\n", "'.' may be the decimal mark"),
        (with_cell("20.25", 2, 1), "line 3, column 2: '20.25': no decimal mark fits all"),
        (with_cell("hot", 2, 1), "line 3, column 2: 'hot' is not a number"),
        (with_cell("hot"), "line 1, column 1: 'hot' is not a number"),
        (with_cell("inf", 3, 3), "line 4, column 4: 'inf' is not a number"),
        (with_cell("1,2,3", 3, 3), "line 4, column 4: '1,2,3' is not a number"),
        (text_of()[:-8], "line 4: has 3 cells, expected 4; the file may be truncated"),
        (text_of() + "20,25;29,25\n", "line 5: has 2 cells, expected 4"),
        ("640;512\n" + text_of(), "line 1: has 2 cells, expected 4"),
        ("640;512;;\n" + text_of(), "line 1, column 4: the last cells are empty"),
        (text_of() + ";;;\n", "line 5: all cells are empty"),
        (";;;\n" + text_of(), "line 1: all cells are empty"),
        (text_of() + "\n" + text_of(ROWS[:3]), "line 6: 3 rows follow, but 4 at line 1"),
        (text_of().replace("\n", "\n\n"), "line 3: each row is followed by a line without"),
        (text_of() + "Mean;21;23;25\n", "line 5, column 1: 'Mean' is not a number"),
        ("0;1;2;3\n5;7;9;8\n6;3;2;8\n4;8;1;7\n", "line 1, column 1: the first row counts"),
        ("1;7;9\n2;3;2\n3;8;1\n", "the first column counts (1, 2, 3, ...)"),
        ("120;7;9\n121;3;2\n122;8;1\n123;4;4\n", "the first column counts (120, 121, 122"),
        ("0,5;7;9\n1,0;3;2\n1,5;8;1\n2,0;4;4\n2,5;4;6\n3,0;1;5\n", "has equal steps"),
        ("Y;0;1;2\n5,1;7,2;9,3;1,5\n6,2;3,1;2,2;4,2\n", "the columns are numbered"),
        ("20,05,22,75\n21,25,23,50\n", "column 2: '05' begins with 0"),
        ("9,25,22,75\n21,25,23,50\n", "every second number may be the end of the one before"),
        ("1 050 1 100\n1 200 1 250\n", "column 2: '050' begins with 0"),
        ("20,25,20,75,\n21,25,21,75,\n", "every second number"),
        ('"8 783","2 577"\n"4 979","9 399"\n20,1200\n', "line 1, column 1: '8 783' is not"),
        ("950,1.383\n961,1.086\n", "'.' may be the decimal mark"),
        ("20\0,21\n", "is not text"),
        ("1e999,2,3\n3,4,5\n", "a number is too large"),
        (points_of("x;y;T\n"), "line 2: each line is a point with its coordinates in columns 1"),
        (points_of(), "line 1: each line is a point"),
        (text_of().replace(";", " °C;"), "line 1, column 1: '20,25 °C' is not a number"),
    ],
)  # fmt: skip
def test_a_table_that_can_be_misread_is_refused(tmp_path, text, said):
    with pytest.raises(TableError) as caught:
        matrix_of(tmp_path / "t.csv", text)
    assert said in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "t.csv"))


def test_columns_by_name(tmp_path):
    path = tmp_path / "p.txt"
    path.write_bytes("# °C\nx [mm];T (°C);\n1,5;<-20;\n\n2;1.021,5;\n".encode("cp1252"))
    table = read_named_table(path)
    columns, wrong = table.columns()
    assert table.names == ("x [mm]", "T (°C)")
    assert [line for line, _ in table.rows] == [3, 5]
    np.testing.assert_array_equal(columns, [[1.5, 2.0], [np.nan, 1021.5]])
    assert wrong == {}
    assert "'<-20' in line 3, column 2" in table.notes.remarks[-1]


# A writer that varies everything


@dataclass(frozen=True)
class Style:
    """How a table is written."""

    separator: str
    decimal: str
    thousands: str
    quoted: bool
    decimals: str
    header: str
    indices: str
    encoding: str
    end: str
    missing: str
    frames: int
    between: str
    trailing: str
    below: str
    values: str

    CHOICES: ClassVar = {
        "separator": [";", "\t", ",", " ", "|"],
        "decimal": [".", ","],
        "thousands": ["", "", "", ",", ".", "'", " ", "\u00a0"],
        "quoted": [False, False, False, True],
        "decimals": ["0", "1", "2", "2", "3", "shortest"],
        "header": ["", "", "metadata", "padded", "comment", "names"],
        "indices": ["", "", "", "both", "empty corner", "rows", "columns"],
        "encoding": ["utf-8", "utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le", "utf-16-be"],
        "end": ["\n", "\r\n", "\r", "\r\r\n"],
        "missing": [None, None, None, "", "---", "<-20", "***", "nan", "hot"],
        "frames": [1, 1, 1, 3],
        "between": ["", "Frame"],
        "trailing": ["no", "no", "no", "all"],
        "below": ["", "", "statistics", "padded statistics", "numbers"],
        "values": ["room", "hot", "counts", "ramp", "offset ramp"],
    }  # fmt: skip

    @classmethod
    def draw(cls, rng):
        return cls(**{name: every[rng.integers(len(every))] for name, every in cls.CHOICES.items()})

    @property
    def is_plain(self):
        """Whether there is one way to read the table: it must not be refused."""
        return (
            self.separator in ";\t|"
            and self.decimals in ("1", "2", "shortest")
            and self.values in ("room", "hot")
            and self.missing != "hot"
            and self.below != "numbers"
            and not (self.missing == "" and self.trailing == "all")
            and not (self.indices in ("rows", "columns") and self.decimals == "shortest")
        )

    def number(self, value):
        """The number as written, and its value."""
        plain = f"{value:.2f}".rstrip("0").rstrip(".") if self.decimals == "shortest" else (
            f"{value:.{self.decimals}f}"
        )  # fmt: skip
        whole, _, fraction = plain.partition(".")
        if self.thousands and self.thousands != self.decimal:
            whole = f"{int(whole):,}".replace(",", self.thousands)
        return whole + (self.decimal + fraction if fraction else ""), float(plain)

    def row(self, cells):
        cells = [f'"{cell}"' if self.quoted else cell for cell in cells]
        return self.separator.join(cells) + self.separator * (self.trailing == "all")

    def write(self, rng):
        """Return a text and the values in it."""
        shape = (self.frames, int(rng.integers(4, 9)), int(rng.integers(4, 9)))
        values = {
            "room": 15 + 20 * rng.random(shape),
            "hot": 300 + 1200 * rng.random(shape),
            "counts": np.floor(2000 + 12000 * rng.random(shape)),
            "ramp": np.arange(np.prod(shape), dtype=float).reshape(shape),
            "offset ramp": 20.25 + 0.5 * np.arange(np.prod(shape)).reshape(shape),
        }[self.values]
        lost = None if self.missing is None else tuple(rng.integers(shape))
        lines, true = [], np.empty(shape)
        padding = [""] * (shape[2] - 2)
        text = {
            "metadata": ["File;IR 1.jpg", f"Emissivity: 0{self.decimal}95", "T = 20 °C", ""],
            "padded": [self.separator.join(["Emissivity", f"0{self.decimal}95", *padding])],
            "comment": ["# temperature in °C"],
        }
        lines += text.get(self.header, [])
        for frame in range(shape[0]):
            if frame:
                lines += ["", self.between + f" {frame}"] if self.between else [""]
            if self.indices in ("both", "empty corner"):
                corner = "Y/X" if self.indices == "both" else ""
                lines.append(self.row([corner, *map(str, range(shape[2]))]))
            elif self.indices == "columns":
                lines.append(self.row(list(map(str, range(1, shape[2] + 1)))))
            elif self.header == "names":
                names = [f"c{number}" for number in range(shape[2] + (self.indices == "rows"))]
                lines.append(self.row(names))
            for row in range(shape[1]):
                cells = [str(row)] if self.indices in ("both", "empty corner", "rows") else []
                for column in range(shape[2]):
                    cell, true[frame, row, column] = self.number(values[frame, row, column])
                    if (frame, row, column) == lost:
                        cell, true[frame, row, column] = self.missing, np.nan
                    cells.append(cell)
                lines.append(self.row(cells))
        lines += {
            "statistics": ["", f"Min{self.separator}20{self.decimal}2"],
            "padded statistics": [self.separator.join(["Max", f"20{self.decimal}2", *padding])],
            "numbers": ["", self.row(["20", "1200"])],
        }.get(self.below, [])
        return self.end.join(lines) + self.end, true


def outcome_of(path, style, rng):
    """Return whether a table is read right, refused or read wrong, without or with a note."""
    text, true = style.write(rng)
    path.write_bytes(text.encode(style.encoding))
    try:
        matrix = read_matrix(path)
    except TableError as error:
        assert str(error).startswith(f"{path}")
        return "refused"
    read = matrix.values
    same = read.shape == true.shape and np.array_equal(read, true, equal_nan=True)
    if same:
        return "right"
    return "assumed in a note" if matrix.notes.assumed else "wrong"


def test_no_table_is_read_in_another_way_than_it_was_written(tmp_path):
    rng = np.random.default_rng(SEED)
    counts, tried, failed = Counter(), Counter(), []
    for _ in range(NUMBER_OF_TABLES):
        style = Style.draw(rng)
        outcome = outcome_of(tmp_path / "t.csv", style, rng)
        counts[outcome] += 1
        tried.update((field.name, getattr(style, field.name)) for field in fields(style))
        if outcome == "wrong" or (outcome == "refused" and style.is_plain):
            failed.append((style, (tmp_path / "t.csv").read_bytes()[:400]))
    print(", ".join(f"{name} {count}" for name, count in sorted(counts.items())))
    assert not failed, failed[0]
    for name, choices in Style.CHOICES.items():
        assert all(tried[name, choice] >= 20 for choice in choices)
