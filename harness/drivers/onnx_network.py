"""A network in an ONNX file, computed by `harness.drivers.onnx_program` in a process of its own.

The file is data: its weights are read from its folder only, and its process has a deadline for each decision and a
limit of memory. A process that has failed fails its games; the next decision starts a new one.
"""

from __future__ import annotations

import base64
import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from harness.config.driver import Onnx
from harness.drivers.policy_file import ACTIONS
from harness.drivers.running_program import NoAnswer, Program
from harness.errors import DriverError, UsageError
from harness.game.arrays import FloatArray
from harness.game.observation_layout import SIZE
from harness.shipped_documents import PACKAGE


class OnnxNetwork:
    """The function in an ONNX file."""

    def __init__(self, document: Onnx, file: Path) -> None:
        """Load the network. Raises UsageError if it can't be read, does not fit or exceeds a limit."""
        self._document, self._file = document, file
        self._program = self._loaded()

    def __call__(self, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """The output for observations [N, SIZE] and noise [N, 2], all games at once. Raises DriverError if there is
        none within the limits."""
        if not self._program.is_running:
            try:
                self._program = self._loaded()
            except UsageError as error:
                raise DriverError(str(error)) from None
        head = json.dumps({"type": "decide", "games": len(observation)}).encode() + b"\n"
        seen, drawn = observation.astype(np.float32, copy=False), noise.astype(np.float64, copy=False)
        try:
            answer = _answer(self._program, self._document.deadline_s, head + seen.tobytes() + drawn.tobytes())
        except NoAnswer as error:
            remedy = "export a network that takes less time and memory, or raise `deadline_s`"
            raise DriverError(f"{self._file.name} {error} ({remedy})") from None
        if "decided" not in answer:
            raise DriverError(f"{self._file.name} {answer['error']}")
        return np.frombuffer(base64.b64decode(answer["decided"]), answer["dtype"]).reshape(answer["shape"])

    def _loaded(self) -> Program:
        program = _started(self._document, self._file)
        _read(program, self._document, self._file, "load")
        return program


def external_files(document: Onnx, file: Path) -> list[Path]:
    """The files of an ONNX file's weights outside it, each once. Raises UsageError as `OnnxNetwork` does, and for one
    that is missing, or outside the folder of the ONNX file."""
    program = _started(document, file)
    try:
        return [file.parent / name for name in _read(program, document, file, "files")["files"]]
    finally:
        program.close()


def _started(document: Onnx, file: Path) -> Program:
    names = {"input": document.input, "output": document.output}
    spec = json.dumps({"file": os.path.abspath(file), "shapes": [SIZE, ACTIONS], **names})
    return Program([sys.executable, "-m", "harness.drivers.onnx_program", spec], PACKAGE.parent)


def _read(program: Program, document: Onnx, file: Path, message: str) -> dict[str, Any]:
    try:
        answer = _answer(program, document.start_deadline_s, json.dumps({"type": message}).encode() + b"\n")
    except NoAnswer as error:
        remedy = "export a network that takes less time and memory, or raise `start_deadline_s`"
        raise UsageError.of(file, "", f"can't be read: its process {error}", remedy) from None
    if "refused" in answer:
        raise UsageError.of(file, *answer["refused"])
    if "error" in answer:
        raise UsageError.of(file, "", answer["error"], "export it again, with operators of the standard only")
    return answer


def _answer(program: Program, deadline_s: float, message: bytes) -> dict[str, Any]:
    """Raises NoAnswer, with the end of its standard error, if the program gives none; the program is ended."""
    try:
        return dict(json.loads(program.request(message, deadline_s)))
    except NoAnswer as error:
        tail = program.stderr_tail()
        program.close()
        raise NoAnswer(f"{error}; on its standard error: {tail}" if tail else str(error)) from None
