"""What a subprocess that reads a file may answer: data, and no code."""

import io
import os
import pickle
import sys
from dataclasses import fields, is_dataclass
from functools import partial

import numpy as np
import pytest

from chipglow.camera import Recording
from chipglow.camera.recording import PlanckConversion
from chipglow.io.answers import ANSWER, AnswerError, read_answer, write_answer
from chipglow.io.sandbox import Sandbox
from chipglow.io.sources import SourceError, Survey
from chipglow.radiometry import Band, ObjectParameters
from chipglow.scene import SampledFrame
from chipglow.text import Notes

MOST = 10**6
RECORDING = Recording(
    np.arange(24, dtype=">u2").reshape(2, 3, 4),
    "counts",
    np.array([0.0, 1e-6]),
    camera="µ-bolometer",
    pitch=6e-6,
    band=Band(3.8e-6, 5.1e-6),
    position=(np.float64(1.5), -2.0),
    conversion=PlanckConversion(1.0, 2.0, 3.0, 4.0, 5.0),
    object_parameters=ObjectParameters(emissivity=0.9),
    notes=Notes(["a"], ["b"], ["c"]),
)
SURVEY = Survey("mesh", np.zeros(0), (0.0, 1.0, -np.inf, 2.0), {"temperature": "T"}, ("PEEQ",))
FRAME = SampledFrame(
    1e-6, {"temperature": np.full((2, 3), np.nan, np.float32)}, np.ones((2, 3), "u1")
)


def sent(value):
    stream = io.BytesIO()
    write_answer(stream, ANSWER, value)
    stream.seek(0)
    kind, answer = read_answer(stream, MOST)
    assert kind == ANSWER
    assert stream.read() == b""
    return answer


def content(value):
    """Types, numbers and bytes of which a value consists."""
    if isinstance(value, np.ndarray | np.generic):
        return type(value), value.dtype.str, value.shape, value.tobytes()
    if is_dataclass(value):
        return type(value), {one.name: content(getattr(value, one.name)) for one in fields(value)}
    if isinstance(value, list | tuple):
        return type(value), [content(one) for one in value]
    if isinstance(value, dict):
        return {key: content(one) for key, one in value.items()}
    return type(value), value


@pytest.mark.parametrize("value", [RECORDING, SURVEY, FRAME, None, 7, "\ud800 µ", [1, (2.5, None)]])
def test_an_answer_is_what_was_sent(value):
    answer = sent(value)
    assert type(answer) is type(value)
    assert content(answer) == content(value)


def test_what_was_not_given_stays_so():
    declared = RECORDING.declared().keys()
    assert sent(RECORDING).given & declared == RECORDING.given & declared
    assert sent(RECORDING).object_parameters.given == {"emissivity"}


def message(text):
    return len(text).to_bytes(8, "little") + text


@pytest.mark.parametrize(
    "content",
    [
        pickle.dumps(partial(os._exit, 3)),
        message(b'["answer", {"object": ["Popen", {}]}]'),
        message(b'["answer", {"object": ["Survey", {"kind": "mesh"}]}]'),
        message(b'["answer", {"array": ["O", [1], false]}]') + bytes(8),
        message(b'["answer", {"array": ["<f8", [1000000000000], false]}]'),
        message(b'["answer", {"array": ["<f8", [-1], false]}]'),
        message(b'["answer", {"array": ["<f8,O", [1], false]}]'),
        message(b'["answer", {"code": "1"}]'),
        message(b'["run", null]'),
        message(b"[" * 100_000),
        message(b"\xff"),
        (2**62).to_bytes(8, "little"),
    ],
)
def test_bytes_that_are_no_answer_are_refused_before_they_take_memory(content):
    with pytest.raises(AnswerError):
        read_answer(io.BytesIO(content), MOST)


def test_a_message_that_ends_early_is_told_from_a_wrong_one():
    with pytest.raises(EOFError):
        read_answer(io.BytesIO(message(b'["answer", {"array": ["<f8", [2], false]}]')), MOST)


@pytest.mark.skipif(sys.platform == "win32", reason="finds the pipe among the open files of POSIX")
def test_a_reader_that_was_taken_over_runs_no_code_in_the_program(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SourceError, match=r"file: its reader (gave no answer|ended)"):
        Sandbox("file").answer(write_everywhere)
    assert not list(tmp_path.iterdir())


def write_everywhere():
    """Write a pickle that runs code to every pipe, as a reader that a file controls could."""
    for number in range(3, 64):
        try:
            os.write(number, pickle.dumps(partial(os.system, "touch taken-over")))
        except OSError:
            continue
    os._exit(0)
