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
        # Without, a power cut may leave the new name without its content, and the old file gone.
        _wait_for_disk(temporary)
        temporary.replace(path)
        _wait_for_disk(path.parent)
    finally:
        temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Writes a whole text file at once."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
