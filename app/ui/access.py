"""Who may operate the arm: a lease that one page holds at a time.

Every page watches; the page that holds the lease operates. What a laboratory wants of it:

- On one's own machine, without a token, the first page operates at once, and so does the next
  one to be opened while nobody operates: a reload gives the lease back and takes it again.
- With an operator token every page begins as a watcher; the token, told once, lets this page
  take the lease for as long as it stays open.
- Tokens are tried one in `TRY_AGAIN` seconds, by all pages together and in the order in which
  they came, one of a page at a time. So opening pages makes guessing no faster; and strangers
  who guess keep the operator waiting for no longer than one try of every page that is open.
  (To let a right token pass them would be to judge every guess at once.)
- The lease is given back by its button and by a page that closes. Then a person at another
  page takes it; it is never handed on by itself.
- It is not taken out of a hand at work. A page that was left alone for `LEFT_ALONE` seconds
  may be relieved, so that one forgotten in another room does not lock everybody out.
- Stopping is no matter of the lease: every page may stop the arm at any time. Giving the
  lease back does not stop it, as closing a page never did.

Pages are numbered by their connection. Time is an argument, in seconds.
"""

import hashlib
import hmac

from app.errors import AccessError
from app.ui.pacing import Bucket

LEFT_ALONE = 60.0  # [s] without a hand at the operator's page, until another may take over
TRY_AGAIN = 1.0  # [s] between two tries of a token, whoever makes them


class NotYetError(AccessError):
    """Other pages' tries of a token come first; nothing was judged."""


class Access:
    """The lease, who may hold it, and who does. Not thread-safe: one thread changes it."""

    def __init__(self, token: str = "") -> None:
        """An empty `token` lets every page operate: only for one's own machine."""
        self.operator: int | None = None
        self._key = _digest(token) if token else None  # the token itself is not kept
        self._trusted: dict[int, bool] = {}  # of the open pages
        self._line: dict[int, None] = {}  # pages whose try waits, the first that came first
        self._tries = Bucket(1.0 / TRY_AGAIN, 1.0)
        self._acted = 0.0

    @property
    def guarded(self) -> bool:
        """Whether operating takes a token."""
        return self._key is not None

    def arrive(self, page: int, now: float) -> None:
        """A page has been opened."""
        self._trusted[page] = not self.guarded
        if not self.guarded and self.operator is None:
            self.take(page, now)

    def leave(self, page: int) -> None:
        """A page has been closed, or its connection is lost."""
        self._trusted.pop(page, None)
        self.step_out(page)
        self.release(page)

    def trusts(self, page: int) -> bool:
        """Whether the page may take the lease without telling the token again."""
        return self._trusted.get(page, False)

    def tell(self, page: int, token: str, now: float) -> None:
        """A page tells the token. `AccessError` if it is wrong, `NotYetError` if others are first.

        After `NotYetError` the page is in the line, and its try is judged by telling it again.
        """
        if self._key is None or self.trusts(page):
            return
        if page not in self._trusted:
            raise AccessError("this page is not open; reload it")
        self._line.setdefault(page)
        ahead = list(self._line).index(page)
        if ahead or not self._tries.take(now):
            raise NotYetError(
                f"one token in {TRY_AGAIN:g} s is tried: this one waits for its turn, with "
                f"{ahead} before it; nothing has to be done"
            )
        del self._line[page]
        if not hmac.compare_digest(_digest(token), self._key):
            raise AccessError("this is not the operator token; ask whoever started Flinch")
        self._trusted[page] = True

    def step_out(self, page: int) -> None:
        """The page's try shall not be judged any more."""
        self._line.pop(page, None)

    def take(self, page: int, now: float) -> None:
        """Make the page the operator. `AccessError` if it may not, with what would help."""
        if not self.trusts(page):
            raise AccessError("operating takes the operator token; tell it first")
        wait = self.wait(now)
        if self.operator not in (None, page) and wait > 0.0:
            raise AccessError(
                f"{words(self.operator)} operates; it is free when that page gives it back or "
                f"closes, or when it has been left alone for {wait:.0f} s more"
            )
        self.operator, self._acted = page, now

    def release(self, page: int) -> None:
        """Give the lease back; nothing happens if the page does not hold it."""
        if self.operator == page:
            self.operator = None

    def acted(self, page: int, now: float) -> None:
        """There is a hand at this page."""
        if self.operator == page:
            self._acted = now

    def wait(self, now: float) -> float:
        """Seconds until the lease may be taken if the operator does nothing more; 0: now."""
        if self.operator is None:
            return 0.0
        return max(self._acted + LEFT_ALONE - now, 0.0)


def words(page: int | None) -> str:
    """A page as people call it; number 0 is the one that the program tries its own door with."""
    return "nobody" if page is None else f"page {page}"


def _digest(token: str) -> bytes:
    """Of equal length for all tokens, so that comparing tells nothing about the right one."""
    return hashlib.sha256(token.encode("utf-8", "surrogatepass")).digest()
