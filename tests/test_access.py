"""The lease: who operates, who watches, and how it changes hands; a clock moved by hand."""

import re
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from app.errors import AccessError, ConfigError
from app.ui.access import LEFT_ALONE, TRY_AGAIN, Access, NotYetError
from app.ui.entrance import LONGEST, SHORTEST, VARIABLE, beyond, checked_origin, operator_token

TOKEN = "correct horse battery"


def test_without_a_token_the_first_page_operates_and_the_second_watches() -> None:
    access = Access()
    access.arrive(0, 1.0)
    access.arrive(1, 2.0)
    assert access.operator == 0
    assert not access.guarded


def test_a_closed_page_gives_the_lease_back_and_nobody_gets_it_unasked() -> None:
    access = Access()
    access.arrive(0, 0.0)
    access.arrive(1, 0.0)
    access.leave(0)
    assert access.operator is None
    access.take(1, 1.0)
    assert access.operator == 1


def test_a_reloaded_page_operates_again() -> None:
    access = Access()
    access.arrive(0, 0.0)
    access.arrive(1, 0.0)
    access.leave(0)
    access.arrive(2, 0.5)
    assert access.operator == 2


def test_a_released_lease_is_free_for_others() -> None:
    access = Access()
    access.arrive(0, 0.0)
    access.arrive(1, 0.0)
    access.release(1)  # it does not hold it
    assert access.operator == 0
    access.release(0)
    assert access.operator is None
    access.take(1, 0.0)
    assert access.operator == 1


def test_the_lease_is_not_taken_out_of_a_hand_at_work() -> None:
    access = Access()
    access.arrive(0, 0.0)
    access.arrive(1, 0.0)
    access.acted(0, 50.0)
    access.acted(1, 55.0)  # a hand at another page does not count
    with pytest.raises(AccessError, match=r"page 0 operates.* 20 s more"):
        access.take(1, 50.0 + LEFT_ALONE - 20.0)
    assert access.operator == 0


def test_a_page_left_alone_may_be_relieved() -> None:
    access = Access()
    access.arrive(0, 0.0)
    access.arrive(1, 0.0)
    access.acted(0, 50.0)
    access.take(1, 50.0 + LEFT_ALONE)
    assert access.operator == 1


def test_with_a_token_every_page_begins_as_a_watcher() -> None:
    access = Access(TOKEN)
    access.arrive(0, 0.0)
    assert access.operator is None
    with pytest.raises(AccessError, match="operator token"):
        access.take(0, 0.0)
    access.tell(0, TOKEN, 0.0)
    access.take(0, 0.0)
    assert access.operator == 0


@pytest.mark.parametrize("wrong", ["", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), "\ud800"])
def test_a_wrong_token_does_not_let_in(wrong: str) -> None:
    access = Access(TOKEN)
    access.arrive(0, 0.0)
    with pytest.raises(AccessError, match="not the operator token"):
        access.tell(0, wrong, 0.0)
    assert not access.trusts(0)


def test_the_token_is_told_once_and_forgotten_with_the_page() -> None:
    access = Access(TOKEN)
    access.arrive(0, 0.0)
    access.tell(0, TOKEN, 0.0)
    access.take(0, 0.0)
    access.release(0)
    access.take(0, 1.0)
    access.leave(0)
    access.arrive(0, 2.0)
    assert not access.trusts(0)


def test_a_page_cannot_try_tokens_fast() -> None:
    access = Access(TOKEN)
    access.arrive(0, 0.0)
    with pytest.raises(AccessError, match="not the operator token"):
        access.tell(0, "a guess", 10.0)
    with pytest.raises(NotYetError, match="waits for its turn, with 0 before it"):
        access.tell(0, TOKEN, 10.0 + 0.5 * TRY_AGAIN)
    access.tell(0, TOKEN, 10.0 + 1.5 * TRY_AGAIN)
    assert access.trusts(0)


def judged(access: Access, page: int, token: str, now: float) -> bool:
    """Whether a try was judged; it was wrong, then."""
    try:
        access.tell(page, token, now)
    except NotYetError:
        return False
    except AccessError:
        return True
    raise AssertionError("the guess was right")


