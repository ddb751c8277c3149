"""The order of files by their names: as the names state it, or refused."""

import random

import pytest

from chipglow.io.sources import SourceError
from chipglow.io.sources.file_names import files_of

IN_ORDER = [
    ["img_1", "img_2", "img_10"],
    ["img_001", "img_002", "img_010"],
    ["img-1", "img-2", "img-10"],
    ["1", "2", "10"],
    ["-2", "-1", "0", "1"],
    ["img_-2", "img_-1", "img_0", "img_1"],
    ["img_-10", "img_-9", "img_+1", "img_+2"],
    ["img-2", "img-1", "img0", "img1"],
    ["img--2", "img--1", "img-0", "img-1"],
    ["T_0.1", "T_0.15", "T_0.2"],
    ["T_9.5", "T_10.0", "T_10.5"],
    ["t=-0.5", "t=-0.25", "t=0.5"],
    ["T_1e-05", "T_2e-05", "T_1e-04"],
    ["T_2.5e-05", "T_1e-04", "T_0.001"],
    ["T_-1e-3", "T_0", "T_1e-3"],
    ["T_9e5", "T_1e6"],
    ["run7_frame9", "run7_frame10"],
    ["IMG_9", "img_10"],
    ["f0001_t0.1", "f0002_t0.2", "f0010_t1.0"],
    ["Rec_2024-07-31_23-59-59", "Rec_2024-08-01_00-00-00"],
    ["Rec_20240731_235959", "Rec_20240801_000000"],
    ["2024-08-23T14.29.58.900", "2024-08-23T14.29.59.010", "2024-08-23T14.30.00.000"],
    ["20240823142958", "20240823143000"],
    ["2024_9", "2024_10"],
    ["a 1 b", "a 2 b", "a 11 b"],
]

NOT_STATED = {
    "words": (["cold", "hot"], "differ in more than the numbers"),
    "a name without number": (["img", "img_1", "img_2"], "differ in more than the numbers"),
    "a copy": (["img_1", "img_1 (1)"], "differ in more than the numbers"),
    "hexadecimal": (["f_0009", "f_000a", "f_000b"], "differ in more than the numbers"),
    "two series": (["cam_1", "dark_1"], "differ in more than the numbers"),
    "same number": (["img_1", "img_01"], "have the same number"),
    "same decimal": (["t_0.50", "t_0.5", "t_1.0"], "may separate two numbers"),
    "same exponent": (["t_1e1", "t_10"], "have the same number"),
    "a product": (["v100_1", "v100_2", "v200_1", "v200_2"], "contradict each other"),
    "speeds before numbers": (["v300_1", "v100_2", "v200_3"], "contradict each other"),
    "day first": (["30-07-2024", "01-08-2024"], "contradict each other"),
    "day first in one": (["30072024", "01082024"], "date with the year last"),
    "month first in one": (["12312023", "01012024"], "date with the year last"),
    "sections": (["s1.9", "s1.10"], "may separate two numbers"),
    "all signs": (["img_-1", "img_-2", "img_-3"], "may be a hyphen"),
    "all signs alone": (["-1", "-2"], "may be a hyphen"),
    "time of day": (["14-58-59", "14-59-30", "15-00-00"], "contradict each other"),
    "checksums": (["f1_93", "f2_17"], "contradict each other"),
    "letters count": (["img_a", "img_b"], "differ in more than the numbers"),
    "number before and after": (["1_img", "img_2"], "differ in more than the numbers"),
    "versions": (["v1.2.9_1", "v1.2.10_0"], "contradict each other"),
}


def made(folder, names):
    """Create files in another order than that of the names."""
    shuffled = random.Random(3).sample(names, len(names))
    for name in shuffled:
        (folder / f"{name}.tif").touch()
    return folder / "*.tif"


@pytest.mark.parametrize("names", IN_ORDER, ids=lambda names: names[0])
def test_numbers_in_names_sort_as_numbers(tmp_path, names):
    assert [file.stem for file in files_of(made(tmp_path, names))] == names


@pytest.mark.parametrize(("names", "reason"), NOT_STATED.values(), ids=NOT_STATED)
def test_names_that_do_not_state_the_order_are_refused(tmp_path, names, reason):
    with pytest.raises(SourceError, match=r"rename the files so that one number") as caught:
        files_of(made(tmp_path, names))
    assert reason in str(caught.value)


def test_files_of_two_kinds_are_not_one_series(tmp_path):
    (tmp_path / "a_1.tif").touch()
    (tmp_path / "a_1.csv").touch()
    with pytest.raises(SourceError, match=r"a_1\.csv and a_1\.tif differ in more"):
        files_of(tmp_path / "a_*")


@pytest.mark.parametrize(
    ("names", "missing"),
    [
        (["a_1", "a_2", "a_4"], "after a_2.tif number 3 is missing"),
        (["a_-2", "a_-1", "a_1"], "after a_-1.tif number 0 is missing"),
        (["a_10", "a_20", "a_40"], "after a_20.tif number 30 is missing"),
        (["a_1", "a_3", "a_5"], None),
        (["a_0.1", "a_0.25", "a_0.3"], None),
        (["20240823142958", "20240823142959", "20240823143000"], None),
    ],
)
def test_a_missing_number_is_named(tmp_path, names, missing):
    pattern = made(tmp_path, names)
    if missing is None:
        assert len(files_of(pattern, gaps_allowed=False)) == len(names)
        return
    with pytest.raises(SourceError, match=missing):
        files_of(pattern, gaps_allowed=False)
    assert len(files_of(pattern)) == len(names)
