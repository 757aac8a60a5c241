# SPDX-License-Identifier: Apache-2.0
"""One module per kind of recording. Each hands raw sensor data to a Recorder, which knows the bus."""
