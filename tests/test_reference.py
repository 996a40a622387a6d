"""`robots/README.md` says what the code takes: `make reference` renews it."""

from importlib import util
from pathlib import Path
from xml.etree import ElementTree

import msgspec
import pytest

ROBOTS = Path(__file__).parent.parent / "robots"
spec = util.spec_from_file_location("reference", ROBOTS / "reference.py")
reference = util.module_from_spec(spec)
spec.loader.exec_module(reference)


@pytest.mark.parametrize("struct", reference.TABLES, ids=lambda s: s.__name__)
def test_every_key_is_told(struct):
    told = reference.texts(struct)
    assert {f.name for f in msgspec.structs.fields(struct)} - set(told) == set()
    assert all(told.values())


def test_the_reference_is_up_to_date():
    text = (ROBOTS / "README.md").read_text("utf-8")
    assert text == reference.renewed(text), "make reference"
    for struct in reference.TABLES:
        assert f"<!-- keys {struct.__name__} -->" in text


def test_the_drawing_is_up_to_date_and_numbers_every_sensor(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    drawn = (ROBOTS / "ring.svg").read_text("utf-8")
    assert drawn == reference.drawing(), "make reference"
    root = ElementTree.fromstring(drawn)
    words = [e.text for e in root.iter("{http://www.w3.org/2000/svg}text")]
    assert {f"{i:02d}" for i in range(1, 9)} | {"axis", "start"} <= set(words)
