"""What a person does to single sensors from the page: off, frozen, noisy; and what follows."""

import numpy as np
import pytest

from app.actions import SpoilSensor
from app.errors import SensorError
from app.perception.unable import Unable
from app.plant.plant import refusal
from app.plant.real import RealPlant
from app.robot.arm import SimulatedArm
from app.sensing.source import Unfailing
from app.sensing.spoiled import FROZEN, HOW, NOISY, OFF, WELL, SpoiledSkin
from app.setup import Setup
from app.timing import ManualClock
from app.wiring import build_engine
from tests.fakes import frame


class Eye(Unfailing):
    """Two of thirty sensors; what they see comes nearer by a millimetre a frame."""

    name, connected = "two", np.ones(30, dtype=bool)

    def __init__(self):
        self.i = 0

    def poll(self, now, posture):
        self.i += 1
        return [frame(k, now, 1.0 - 0.001 * self.i, sequence=self.i) for k in (3, 4)]

    def ended(self):
        return ""


def polled(eye, i):
    return {f.sensor: f for f in eye.poll(i / 15, None)}


@pytest.mark.parametrize("how", [OFF, FROZEN, NOISY])
def test_one_sensor_is_spoiled_and_made_well_again_and_its_neighbour_never_is(how):
    eye = SpoiledSkin(Eye())
    eye.spoil(3, how)
    assert eye.spoiled == ((3, how),)
    first, second = polled(eye, 1), polled(eye, 2)
    assert first[4].distance.max() == 0.999 and second[4].distance.max() == 0.998
    assert (3 in second) == (how != OFF)
    if how == FROZEN:
        assert (second[3].distance == first[3].distance).all()
        assert second[3].stamp == 2 / 15 and second[3].sequence == 2  # it goes on speaking
    if how == NOISY:
        assert 0.03 < second[3].distance.std() < 0.07
    eye.spoil(3, WELL)
    assert eye.spoiled == () and (polled(eye, 3)[3].distance == 0.997).all()


def test_what_cannot_be_done_is_refused_with_what_can():
    eye = SpoiledSkin(Eye())
    with pytest.raises(SensorError, match="no sensor 30; give 0 to 29"):
        eye.spoil(30, OFF)
    with pytest.raises(SensorError, match=r"known: .*frozen"):
        eye.spoil(3, "melted")
    assert eye.spoiled == () and set(HOW) == {WELL, OFF, FROZEN, NOISY}


def test_a_real_sensor_can_only_be_switched_off(robot):
    plant = RealPlant(robot, SimulatedArm(robot), Eye())
    assert "real sensor cannot be frozen" in refusal(plant, SpoilSensor(3, FROZEN))
    assert refusal(plant, SpoilSensor(3, OFF)) == ""
    reading = plant.read(0.1, 0.5)
    assert [f.sensor for f in reading.frames] == [4]
    assert reading.source.spoiled == ((3, OFF),)


def test_a_sensor_that_is_switched_off_counts_as_blind():
    engine = build_engine(Setup(scene="empty", rate=60.0), ManualClock())
    for _ in range(30):
        seen = engine.step()
    assert seen.unable[17] == Unable.SEES and seen.spoiled == ()
    engine.post(SpoilSensor(17, OFF))
    for _ in range(60):
        seen = engine.step()
    assert seen.unable[17] == Unable.SILENT and seen.blind > 0.0
    assert seen.spoiled == ((17, OFF),) and not seen.notice.refused
    assert np.flatnonzero(seen.unable).tolist() == [17]
