// SPDX-License-Identifier: BSD-3-Clause
// Empty: tests reuse what its target includes.
