"""PyTorch's optimisers without its compiler.

PyTorch imports its compiler (`torch._dynamo`) when the first optimiser is made, to keep it off the methods of
optimisers. The import takes more than a second in each process that trains, and nothing is compiled here.
"""

from __future__ import annotations

from torch.optim import Optimizer

_METHODS = ("add_param_group", "state_dict", "load_state_dict", "zero_grad")


def leave_out_compiler() -> None:
    """Let optimisers of this process be made without importing PyTorch's compiler.

    PyTorch looks up the form of a method that is not compiled in this attribute: it is the method itself. A version of
    PyTorch that does not look it up imports its compiler as before.
    """
    for name in _METHODS:
        plain = getattr(getattr(Optimizer, name), "__wrapped__", None)
        if plain is not None:
            setattr(plain, "__dynamo_disable", plain)
