"""A training process does not import PyTorch's compiler."""

from __future__ import annotations

import subprocess
import sys

PROGRAM = """
import sys
import torch
from harness.training.ppo import _leave_out_compiler

_leave_out_compiler()
layer = torch.nn.Linear(2, 1)
adam = torch.optim.Adam(layer.parameters(), lr=0.5)
adam.load_state_dict(adam.state_dict())
adam.zero_grad()
assert "torch._dynamo" not in sys.modules
before = layer.weight.clone()
layer(torch.ones(2)).sum().backward()
adam.step()
assert torch.allclose(before - layer.weight, torch.tensor(0.5))  # Adam's first step is the learning rate
"""


def test_optimiser__is_made_without_the_compiler_and_takes_its_steps() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
