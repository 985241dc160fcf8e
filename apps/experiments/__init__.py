# SPDX-License-Identifier: BSD-3-Clause
"""The paper's experiments, by the programs that are installed; see README.md."""
