"""Paths with signs that mean something elsewhere: one that exists is a path."""

import shutil

import pytest

from app.paths import entries, path_and_name
from app.sensing.port_spec import parse_ports


@pytest.mark.parametrize("name", ["a@b.csv", "a,b", "a#1=x", "a:latency_ms=1", "plain"])
def test_a_path_that_exists_is_a_path_whatever_signs_it_has(tmp_path, skin, name):
    path = tmp_path / name
    path.touch()
    assert path_and_name(str(path)) == (str(path), "")
    assert path_and_name(f"{path}@ring1-03") == (str(path), "ring1-03")
    assert entries(f"{path},/dev/none") == [str(path), "/dev/none"]
    (spec,) = parse_ports(str(path), skin)
    assert (spec.port, spec.baud, spec.format) == (str(path), 0, "")
    one, two = parse_ports(f"{path}@9600#lines=ring1-03:latency_ms=20,/dev/none@9600", skin)
    assert (one.port, one.baud, one.format, one.sensors) == (str(path), 9600, "lines", (2,))
    assert one.latency == pytest.approx(0.02) and two.port == "/dev/none"


def test_what_does_not_exist_ends_at_its_first_sign(tmp_path):
    assert path_and_name("none@ring1@x") == ("none", "ring1@x")
    assert entries(" a, b ,") == ["a", "b", ""]
    assert path_and_name("x" * 5000) == ("x" * 5000, "")
    shutil.rmtree(tmp_path)
