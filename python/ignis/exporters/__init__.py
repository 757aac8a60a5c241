# SPDX-License-Identifier: Apache-2.0
"""What `./ignis export` consists of: feeds that read a log or a run, and sinks that write other formats.

Outside, axes are ROS's: X forward, Y left, Z up. Feeds convert, sinks write what they are given.
"""
