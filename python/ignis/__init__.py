# SPDX-License-Identifier: Apache-2.0
"""Analysis tools of IGNIS LIO: import, replay, compare, pictures. For notebooks: read_log and read_run."""

from ignis.log_arrays import ChannelArrays, LogArrays, read_log
from ignis.run_folder import Run, read_run

__all__ = ["ChannelArrays", "LogArrays", "Run", "read_log", "read_run"]
