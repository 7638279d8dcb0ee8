"""What goes wrong with a user's files."""


class DataError(Exception):
    """A file or folder cannot be used; the text names it and what helps."""
