# SPDX-License-Identifier: Apache-2.0
"""Files that appear under their final name only when they are complete."""

import errno
import itertools
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ignis.errors import InputError

_numbers = itertools.count()


def _wait_for_disk(path: Path) -> None:
    """Waits until a file or a folder is on the disk. What has no disk behind it answers EINVAL."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise
    finally:
        os.close(descriptor)


def put_in_place(temporary: Path, path: Path) -> None:
    """Gives a complete file its name. Unsynced, a power cut may leave the name without its content and no old file."""
    _wait_for_disk(temporary)
    temporary.replace(path)
    _wait_for_disk(path.parent)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yields a temporary path beside `path`; syncs and renames it when the block ends well, else removes it."""
    if path.is_dir():
        raise InputError(f"{path} is a folder; give the name of a file to write")
    if not path.parent.is_dir():
        raise InputError(f"the folder {path.parent} does not exist; make it first")
    # A name of its own for each writer: of several that write the same file at once, each renames a whole one.
    temporary = path.with_name(f"{path.name}.{os.getpid()}-{next(_numbers)}.tmp")
    try:
        yield temporary
        put_in_place(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes a whole text file at once."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
