# SPDX-License-Identifier: Apache-2.0
"""What `./ignis sweep` consists of: the grid, one replay of it, engines that run many, and the table."""
