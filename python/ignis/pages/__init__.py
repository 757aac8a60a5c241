# SPDX-License-Identifier: Apache-2.0
"""Self-contained HTML pages: of a run, a comparison and a sweep."""
