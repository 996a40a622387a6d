"""The modelling scripts make the very files that are shipped: `make robot`."""

import sys
from importlib import util
from pathlib import Path

import numpy as np
import pytest
import trimesh

ROBOTS = Path(__file__).parent.parent / "robots"
SCRIPTS = [
    ("ur10e/model.py", "ur10e/meshes", 14),
    ("ur10e/skin/covers.py", "ur10e/meshes", 2),
    ("ur10e/tools/screwdriver.py", "ur10e/tools/meshes", 2),
    ("swan7/model.py", "swan7", 16),
]


def load(script, monkeypatch):
    """A script as a module; what it puts on the path or imports as `model` is undone."""
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "model", raising=False)
    spec = util.spec_from_file_location(f"script_{Path(script).stem}", ROBOTS / script)
    module = util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
@pytest.mark.parametrize(("script", "folder", "files"), SCRIPTS)
def test_a_script_writes_the_shipped_meshes_within_a_micrometre(
    script, folder, files, tmp_path, monkeypatch
):
    pytest.importorskip("skimage", reason="`make robot` installs it")
    for kind in ("visual", "body"):
        (tmp_path / kind).mkdir()
    load(script, monkeypatch).main(tmp_path)
    monkeypatch.delitem(sys.modules, "model", raising=False)
    made = [p for p in sorted(tmp_path.rglob("*")) if p.suffix in (".glb", ".stl")]
    assert len(made) == files
    for path in made:
        new = trimesh.load_scene(path, process=False)
        old = trimesh.load_scene(ROBOTS / folder / path.relative_to(tmp_path), process=False)
        assert list(new.geometry) == list(old.geometry)
        for name, mesh in new.geometry.items():
            assert np.array_equal(mesh.faces, old.geometry[name].faces)
            assert mesh.vertices == pytest.approx(old.geometry[name].vertices, abs=1e-6)


def test_the_covers_follow_the_layout_file(monkeypatch):
    pytest.importorskip("skimage", reason="`make robot` installs it")
    covers = load("ur10e/skin/covers.py", monkeypatch)
    table = {"inner_radius_m": 0.05, "rim_m": 0.004, "window_half_m": [0.005, 0.004]}
    rest = {"foot_radius_m": 0.052, "foot_half_width_m": 0.02, "land_half_width_m": 0.01}
    size = covers.read_cover(table | rest | {"floor_m": 0.001})
    (part,) = covers.cover(60.0, 10, size, covers.BODY)
    body = part.solid
    low, high = np.array(body.bounding_box()).reshape(2, 3)
    assert high[0] == pytest.approx(64.0, abs=0.1)
    assert [low[2], high[2]] == pytest.approx([-20.0, 20.0])
    monkeypatch.delitem(sys.modules, "model", raising=False)
