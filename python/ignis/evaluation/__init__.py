# SPDX-License-Identifier: Apache-2.0
"""What `./ignis evaluate` consists of: drives to replay, and consistency of covariances with errors."""
