"""Builds the documentation site: `python docs/site/build.py OUT`, or `make docs`. A warning of Sphinx ends it.

The pages are the Markdown files of docs/, the README, the changelog, and pages made from the code (`reference_pages`).
They are copied to a folder of their own, because Sphinx reads one tree, and their links are led to where their targets
are on the site. A published report is on the site as it is. A link to another file that is no page, such as
`../campaigns/merge.toml`, becomes plain text.
"""

from __future__ import annotations

import posixpath
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Set
from pathlib import Path

import navigation
import reference_pages

ROOT = Path(__file__).resolve().parents[2]
FROM_ROOT = {"README.md": "readme.md", "CHANGELOG.md": "changelog.md", "CONTRIBUTING.md": "contributing.md"}
"""Pages of the site that lie at the top of the checkout."""
LIVE = "reports/paper_merge"
"""A published run folder: its report, with the files that the report links to."""
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|!?\[[^\]]*\]\([^)]*\)|\[[^\]]*\])*)\]\(([^)\s]+)\)")
_FENCE = re.compile(r"(^ *```.*?^ *```|`[^`\n]+`)", re.DOTALL | re.MULTILINE)


def build(out: Path) -> None:
    """Build the site into a folder. Raises CalledProcessError if Sphinx warns, FileNotFoundError for a broken link."""
    with tempfile.TemporaryDirectory(prefix="harness-site-") as folder:
        source = Path(folder)
        write_source(source / "pages")
        copy_files(ROOT / LIVE, source / "live" / LIVE)
        command = [
            sys.executable,
            "-m",
            "sphinx",
            "-W",
            "--keep-going",
            "-q",
            "-b",
            "html",
            "-c",
            str(ROOT / "docs/site"),
        ]
        settings = ["-D", f"html_extra_path={source / 'live'}", "-d", str(source / "doctrees")]
        subprocess.run([*command, *settings, str(source / "pages"), str(out)], check=True)


def copy_files(folder: Path, out: Path) -> None:
    """Copy the files that lie in a folder itself."""
    out.mkdir(parents=True)
    for file in folder.iterdir():
        if file.is_file():
            shutil.copyfile(file, out / file.name)


def write_source(folder: Path) -> None:
    """Write every page, picture and file to copy of the site into a folder."""
    docs = ROOT / "docs"
    pages = {name.relative_to(docs).as_posix(): name for name in sorted(docs.rglob("*.md"))}
    pages |= {site: ROOT / name for name, site in FROM_ROOT.items()}
    made = reference_pages.pages(docs / "schemas") | {"index.md": navigation.index()}
    kinds = ("png", "svg", "gif", "yml")
    files = {file.relative_to(docs).as_posix() for kind in kinds for file in docs.rglob(f"*.{kind}")}
    for name in sorted(files):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(docs / name, folder / name)
    known = {*pages, *made, *files}
    for name, file in pages.items():
        made[name] = with_links(file.read_text(encoding="utf-8"), file.relative_to(ROOT).as_posix(), name, known)
    made["publications.md"] += reference_pages.sources_of_personas()
    for name, text in made.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")


def with_links(text: str, origin: str, page: str, known: Set[str]) -> str:
    """A text that lies at `origin` in the checkout, with the links of the site's page `page`.

    Raises FileNotFoundError for a link that leads nowhere.
    """

    def led(match: re.Match[str]) -> str:
        image, words, target = match.groups()
        path, _, anchor = target.partition("#")
        if not path or re.match(r"[a-z]+:", target):
            return match.group()
        place = posixpath.normpath(posixpath.join(posixpath.dirname(origin), path))
        if place == f"{LIVE}/report.html":  # Sphinx makes a download of it if it is a link of Markdown
            return f'<a href="{posixpath.relpath(place, posixpath.dirname(page) or ".")}">{words}</a>'
        if schema := re.fullmatch(r"docs/schemas/(\w+)\.schema\.json", place):
            place = f"docs/reference/{schema[1]}.md"
        on_site = FROM_ROOT.get(place, place.removeprefix("docs/"))
        if on_site in known:
            link = posixpath.relpath(on_site, posixpath.dirname(page) or ".")
            return f"{image}[{words}]({link}{'#' + anchor if anchor else ''})"
        if not (ROOT / place).exists():
            raise FileNotFoundError(f"{origin}: the link to {target} leads nowhere")
        return words

    parts = _FENCE.split(text)
    parts[::2] = [_LINK.sub(led, part) for part in parts[::2]]
    return "".join(parts)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python docs/site/build.py OUT")
    try:
        build(Path(sys.argv[1]))
    except subprocess.CalledProcessError as error:
        sys.exit(error.returncode)
