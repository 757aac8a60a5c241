# SPDX-License-Identifier: Apache-2.0
"""What `./ignis compare` consists of: estimates, their figures, and the gain of smoothing."""
