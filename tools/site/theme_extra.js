// SPDX-License-Identifier: Apache-2.0
// Debian's theme asks for this file and does not bring it; there is nothing for it to do.
