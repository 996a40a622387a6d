"""Files as people's editors save them: with a byte order mark, in another encoding, as archives."""

import codecs
import gzip
import zipfile

import pytest

from app.config import load_params
from app.errors import ConfigError, SensorError
from app.sensing.replay import read_recording
from app.toml import Table, read_toml


class Small(Table, frozen=True):
    title: str


def test_a_byte_order_mark_is_read_over_in_every_kind_of_file(tmp_path):
    path = tmp_path / "a.toml"
    path.write_bytes(codecs.BOM_UTF8 + 'title = "ä"\n'.encode())
    assert read_toml(path, Small, ConfigError).title == "ä"
    path.write_bytes(codecs.BOM_UTF8 + b"joint_speed = 0.2\n")
    assert load_params(path).joint_speed == 0.2
    csv = tmp_path / "a.csv"
    block = "0,0,0\n" + "500,1,5\n" * 64
    csv.write_bytes(codecs.BOM_UTF8 + (block + block.replace("0,0,0", "1000,0,0")).encode())
    plain = tmp_path / "b.csv"
    plain.write_bytes(csv.read_bytes()[3:])
    assert (read_recording(csv).distance == read_recording(plain).distance).all()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("title = 1\n".encode("utf-16"), "is UTF-16 text"),
        ("title = 1\n".encode("utf-32"), "is UTF-32 text"),
        (gzip.compress(b"title = 1", mtime=0), "is a gzip archive, not UTF-8 text; unpack it"),
        (b"title\0 = 1", "is binary"),
        (b"%PDF-1.7", "is a PDF"),
    ],
)
def test_what_is_no_text_is_named_in_one_line(tmp_path, content, says):
    path = tmp_path / "a.toml"
    path.write_bytes(content)
    for read, error in (
        (lambda: read_toml(path, Small, ConfigError), ConfigError),
        (lambda: load_params(path), ConfigError),
        (lambda: read_recording(path), SensorError),
    ):
        with pytest.raises(error) as found:
            read()
        assert says in str(found.value) and "\n" not in str(found.value)


def test_a_zip_is_named(tmp_path):
    path = tmp_path / "a.toml"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a", "b")
    with pytest.raises(ConfigError, match="is a zip archive"):
        read_toml(path, Small, ConfigError)
