"""The program that reads an ONNX file and computes its graph, with a limit of memory.

`python -m harness.drivers.onnx_program SPEC`. The process takes at most `MEMORY_BYTES`. Each message is a line of JSON,
and so is each answer:

| message | answer |
| --- | --- |
| `{"type": "files"}` | `{"files": […]}`: the files of the weights outside the model's file, relative to its folder |
| `{"type": "load"}` | `{}` |
| `{"type": "decide", "games": …}` | `{"decided": …, "dtype": …, "shape": […]}`; `decided` in base64 |

The bytes of observation [N, SIZE] (float32) and noise [N, 2] (float64) follow `decide`. Any answer may be
`{"refused": [key, message, remedy]}`, an error of the user, or `{"error": "…"}`.
"""

from __future__ import annotations

import base64
import json
import os
import resource
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from harness.errors import DriverError, UsageError, is_of_memory
from harness.files import MOST_HASHED_BYTES, check_file, leads_out

MEMORY_BYTES = 2_000_000_000
NOISE = "noise"
"""The name of an input of an ONNX file that receives the noise."""
_TOO_MUCH_MEMORY = f"needs more than {MEMORY_BYTES / 1e9:g} GB of memory"
_MOST_CHARACTERS = 500
Run: TypeAlias = Callable[[Any, Any], Any]
"""Outputs for observations [N, SIZE] and noise [N, 2]."""


