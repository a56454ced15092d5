"""Builds the example twin as an FMU: `python build.py twin.fmu [2|3]`. Needs a C compiler and FMPy."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import fmpy

SOURCE = Path(__file__).with_name("twin.c")
TOKEN = "{6f2b1c1e-7d35-4b7c-9d0e-3a1b5c2d4e6f}"
# Name, causality, unit and start value, in the order of the value references in twin.c
VARIABLES = [
    ("speed_mps", "input", "m/s", 0.0),
    ("speed_over_limit", "input", "1", 0.0),
    ("path_turned_rad_5m", "input", "rad", 0.0),
    ("path_left_m", "input", "m", 0.0),
    ("other0_seen", "input", "1", 0.0),
    ("other0_ahead_m", "input", "m", 0.0),
    ("other0_left_m", "input", "m", 0.0),
    ("other0_ahead_mps", "input", "m/s", 0.0),
    ("acceleration_mps2", "output", "m/s2", None),
    ("steering_rad", "output", "rad", None),
    ("time_gap_s", "parameter", "s", 1.5),
    ("lag_s", "parameter", "s", 0.3),
]
UNITS = {"m/s": 'm="1" s="-1"', "m/s2": 'm="1" s="-2"', "m": 'm="1"', "s": 's="1"', "rad": 'rad="1"', "1": ""}


def description(fmi: int) -> str:
    """The FMU's modelDescription.xml."""
    units = "".join(f'<Unit name="{name}"><BaseUnit {exponents}/></Unit>' for name, exponents in UNITS.items())
    variables = ""
    for reference, (name, causality, unit, start) in enumerate(VARIABLES):
        variability = "fixed" if causality == "parameter" else "continuous"
        attributes = f'name="{name}" valueReference="{reference}" causality="{causality}" variability="{variability}"'
        real = f'unit="{unit}"' + (f' start="{start}"' if start is not None else "")
        variables += (
            f"<ScalarVariable {attributes}><Real {real}/></ScalarVariable>"
            if fmi == 2
            else f"<Float64 {attributes} {real}/>"
        )
    outputs = [k for k, (_, causality, _, _) in enumerate(VARIABLES) if causality == "output"]
    if fmi == 2:
        unknowns = "".join(f'<Unknown index="{k + 1}"/>' for k in outputs)
        head, structure = f'fmiVersion="2.0" guid="{TOKEN}"', f"<Outputs>{unknowns}</Outputs>"
    else:
        clock = 'causality="independent" variability="continuous"'
        variables += f'<Float64 name="time" valueReference="{len(VARIABLES)}" {clock}/>'
        head = f'fmiVersion="3.0" instantiationToken="{TOKEN}"'
        structure = "".join(f'<Output valueReference="{k}"/>' for k in outputs)
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription {head} modelName="twin">'
        '<CoSimulation modelIdentifier="twin" canHandleVariableCommunicationStepSize="true"/>'
        f"<UnitDefinitions>{units}</UnitDefinitions><ModelVariables>{variables}</ModelVariables>"
        f"<ModelStructure>{structure}</ModelStructure></fmiModelDescription>"
    )


def build(fmu: Path, fmi: int = 3, source: str = SOURCE.read_text(encoding="utf-8")) -> Path:
    """Compile the source, and write the FMU: a zip archive of the library and its description."""
    headers = Path(fmpy.__file__).with_name("c-code")
    with tempfile.TemporaryDirectory() as folder:
        library, c_file = Path(folder) / "twin.so", Path(folder) / "twin.c"
        c_file.write_text(source, encoding="utf-8")
        options = ["-shared", "-fPIC", "-O2", "-fvisibility=hidden", f"-DFMI={fmi}", f"-I{headers}"]
        subprocess.run(["cc", *options, str(c_file), "-o", str(library), "-lm"], check=True)
        binaries = f"binaries/{fmpy.platform if fmi == 2 else fmpy.platform_tuple}"
        with zipfile.ZipFile(fmu, "w") as archive:
            archive.writestr("modelDescription.xml", description(fmi))
            archive.write(library, f"{binaries}/twin.so")
    return fmu


if __name__ == "__main__":
    print(build(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 3))
