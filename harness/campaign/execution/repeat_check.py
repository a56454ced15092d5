"""The check that external drivers decide the same when a game is played again.

Games are compared in pairs, and finished games are not played again: a driver that varies makes both worthless. Its
campaign runs, with a warning on the terminal and in the report. The answer is kept in the run folder:

<run>/.stages/repeats.json     by a hash of driver and scene: the difference, in words; empty if there is none
"""

from __future__ import annotations

import json
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from harness.assessment.repeated_game import difference_when_repeated
from harness.campaign.preflight import OpenCampaign
from harness.campaign.storage.checksums import digest_of
from harness.campaign.storage.run_folder import RunFolder
from harness.config.driver import WithFiles
from harness.files import make_folder, write_atomically


def varying_drivers(campaign: OpenCampaign, folder: RunFolder | None = None) -> dict[str, str]:
    """The external drivers of a campaign that decide otherwise when a game is played again, each with the difference in
    words. With a run folder, what it knows already is not played."""
    file = folder.path / ".stages" / "repeats.json" if folder is not None else None
    known = _known(file) if file is not None else {}
    scene = campaign.hashes_of(campaign.scene)
    found = {}
    for driver in (campaign.ego_driver, *campaign.other_egos.values()):
        if driver is None or not isinstance(driver.document, WithFiles):  # it runs no code but the harness's own
            continue
        key = digest_of([driver.identity, scene])
        if key not in known:
            sampled = driver is campaign.ego_driver and campaign.ego_persona.decisions == "sampled"
            known[key] = difference_when_repeated(driver, campaign.scene.folder, sampled)
            if file is not None:
                make_folder(file.parent)
                write_atomically(file, json.dumps(known, indent=1).encode())
        found[driver.written] = known[key]
    return {name: difference for name, difference in found.items() if difference}


def _known(file: Path) -> dict[str, str]:
    try:
        return TypeAdapter(dict[str, str]).validate_json(file.read_bytes())
    except (OSError, ValidationError):
        return {}
