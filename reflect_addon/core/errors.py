"""The one error that people see: what is wrong, with which thing, and what to do about it."""


class ReflectError(Exception):
    """A failure the user can act on.

    message: one sentence naming the object or file; remedy: one sentence saying what to do. The command line prints
    both on standard error and exits with status 1; operators report them. Anything else that escapes is a bug.
    """

    def __init__(self, message: str, remedy: str):
        super().__init__(f"{message} {remedy}")
        self.message = message
        self.remedy = remedy


class Cancelled(ReflectError):
    """The user stopped the work (Esc, SIGINT, or a progress callback that returned False)."""

    def __init__(self, what: str):
        super().__init__(f"{what} was cancelled.", "Nothing was changed; start it again when you like.")