def test_opening_pages_makes_guessing_no_faster() -> None:
    """2000 guesses over new pages within ten seconds: eleven are judged."""
    access, count = Access(TOKEN), 0
    for k in range(2000):
        now = k * 0.005
        access.arrive(k, now)
        count += judged(access, k, f"guess {k}", now)
        access.leave(k)
    assert count <= 1 + 10.0 / TRY_AGAIN


def test_who_guesses_keeps_the_right_token_waiting_for_one_try_of_each_page() -> None:
    access, strangers, me = Access(TOKEN), range(15), 99
    for page in (*strangers, me):
        access.arrive(page, 0.0)
    for page in strangers:
        judged(access, page, "a guess", 0.0)
    judged(access, me, TOKEN, 0.0)
    now = 0.0
    while not access.trusts(me):
        now += 0.05
        for page in strangers:  # they never rest, and are asked first
            judged(access, page, "another", now)
        with suppress(NotYetError):
            access.tell(me, TOKEN, now)
    assert now <= len(strangers) * TRY_AGAIN + 0.5


def test_a_closed_page_gives_its_turn_up() -> None:
    access = Access(TOKEN)
    for page in range(3):
        access.arrive(page, 0.0)
        with suppress(AccessError):
            access.tell(page, "a guess", 0.0)
    access.leave(1)
    access.tell(2, TOKEN, TRY_AGAIN)
    assert access.trusts(2)


def test_a_page_that_never_arrived_cannot_operate() -> None:
    for access in (Access(), Access(TOKEN)):
        with pytest.raises(AccessError):
            access.take(7, 0.0)
    with pytest.raises(AccessError):
        access.tell(7, TOKEN, 0.0)


class Lease(RuleBasedStateMachine):
    """Whatever people do in whatever order: the lease is held by at most one who may."""

    pages = st.integers(0, 3)
    tokens = st.sampled_from([TOKEN, "a guess", ""])

    @initialize(guarded=st.booleans())
    def begin(self, guarded: bool) -> None:
        self.access = Access(TOKEN if guarded else "")
        self.now, self.acted = 0.0, 0.0
        self.open: set[int] = set()
        self.told: set[int] = set()

    @rule(seconds=st.floats(0.0, 2.0 * LEFT_ALONE))
    def wait(self, seconds: float) -> None:
        self.now += seconds

    @rule(page=pages)
    def arrive(self, page: int) -> None:
        if page not in self.open:
            before = self.access.operator
            self.open.add(page)
            self.access.arrive(page, self.now)
            if not self.access.guarded and before is None:
                assert self.access.operator == page
                self.acted = self.now
            else:
                assert self.access.operator == before

    @rule(page=pages)
    def leave(self, page: int) -> None:
        before = self.access.operator
        self.open.discard(page)
        self.told.discard(page)
        self.access.leave(page)
        assert self.access.operator == (None if before == page else before)

    @rule(page=pages, token=tokens)
    def tell(self, page: int, token: str) -> None:
        try:
            self.access.tell(page, token, self.now)
        except AccessError:
            return
        if self.access.guarded and page not in self.told:
            assert token == TOKEN and page in self.open
            self.told.add(page)

    @rule(page=pages)
    def take(self, page: int) -> None:
        before = self.access.operator
        held = before not in (None, page) and self.now - self.acted < LEFT_ALONE
        try:
            self.access.take(page, self.now)
        except AccessError:
            assert self.access.operator == before
            return
        assert self.access.operator == page and not held
        self.acted = self.now

    @rule(page=pages)
    def act(self, page: int) -> None:
        self.access.acted(page, self.now)
        if self.access.operator == page:
            self.acted = self.now

    @rule(page=pages)
    def release(self, page: int) -> None:
        before = self.access.operator
        self.access.release(page)
        assert self.access.operator == (None if before == page else before)

    @invariant()
    def only_an_open_page_that_may(self) -> None:
        operator = self.access.operator
        if operator is not None:
            assert operator in self.open
            assert not self.access.guarded or operator in self.told


test_the_lease_is_held_by_at_most_one_page_that_may = Lease.TestCase


# --- the token and the addresses ------------------------------------------------------------


