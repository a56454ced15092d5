"""Scripts of the documentation as modules: `docs/` is no package."""

from __future__ import annotations

import importlib.util
import sys
from types import ModuleType

from tests.support.repository import REPOSITORY


def script(path: str) -> ModuleType:
    """A script by its path from `docs/`, such as "game/figures.py". As when it is run, it finds modules beside it."""
    file = REPOSITORY / "docs" / path
    name = f"docs_{file.parent.name}_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    sys.path.insert(0, str(file.parent))
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(file.parent))
    return module
