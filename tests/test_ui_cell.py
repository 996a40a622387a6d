"""What the page shows of the known cell: boxes, planes, learned cubes and their preview."""

import numpy as np
import pytest

from app.cell.learned import Learned
from app.cell.outline import CORNERS, FACES, bottom_of, outline
from app.cell.parts import Box, Cell, HalfSpace
from app.messages import BackgroundView
from app.poses import transform
from app.ui.page import Page
from tests.ui_page import (  # noqa: F401 - fixtures
    FakeEngine,
    run,
    show,
    snapshot,
    the_built,
    the_clock,
    the_engine,
    the_page,
)

NONE = np.empty((0, 3))
CUBES = Learned.of(np.array([[1, 2, 3], [4, 5, 6]])).centres()


def test_boxes_are_drawn_with_twelve_edges_and_planes_as_a_patch(page: Page) -> None:
    lines = page.server.scene.get_handle_by_name("/cell/boxes")
    assert lines is not None and lines.points.shape == (12, 2, 3)
    assert np.abs(lines.points).max(axis=(0, 1)) == pytest.approx([0.5, 0.5, 0.05])
    patch = page.server.scene.get_handle_by_name("/cell/planes/floor")
    assert patch is not None and patch.dimensions[:2] == (2.0, 2.0)


def test_the_edges_of_a_turned_box_are_as_long_as_its_sides() -> None:
    T = transform(np.array([1.0, 2.0, 3.0]), np.array([0.3, 0.2, 0.1]))
    edges = outline(Box("b", T, np.array([1.0, 2.0, 3.0])))
    lengths = np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)
    assert sorted(lengths) == pytest.approx([1.0] * 4 + [2.0] * 4 + [3.0] * 4)
    assert edges.mean(axis=(0, 1)) == pytest.approx(T[:3, 3])


def test_the_faces_of_a_cube_look_outward() -> None:
    a, b, c = np.moveaxis(CORNERS[FACES], 1, 0)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), a + b + c) > 0).all()
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() == pytest.approx(6.0)


def test_learned_cubes_and_their_preview_are_drawn_and_go_again(
    page: Page, engine: FakeEngine
) -> None:
    show(page, engine, snapshot(engine, background=BackgroundView(NONE, CUBES, 0.0)))
    assert page.cell.known.handle is None
    preview = page.cell.preview.handle
    assert preview is not None
    np.testing.assert_allclose(preview.batched_positions, CUBES, atol=1e-6)
    show(page, engine, snapshot(engine, background=BackgroundView(CUBES, NONE, 0.0)))
    known = page.cell.known.handle
    assert known is not None and page.cell.preview.handle is None
    assert tuple(known.batched_colors) != tuple(preview.batched_colors)
    show(page, engine, snapshot(engine, background=BackgroundView(CUBES, NONE, 0.0)))
    assert page.cell.known.handle is known  # the same cubes are not sent again
    show(page, engine, snapshot(engine))
    assert page.cell.known.handle is None


def test_the_switch_hides_the_cell_but_no_preview(page: Page, engine: FakeEngine) -> None:
    root = page.server.scene.get_handle_by_name("/cell")
    assert root is not None and root.visible
    run(page, page.legend.boxes["Cell"], False)
    show(page, engine, snapshot(engine, background=BackgroundView(NONE, CUBES, 0.0)))
    assert not root.visible
    assert page.cell.preview.handle is not None and page.cell.preview.handle.visible
    run(page, page.legend.boxes["Cell"], True)
    assert root.visible


def test_without_a_simulated_world_the_ground_is_the_floor_of_the_cell() -> None:
    floor = HalfSpace("floor", transform(np.array([0.0, 0.0, -0.7]), np.zeros(3)), np.ones(2))
    wall = HalfSpace(
        "wall", transform(np.array([0.0, 2.0, -9.0]), np.array([1.57, 0, 0])), np.ones(2)
    )
    box = Box("table", transform(np.array([0.0, 0.0, -0.1]), np.zeros(3)), np.full(3, 0.2))
    assert bottom_of(Cell(planes=(floor, wall), boxes=(box,))) == -0.7
    assert bottom_of(Cell(planes=(wall,), boxes=(box,))) == pytest.approx(-0.2)
    assert bottom_of(Cell()) == 0.0