def test_on_this_machine_no_token_is_needed() -> None:
    for host in ("127.0.0.1", "localhost", "::1"):
        assert operator_token(host, ("http://localhost:9000",), None, {}) == ""


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.5", "::", "arm.lab"])
def test_beyond_this_machine_a_token_is_demanded(host: str) -> None:
    with pytest.raises(AccessError, match=f"--host {host} .*--token-file") as e:
        operator_token(host, (), None, {})
    assert "\n" not in str(e.value)


def test_an_origin_beyond_this_machine_demands_a_token_too() -> None:
    with pytest.raises(AccessError, match=r"--origin https://cell\.example"):
        operator_token("127.0.0.1", ("https://cell.example",), None, {})
    assert beyond("127.0.0.1", ("http://localhost:9000", "http://[::1]")) == ""


def test_the_token_is_read_from_a_file_or_the_environment(tmp_path: Path) -> None:
    file = tmp_path / "token"
    file.write_text(f"{TOKEN}\n")
    assert operator_token("0.0.0.0", (), file, {}) == TOKEN
    assert operator_token("0.0.0.0", (), None, {VARIABLE: TOKEN}) == TOKEN
    assert operator_token("0.0.0.0", (), file, {VARIABLE: "x" * 20}) == TOKEN
    assert operator_token("127.0.0.1", (), file, {}) == TOKEN  # here it is asked for, not needed


@pytest.mark.parametrize(
    "text", ["", "\n", "x" * (SHORTEST - 1), "x" * (LONGEST + 1), "xxxxxxxxxx\nxxxxxxxxxx"]
)
def test_a_token_that_cannot_be_used_is_refused_and_not_told(tmp_path: Path, text: str) -> None:
    file = tmp_path / "token"
    file.write_text(text)
    for given_file, environment in ((file, {}), (None, {VARIABLE: text})):
        with pytest.raises(AccessError, match="no line of 16 to 256 characters") as e:
            operator_token("127.0.0.1", (), given_file, environment)
        assert "xxx" not in str(e.value) and "\n" not in str(e.value)


def test_a_token_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(AccessError, match="cannot be read") as e:
        operator_token("0.0.0.0", (), tmp_path / "none", {})
    assert "\n" not in str(e.value)


@pytest.mark.parametrize(
    ("text", "origin"),
    [
        ("https://cell.example", "https://cell.example"),
        ("HTTPS://Cell.Example/", "https://cell.example"),
        ("https://cell.example:443", "https://cell.example"),
        ("http://cell.example:8080", "http://cell.example:8080"),
        ("http://[::1]:8080", "http://[::1]:8080"),
    ],
)
def test_an_origin_is_written_as_browsers_do(text: str, origin: str) -> None:
    assert checked_origin(text) == origin


@pytest.mark.parametrize(
    "text",
    [
        "cell.example",
        "*",
        "",
        "null",
        "ftp://a",
        "https://a/page",
        "https://a@b",
        "https://",
        "https://a:99999",
        "https://[::1",
        "https://a?b",
        "https://a#b",
    ],
)
def test_an_origin_that_is_none_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="no address of a page"):
        checked_origin(text)


@given(st.text(max_size=30))
def test_any_text_is_an_origin_or_a_config_error(text: str) -> None:
    with suppress(ConfigError):
        assert checked_origin(text).startswith("http")


def test_nothing_is_read_by_a_loader_that_could_run_code() -> None:
    """Scenes, layouts, recordings and messages come from strangers, too.

    What our own process writes to a child of its own, on a socket that only the two have, does
    not: the simulation's two halves talk in pickles. A controller's file is code, and runs because
    whoever starts the program names it; the page cannot. YAML is read by its safe loader.
    """
    among_ourselves = {"sensing/simulation.py", "sensing/simulated_apart.py"}
    named_at_the_start = {"control/guests/files.py"}
    only_catches_an_error_of_it = {"compiled.py"}
    running = re.compile(
        r"\b(pickle|marshal|shelve|dill|joblib)\b|\b(eval|exec)\(|allow_pickle(?!=False)"
        r"|\byaml\.(?!safe_load\(|YAMLError)\w+\("
    )
    app = Path(__file__).parents[1] / "app"
    files = [*app.rglob("*.py")]
    assert len(files) > 50
    found = {f.relative_to(app).as_posix() for f in files if running.search(f.read_text("utf-8"))}
    assert found == among_ourselves | named_at_the_start | only_catches_an_error_of_it
