"""The runs in a folder over HTTP: an index, the report of each run, and comparisons of some."""

from __future__ import annotations

from pathlib import Path
from threading import Lock
from urllib.parse import parse_qs, quote, unquote, urlsplit

from harness.campaign.results.compare_runs import compare_runs
from harness.campaign.results.run_index import runs_in
from harness.campaign.results.running_run import has_report, running_page
from harness.campaign.results.served_report import PAGE, ServedReport
from harness.campaign.storage.run_folder import MANIFEST, RunFolder
from harness.reports.index_page import render_index


class ServedRuns:
    """What the server of a folder of runs sends, by path. Runs may begin, go on and end while it serves."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._lock = folder, Lock()
        self._reports: dict[tuple[str, int], ServedReport] = {}

    def answer(self, path: str) -> tuple[str, bytes] | None:
        """Content type and content of a path; None if there is nothing. Raises UsageError as `ServedReport.answer` and
        `compare_runs` do."""
        parts = urlsplit(path)
        first, *rest = (unquote(part) for part in parts.path.removeprefix("/").split("/"))
        if not first and not rest:
            search = parse_qs(parts.query).get("search", [""])[0]
            return PAGE, render_index(str(self._folder), runs_in(self._folder), search).encode()
        if first == "compare" and len(rest) > 1 and all(map(self._is_run, rest)):
            addresses = [f"/{quote(name)}/" if (self._folder / name / "report.html").is_file() else "" for name in rest]
            return PAGE, compare_runs([self._folder / name for name in rest], addresses).page().encode()
        if not rest or not self._is_run(first):
            return None
        run, below = self._folder / first, parts.path.removeprefix("/").partition("/")[2]
        if RunFolder(run).is_published:
            report = run / "report.html"
            return (PAGE, report.read_bytes()) if not below and report.is_file() else None
        if not has_report(run):
            return (PAGE, running_page(run).encode()) if not below else None
        return self._report(first).answer(f"/{below}")

    def _is_run(self, name: str) -> bool:
        return name in {file.parent.name for file in self._folder.glob(f"*/{MANIFEST}")}

    def _report(self, name: str) -> ServedReport:
        """The report of a run as it is now."""
        run = RunFolder(self._folder / name)
        key = (name, run.manifest_file.stat().st_mtime_ns)
        with self._lock:
            if key not in self._reports:
                self._reports = {each: report for each, report in self._reports.items() if each[0] != name}
                self._reports[key] = ServedReport(run)
            return self._reports[key]
