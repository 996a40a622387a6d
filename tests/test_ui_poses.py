"""Many nodes moved at once: the same poses as viser's own, fewer messages, far less time."""

import time
from collections.abc import Iterator

import numpy as np
import pytest
import viser
from hypothesis import given
from hypothesis import strategies as st

from app.messages import Array
from app.poses import quaternion
from app.ui.scene.poses import STILL, Nodes, follow, wxyz
from tests.ui_page import serving

COUNT = 12


@pytest.fixture(scope="module")
def frames() -> Iterator[tuple[viser.ViserServer, list[viser.FrameHandle]]]:
    with serving(port=0) as server:
        yield server, [server.scene.add_frame(f"/f{k}") for k in range(COUNT)]


def turned(axis: list[float], angle: float) -> Array:
    T = np.eye(4)
    direction = np.array(axis) / np.linalg.norm(axis)
    T[:3, :3] = viser.transforms.SO3.exp(angle * direction).as_matrix()
    return T


def sent(server: viser.ViserServer) -> int:
    return server._websock_server._broadcast_buffer.message_counter


unit = st.floats(-1.0, 1.0)


@given(st.tuples(unit, unit, unit).filter(lambda v: np.linalg.norm(v) > 0.1), st.floats(-3.2, 3.2))
def test_a_quaternion_is_the_one_of_viser(axis: tuple[float, float, float], angle: float) -> None:
    T = turned(list(axis), angle)
    ours, theirs = np.array(quaternion(T)), wxyz(T)
    assert ours[0] >= 0.0
    np.testing.assert_allclose(ours * np.sign(ours @ theirs), theirs, atol=1e-9)


@pytest.mark.parametrize("axis", np.eye(3))
def test_half_a_turn_has_a_quaternion(axis: Array) -> None:
    q = np.array(quaternion(turned(list(axis), np.pi)))
    np.testing.assert_allclose(np.abs(q), [0.0, *axis], atol=1e-9)


def test_only_what_moved_is_sent(
    frames: tuple[viser.ViserServer, list[viser.FrameHandle]],
) -> None:
    server, handles = frames
    nodes, T = Nodes(handles), np.tile(np.eye(4), (COUNT, 1, 1))
    nodes.show(T)
    before = sent(server)
    nodes.show(T.copy())
    assert sent(server) == before
    T[3, 0, 3], T[5] = 0.4, turned([0.0, 0.0, 1.0], 0.3)
    nodes.show(T)
    assert sent(server) == before + 2
    assert handles[3].position[0] == 0.4
    np.testing.assert_allclose(handles[5].wxyz, wxyz(T[5]), atol=1e-9)


def test_a_slow_node_never_lags_by_more_than_can_be_seen(
    frames: tuple[viser.ViserServer, list[viser.FrameHandle]],
) -> None:
    _, handles = frames
    nodes, T = Nodes(handles[:1]), np.eye(4)[None].copy()
    for x in np.arange(0.0, 0.01, 0.3 * STILL):
        T[0, 0, 3] = x
        nodes.show(T)
        assert abs(handles[0].position[0] - x) <= STILL


def test_a_handle_that_a_mouse_moved_comes_back(
    frames: tuple[viser.ViserServer, list[viser.FrameHandle]],
) -> None:
    server, (handle, *_) = frames
    T = turned([1.0, 2.0, 3.0], 0.7)
    T[:3, 3] = [0.1, 0.2, 0.3]
    handle._impl.position[:] = 9.0
    handle._impl.wxyz[:] = -wxyz(T)  # the same turn
    before = sent(server)
    follow(handle, T)
    follow(handle, T)
    assert sent(server) == before + 1
    np.testing.assert_array_equal(handle.position, T[:3, 3])


def test_moving_all_at_once_takes_a_fraction_of_moving_one_by_one(
    frames: tuple[viser.ViserServer, list[viser.FrameHandle]],
) -> None:
    """The pump shares the interpreter with the thread that moves the arm."""
    _, handles = frames
    nodes, T = Nodes(handles), np.tile(np.eye(4), (COUNT, 1, 1))
    together, apart = [], []
    for k in range(60):
        T[0, 0, 3] = 0.01 * k  # one moves, the others are as they were
        begin = time.perf_counter()
        nodes.show(T)
        middle = time.perf_counter()
        for handle, pose, q in zip(handles, T, wxyz(T), strict=True):
            handle.position, handle.wxyz = pose[:3, 3], q
        together.append(middle - begin)
        apart.append(time.perf_counter() - middle)
    assert np.median(together) < 0.2 * np.median(apart)
