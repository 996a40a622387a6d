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
    """A script as a module."""
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
    made = [p for p in sorted(tmp_path.rglob("*")) if p.suffix in (".glb", ".stl")]
    assert len(made) == files
    for path in made:
        new = trimesh.load_scene(path, process=False)
        old = trimesh.load_scene(ROBOTS / folder / path.relative_to(tmp_path), process=False)
        assert list(new.geometry) == list(old.geometry)
        for name, mesh in new.geometry.items():
            assert np.array_equal(mesh.faces, old.geometry[name].faces)
            assert mesh.vertices == pytest.approx(old.geometry[name].vertices, abs=1e-6)


def test_the_shipped_covers_are_those_of_the_shipped_layout(tmp_path, monkeypatch):
    script = load("ur10e/skin/covers.py", monkeypatch)
    for kind in ("visual", "body"):
        (tmp_path / kind).mkdir()
    script.main(tmp_path)
    for file in ("visual/skin_cover.glb", "body/skin_cover.stl"):
        assert (tmp_path / file).read_bytes() == (ROBOTS / "ur10e/meshes" / file).read_bytes()
