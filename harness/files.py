"""Reading of untrusted files, and atomic, durable writing of files.

Only plain files of a limited size are read, never pipes. A file is written under a temporary name beside its final one
and then renamed; so is a folder that is to be complete. A killed process leaves the temporary file or folder behind;
`drop_scratch` removes it.
"""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import stat
import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

from harness.errors import UsageError, is_of_disk

_SCRATCH = ".part"
_NEW = "name a new folder"
MOST_HASHED_BYTES = 2_000_000_000
_BLOCK_BYTES = 1_000_000


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file through a temporary one beside it. If this raises OSError, an existing file is unchanged."""
    with errors_naming(path):
        handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=_SCRATCH)
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content)
            os.chmod(scratch, 0o644)
            replace_durably(Path(scratch), path)
        except BaseException:
            Path(scratch).unlink(missing_ok=True)
            raise


@contextmanager
def errors_naming(path: Path) -> Iterator[None]:
    """An OSError of the block names this file: that of a full disk names none."""
    try:
        yield
    except OSError as error:
        error.filename, error.filename2 = str(path), None
        raise


def scratch_beside(path: Path) -> Path:
    """The temporary name of a file that is written in parts, until it is complete."""
    return path.with_name(f".{path.name}{_SCRATCH}")


def replace_durably(scratch: Path, path: Path) -> None:
    """Rename a complete file to its final name. A power failure leaves either the old file or the complete new one."""
    sync_file(scratch)
    os.replace(scratch, path)
    sync_folder(path.parent)


def drop_scratch(folder: Path) -> None:
    """Remove the temporary files and folders of killed processes in a folder and its subfolders."""
    for scratch in list(folder.rglob(f".*{_SCRATCH}")):
        if scratch.is_dir() and not scratch.is_symlink():
            shutil.rmtree(scratch)
        else:
            scratch.unlink(missing_ok=True)


@contextmanager
def complete_folder(folder: Path, *, replaces: bool = False) -> Iterator[Path]:
    """A scratch folder beside a folder, which gets what is in it if nothing is raised: until then it is as before.

    The folder has to be new or empty, or is replaced.
    """
    scratch = _scratch_of(folder)
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir()
    try:
        yield scratch
        if replaces:
            shutil.rmtree(folder, ignore_errors=True)
        if folder.is_dir():  # it stays: a shell may be in it
            for each in scratch.iterdir():
                each.rename(folder / each.name)
        else:
            scratch.rename(folder)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """`complete_folder` for a new folder that a user names. Raises UsageError as `check_new_folder`, and if it can't be
    written; what the block raises about other files stays as it is."""
    check_new_folder(folder)
    try:
        with complete_folder(folder) as scratch:
            yield scratch
            check_new_folder(folder)  # somebody may have filled it meanwhile
    except OSError as error:
        named = error.filename if isinstance(error.filename, str | os.PathLike) else None
        is_own = is_of_disk(error) if named is None else Path(named).is_relative_to(_scratch_of(folder))
        if is_own or isinstance(error, shutil.Error):
            raise UsageError.of(folder, "", *cannot_write(error)) from None
        raise


def _scratch_of(folder: Path) -> Path:
    """The temporary folder of this process for a folder."""
    return folder.absolute().with_name(f".{folder.absolute().name}.{os.getpid()}{_SCRATCH}")


def cannot_write(error: OSError) -> tuple[str, str]:
    """What is wrong with a folder that can't be written, and the remedy."""
    reason = error.args[0][0][-1] if isinstance(error, shutil.Error) else error.strerror
    return f"can't be written: {reason}", "name a folder that you may write"


def no_folder(folder: Path) -> tuple[str, str]:
    """That there is no folder, and the remedy."""
    return f"there is no folder {folder}", "create it, or name another place"


