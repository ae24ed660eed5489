# Copyright 2026 The hooc_perception authors
# SPDX-License-Identifier: Apache-2.0
"""The one exception that users see: a sentence that names the thing and the mend."""


class HoocError(Exception):
    """
    Bad input or a state that the user can mend; the message is one clear sentence.

    The command line prints the message alone and exits with status 1; nodes log it.
    """


class HoocWarning(UserWarning):
    """Input that works but is probably not meant; the command line prints the sentence alone."""
