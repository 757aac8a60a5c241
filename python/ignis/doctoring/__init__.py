# SPDX-License-Identifier: Apache-2.0
"""What `./ignis doctor` looks at, one module per part of the set-up."""