def check_new_folder(folder: Path) -> None:
    """Raise UsageError unless a folder is new or empty, and the one that it is to be in is there."""
    if folder.is_symlink() or folder.exists():
        if not folder.is_dir():
            raise UsageError.of(folder, "", "is a file, not a folder", _NEW)
        if any(folder.iterdir()):
            raise UsageError.of(folder, "", "is there already, and not empty", _NEW)
    if not folder.absolute().parent.is_dir():
        raise UsageError.of(folder, "", *no_folder(folder.absolute().parent))


def check_new_file(file: Path, option: str = "") -> None:
    """Raise UsageError unless a file of this name can be written: a command says so before it starts to work.

    `option` is the one of the command line that names the file; empty where it is an argument."""
    place, name = (option, str(file)) if option else (str(file), "")
    if file.is_dir():
        raise UsageError.of(place, name, "is a folder", "name a file")
    if not file.absolute().parent.is_dir():
        raise UsageError.of(place, name, *no_folder(file.parent))


def make_folder(folder: Path) -> None:
    """Make a folder and its parents, so that they survive a power failure."""
    if not folder.is_dir():
        make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        sync_folder(folder.parent)


def sync_file(path: Path) -> None:
    """Make a file's content survive a power failure."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Make new and replaced names in a folder survive a power failure."""
    if os.name == "posix":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def check_file(path: Path, most_bytes: float) -> None:
    """Raise OSError, with the reason in its `strerror`, unless this is a plain file of at most `most_bytes` bytes."""
    status = os.stat(path)
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, "is a folder or a device, not a plain file", str(path))
    if status.st_size > most_bytes:
        raise OSError(errno.EFBIG, _too_large(status.st_size, most_bytes), str(path))


def content_of(path: Path, most_bytes: int) -> bytes:
    """The bytes of a plain file. Raises OSError, with the reason in its `strerror`, for any other or larger file."""
    with _plain_file(path, most_bytes) as file:
        size_bytes = os.fstat(file.fileno()).st_size
        content = file.read(min(size_bytes, most_bytes) + 1)  # which are allocated at once
    if len(content) > size_bytes:
        raise OSError(errno.EIO, "was changed while it was read", str(path))
    if len(content) > most_bytes:
        raise OSError(errno.EFBIG, _too_large(len(content), most_bytes), str(path))
    return content


def digest_of_file(path: Path, most_bytes: float = MOST_HASHED_BYTES) -> str:
    """SHA-256 of a plain file's content, read in blocks. Raises OSError as `content_of` does."""
    digest = hashlib.sha256()
    with _plain_file(path, most_bytes) as file:
        while block := file.read(_BLOCK_BYTES):
            digest.update(block)
            if file.tell() > most_bytes:  # it grows while it is read
                raise OSError(errno.EFBIG, _too_large(file.tell(), most_bytes), str(path))
    return digest.hexdigest()


def _plain_file(path: Path, most_bytes: float) -> IO[bytes]:
    check_file(path, most_bytes)
    # the path may have been replaced since: opening a pipe without a writer must not block
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(errno.EINVAL, "is not a plain file", str(path))
    return os.fdopen(descriptor, "rb")


def has_digest(path: Path, digests: Collection[str]) -> bool:
    """Whether a path is a plain file with one of these digests."""
    try:
        return digest_of_file(path) in digests
    except OSError:
        return False


def leads_out(path: Path, folder: Path) -> bool:
    """Whether symbolic links make a path below a folder lead outside the folder."""
    return not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))


def links_in(folder: str | Path) -> Iterator[Path]:
    """The symbolic links in a folder and its subfolders, those to folders not followed. A folder that can't be read has
    none."""
    try:
        entries = list(os.scandir(folder))
    except OSError:
        return
    for entry in entries:
        if entry.is_symlink():  # as the folder says: nothing is asked of the file
            yield Path(entry.path)
        elif entry.is_dir():
            yield from links_in(entry.path)


def _too_large(size_bytes: int, most_bytes: float) -> str:
    return f"is too large: {size_bytes / 1e6:,.0f} MB, at most {most_bytes / 1e6:,.0f} MB are read"
