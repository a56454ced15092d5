"""The image: linted everywhere, built where a Docker daemon answers."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from harness.version import __version__
from tests.support.repository import REPOSITORY

DOCKERFILE = REPOSITORY / "Dockerfile"


def daemon_answers() -> bool:
    docker = shutil.which("docker")
    return docker is not None and subprocess.run([docker, "info"], capture_output=True, timeout=60).returncode == 0


def test_dockerfile__has_no_finding() -> None:
    hadolint = Path(sys.executable).with_name("hadolint")
    done = subprocess.run([hadolint, DOCKERFILE], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


def test_dockerfile__installs_the_system_libraries_that_the_readme_names() -> None:
    packages = r"((?:lib[\w-]+ ?)+)"
    (image,) = re.findall(rf"no-install-recommends {packages}", DOCKERFILE.read_text(encoding="utf-8"))
    (readme,) = re.findall(rf"apt-get install {packages}", (REPOSITORY / "README.md").read_text(encoding="utf-8"))
    assert sorted(image.split()) == sorted(readme.split())


def test_dockerfile__the_build_sees_all_that_the_wheel_is_made_of() -> None:
    seen = {line[1:] for line in (REPOSITORY / ".dockerignore").read_text().splitlines() if line[0] == "!"}
    wheel = {
        "harness",
        "campaigns",
        "egos",
        "networks",
        "personas",
        "policies",
        "pyproject.toml",
        "README.md",
        "LICENSE",
    }
    assert seen == wheel | {"requirements.lock"}
    assert all((REPOSITORY / name).exists() for name in seen)


@pytest.mark.slow
@pytest.mark.skipif(not daemon_answers(), reason="no Docker daemon answers")
def test_image__is_built_and_has_the_command() -> None:
    name = "harness-test"
    subprocess.run(["docker", "build", "--tag", name, REPOSITORY], check=True, timeout=1800)
    done = subprocess.run(["docker", "run", "--rm", name, "--version"], capture_output=True, text=True, timeout=300)
    assert done.stdout == f"harness {__version__}\n"
