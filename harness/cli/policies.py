"""The commands about policies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from harness.cli import wording
from harness.cli.documents import AllowCode

policy_app = typer.Typer(no_args_is_help=True, help="Export policies.")


@policy_app.command("export")
def export_policy(
    driver: Annotated[
        str,
        typer.Argument(
            metavar="DRIVER",
            help="A policy's folder, or a driver document of kind stable_baselines3.",
            show_default=False,
        ),
    ],
    out: Annotated[
        Path, typer.Argument(metavar="FILE", help="The new file: .onnx, or .pt for TorchScript.", show_default=False)
    ],
    allow_code: AllowCode = False,
) -> None:
    """Write a policy as one network, which drives without the library that trained it.

    The file and a driver document for it are written; what exists is not overwritten.
    """
    from harness.drivers.external import find_driver
    from harness.drivers.network_export import KINDS, export_network
    from harness.errors import UsageError
    from harness.files import write_atomically

    document = out.with_suffix(".toml")
    for file in (out, document):
        if file.exists():
            raise UsageError.of(file, "", "exists", "name another file")
    difference = export_network(find_driver(driver, Path("DRIVER"), key="", allow_code=allow_code), out)
    write_atomically(document, f'kind = "{KINDS[out.suffix.lower()]}"\nfile = "{out.name}"\n'.encode())
    print(wording.policy_exported(out, document, difference))
