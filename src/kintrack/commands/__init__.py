# SPDX-License-Identifier: Apache-2.0
"""One file per subcommand of `kintrack`: parse, call the library, print."""
