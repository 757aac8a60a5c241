# SPDX-License-Identifier: Apache-2.0
"""Analysis of IGNIS LIO runs: importing recordings, reading logs, comparing trajectories, running the demo."""
