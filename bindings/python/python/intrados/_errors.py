"""What goes wrong, each with the line that the program itself would say."""


class Error(Exception):
    """The program could not do what was asked; by itself: an internal error."""


class UsageError(Error, ValueError):
    """An argument makes no sense."""


class InputError(Error, ValueError):
    """A file does not hold what it should."""


class MissingError(Error, LookupError):
    """A file is not there or may not be read."""


class WriteError(Error):
    """A file cannot be written."""
