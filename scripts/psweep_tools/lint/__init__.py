# SPDX-License-Identifier: Apache-2.0
"""Quick checks of everything that is text (make lint)."""