def main() -> None:
    """Answer messages until the input ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print must not reach the stream of answers
    hard = resource.getrlimit(resource.RLIMIT_DATA)[1]
    least = MEMORY_BYTES if hard == resource.RLIM_INFINITY else min(MEMORY_BYTES, hard)
    resource.setrlimit(resource.RLIMIT_DATA, (least, hard))
    spec = json.loads(sys.argv[1])
    file, run = Path(spec["file"]), None
    for line in sys.stdin.buffer:
        message = json.loads(line)
        answer: dict[str, Any] = {}
        try:
            if message["type"] == "decide":
                assert run is not None, "load is sent first"
                games, (entries, numbers) = message["games"], spec["shapes"]
                seen = np.frombuffer(sys.stdin.buffer.read(4 * games * entries), np.float32).reshape(games, entries)
                noise = np.frombuffer(sys.stdin.buffer.read(8 * games * numbers), np.float64).reshape(games, numbers)
                answer = _decided(run(seen, noise))
            else:
                answer = {"files": external_files(file)}
                if message["type"] == "load":
                    run, answer = _loaded(spec, file), {}
        except UsageError as error:
            (problem,) = error.problems
            answer = {"refused": [problem.key, problem.message, problem.remedy]}
        except Exception as error:  # onnx and ONNX Runtime raise exceptions that have no base of their own
            told = _TOO_MUCH_MEMORY if is_of_memory(error) else " ".join(f"failed: {error}".split())
            answer = {"error": told[:_MOST_CHARACTERS]}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def external_files(file: Path) -> list[str]:
    """The files of an ONNX file's weights outside it, each once, relative to its folder.

    Raises UsageError if the file can't be read, and for one that is missing, too large or outside the folder.
    """
    try:
        import onnx
    except ImportError:
        raise _not_installed(file) from None
    try:
        check_file(file, MOST_HASHED_BYTES)
        model = onnx.load(str(file), format="protobuf", load_external_data=False)
    except Exception as error:
        raise _unreadable(file, error) from None
    names = {
        entry.value
        for tensor in _messages_in(model)
        if isinstance(tensor, onnx.TensorProto) and tensor.data_location == onnx.TensorProto.EXTERNAL
        for entry in tensor.external_data
        if entry.key == "location"
    }
    for name in names:
        what = f"its weights in the file {name!r}"
        try:
            if os.path.isabs(name) or leads_out(file.parent / name, file.parent):
                remedy = "export it again, with the weights beside it"
                raise UsageError.of(file, "", f"{what} are outside its folder", remedy)
            check_file(file.parent / name, MOST_HASHED_BYTES)
        except (OSError, ValueError) as error:  # ValueError: a name that no file can have
            reason = error.strerror if isinstance(error, OSError) else error
            raise UsageError.of(file, "", f"{what} can't be read: {reason}", "copy that file too") from None
    return sorted(names)


def _messages_in(message: Any) -> Iterator[Any]:
    """A message of Protocol Buffers and all messages inside it."""
    yield message
    for field, value in message.ListFields():
        if field.type == field.TYPE_MESSAGE:
            for each in [value] if hasattr(value, "ListFields") else value:
                yield from _messages_in(each)


def _loaded(spec: Mapping[str, Any], file: Path) -> Run:
    try:
        import onnxruntime
    except ImportError:
        raise _not_installed(file) from None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1  # small networks: threads would wait
    options.enable_cpu_mem_arena = False  # it takes more memory than the graph needs
    options.log_severity_level = 3
    options.add_session_config_entry("session.load_model_format", "ONNX")  # what `external_files` has read
    try:
        session = onnxruntime.InferenceSession(str(file), options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise _unreadable(file, error) from None
    inputs = {each.name: each for each in session.get_inputs()}
    outputs = [each.name for each in session.get_outputs()]
    seen, output = _names(spec, file, inputs, outputs)
    kind = np.float64 if inputs[seen].type == "tensor(double)" else np.float32
    one_by_one = inputs[seen].shape[0] == 1

    def run(observation: Any, noise: Any) -> Any:
        feed = {seen: observation.astype(kind, copy=False)}
        if NOISE in inputs:
            feed[NOISE] = noise.astype(np.float64 if inputs[NOISE].type == "tensor(double)" else np.float32)
        if not one_by_one:
            return session.run([output], feed)[0]
        games = ({name: values[k : k + 1] for name, values in feed.items()} for k in range(len(observation)))
        return np.concatenate([session.run([output], each)[0] for each in games])

    return run


def _names(spec: Mapping[str, Any], file: Path, inputs: Mapping[str, Any], outputs: list[str]) -> tuple[str, str]:
    """The input for the observation, and the output. Raises UsageError if the document or the file leaves them open."""
    wanted = [name for name in inputs if name != NOISE]
    for key, known in (("input", wanted), ("output", outputs)):
        if spec[key] is not None and spec[key] not in known:
            told = f"it has {', '.join(known) or 'none'}"[:_MOST_CHARACTERS]
            raise UsageError.of(file, key, f"it has no {key} {spec[key]!r}", told)
    entries = spec["shapes"][0]
    if len(wanted) != 1:
        what = f"it has {len(wanted)} inputs beside the noise: {', '.join(wanted)}"[:_MOST_CHARACTERS]
        remedy = f"export it with one input [games, {entries}]; a state is not supported"
        raise UsageError.of(file, "input", what, remedy)
    shape, kind = inputs[wanted[0]].shape, inputs[wanted[0]].type
    floats = ("tensor(float)", "tensor(double)")
    games, size = shape if len(shape) == 2 else (0, 0)
    fits = (not isinstance(games, int) or games == 1) and (not isinstance(size, int) or size == entries)
    if not fits or kind not in floats:
        what = f"its input {wanted[0]} is {kind} {shape}, not tensor(float) [games, {entries}]"
        remedy = "the observation is that of harness/Ego-v0, and the number of games is free or 1"
        raise UsageError.of(file, "input", what, remedy)
    return wanted[0], spec["output"] or outputs[0]


def _decided(output: Any) -> dict[str, Any]:
    decided = np.ascontiguousarray(output)
    if decided.dtype.hasobject:
        raise DriverError("its output is not a tensor of numbers")
    return {
        "decided": base64.b64encode(decided.data).decode(),
        "dtype": decided.dtype.str,
        "shape": np.shape(output),
    }


def _not_installed(file: Path) -> UsageError:
    message = "ONNX files need the packages onnx and onnxruntime, of which one is not installed"
    return UsageError.of(file, "", message, "pip install 'safedriverl-harness[onnx]'")


def _unreadable(file: Path, error: Exception) -> UsageError:
    if is_of_memory(error):
        return UsageError.of(file, "", _TOO_MUCH_MEMORY, "export a smaller network")
    reason = error.strerror if isinstance(error, OSError) else error
    what = " ".join(f"can't be read as an ONNX file: {reason}".split())[:_MOST_CHARACTERS]
    return UsageError.of(file, "", what, "export it again, with operators of the standard only")


if __name__ == "__main__":
    main()
