"""What a machine is short of, in one line with the remedy."""

import errno

FULL = "the disk is full or may not be written to"
REMEDIES = {
    errno.ENOSPC: f"{FULL}; make room, or give another folder",
    errno.EDQUOT: f"{FULL}; make room, or give another folder",
    errno.EROFS: f"{FULL}; give another folder",
    errno.EMFILE: "too many files are open; allow more: ulimit -n 4096",
    errno.ENFILE: "too many files are open on this machine; end other programs",
    errno.ENOMEM: "there is too little memory; end other programs, or allow more: ulimit -v",
}
THREADS = "no more threads may be begun; end other programs, or allow more: ulimit -u"


def scarce(error: BaseException) -> str:
    """The line for an error that comes of what a machine is short of; empty for any other.

    Libraries that cannot be mapped say so in the text of an ImportError.
    """
    seen: BaseException | None = error
    while seen is not None:
        if isinstance(seen, MemoryError):
            return REMEDIES[errno.ENOMEM]
        number = seen.errno if isinstance(seen, OSError) else None
        text = str(seen).lower()
        if number is None and isinstance(seen, ImportError):
            number = next((n for n, words in IN_TEXT.items() if words in text), None)
        if isinstance(seen, RuntimeError) and "start new thread" in text:
            return THREADS
        if number in REMEDIES:
            file = getattr(seen, "filename", None)
            return f"{file}: {REMEDIES[number]}" if file else REMEDIES[number]
        seen = seen.__cause__ or seen.__context__
    return ""


IN_TEXT = {
    errno.ENOMEM: "cannot allocate memory",
    errno.EMFILE: "too many open files",
}
