"""Who has to go when there are too many, and what is written of it."""

import logging
from dataclasses import dataclass
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.ui.listener import neighbourhood
from app.ui.paced_log import LONGEST, PERIOD, PacedLog, library_logger
from app.ui.pacing import Shares
from app.ui.places import Places, Rank

MOST = 4


@dataclass(eq=False)
class Comer:
    """A socket that only has a place."""

    rank: Rank = Rank.STRANGER
    neighbourhood: str = "a"


def entered(places: Places[Comer], *comers: Comer) -> list[Comer | None]:
    """Who had to go for each; the last that were let in."""
    gone = []
    for comer in comers:
        places.arrive(comer)
        inside, goes = places.enter(comer)
        assert inside
        gone.append(goes)
    return gone


def test_of_strangers_the_first_that_came_goes() -> None:
    places: Places[Comer] = Places(9, MOST)
    comers = [Comer() for _ in range(MOST + 2)]
    assert entered(places, *comers) == [None] * MOST + comers[:2]


def test_of_the_largest_neighbourhood_the_first_goes() -> None:
    places: Places[Comer] = Places(9, MOST)
    alone, flood = Comer(neighbourhood="b"), [Comer() for _ in range(MOST)]
    assert entered(places, alone, *flood)[-1] is flood[0]


def test_who_is_trusted_stays_and_the_operator_stays_longest() -> None:
    places: Places[Comer] = Places(9, MOST)
    operator, friends = Comer(Rank.OPERATOR), [Comer(Rank.TRUSTED) for _ in range(MOST - 1)]
    entered(places, operator, *friends)
    stranger, friend = Comer(), Comer(Rank.TRUSTED)
    for comer in (stranger, friend):
        places.arrive(comer)
    assert places.enter(stranger) == (False, None) and stranger in places.waiting
    assert places.enter(friend) == (True, friends[0])


steps = st.tuples(
    st.sampled_from(["arrive", "enter", "leave"]),
    st.sampled_from("aab"),
    st.sampled_from([Rank.STRANGER, Rank.TRUSTED]),
)


@given(st.lists(steps, max_size=60))
def test_places_are_never_more_and_the_operator_keeps_its_own(steps: list[Any]) -> None:
    places: Places[Comer] = Places(3, MOST)
    operator = Comer(Rank.OPERATOR)
    entered(places, operator)
    for step, where, rank in steps:
        if step == "arrive":
            goes = places.arrive(Comer(rank, where))
            assert goes is None or goes not in places.waiting
        elif step == "enter" and places.waiting:
            comer = next(iter(places.waiting))
            inside, goes = places.enter(comer)
            assert goes is not operator and inside == (comer in places.inside)
            assert goes is None or (goes not in places.inside and goes.rank <= comer.rank)
        elif step == "leave" and len(places.inside) > 1:
            places.leave(list(places.inside)[-1])
        assert len(places.waiting) <= 3 and len(places.inside) <= MOST
        assert operator in places.inside


def test_an_ipv6_neighbourhood_is_the_net_that_one_owner_has() -> None:
    assert neighbourhood("192.0.2.7") == "192.0.2.7"
    assert neighbourhood("::ffff:192.0.2.7") == "192.0.2.7"
    assert neighbourhood("2001:db8::1") == neighbourhood("2001:db8::ffff:1") != "2001:db8::1"
    assert neighbourhood("fe80::1%eth0") == neighbourhood("fe80::2%eth0")
    assert neighbourhood("?") == "?"


def test_the_longest_unseen_share_is_forgotten() -> None:
    shares = Shares(rate=1.0, burst=1.0, most=2)
    assert shares.take("a", 0.0) and not shares.take("a", 0.0)
    assert shares.take("b", 0.0) and shares.take("c", 0.0)
    assert len(shares._buckets) == 2 and shares.take("a", 0.0)


class Later:
    """Calls what is due when a test says that the period is over."""

    def __init__(self) -> None:
        self.due: list[Any] = []

    def __call__(self, seconds: float, call: Any, *args: Any) -> None:
        assert seconds == PERIOD
        self.due.append((call, args))

    def pass_by(self) -> None:
        due, self.due = self.due, []
        for call, args in due:
            call(*args)


def test_of_each_kind_one_line_is_written_in_a_period_and_the_rest_is_summed_up(
    caplog: pytest.LogCaptureFixture,
) -> None:
    later = Later()
    paced = PacedLog(logging.getLogger("test"), later)
    for k in range(1000):
        paced.tell("flood", f"the {k}th")
    paced.tell("other", "of another kind")
    for _ in range(3):
        later.pass_by()
    told = [r.getMessage() for r in caplog.records]
    assert told == ["the 0th", "of another kind", "999 more like it in 10 s; the last: the 999th"]
    assert later.due == []
    paced.tell("flood", "again")
    assert caplog.records[-1].getMessage() == "again"


def test_a_line_is_one_line_that_no_terminal_obeys(caplog: pytest.LogCaptureFixture) -> None:
    paced = PacedLog(logging.getLogger("test"), Later())
    paced.tell("x", "a\x1b[2J\nb" + "c" * 10_000)
    (told,) = [r.getMessage() for r in caplog.records]
    assert told.startswith("a?[2J?b") and len(told) == LONGEST


def test_what_a_library_logs_is_paced_and_has_no_trace(caplog: pytest.LogCaptureFixture) -> None:
    later = Later()
    logger = library_logger("websockets", PacedLog(logging.getLogger("test"), later))
    for _ in range(100):
        try:
            raise ValueError("bad\nrequest")
        except ValueError:
            logger.error("opening handshake failed", exc_info=True)
        logger.info("connection open")
    (record,) = caplog.records
    assert record.getMessage() == "opening handshake failed: ValueError: bad?request"
    assert record.exc_info is None
