"""The board's C++ on the host: its frames are the decoder's, both ways, and the sketch runs."""

import shutil
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest
from cobs import cobs

from app.sensing.wire import binary
from app.sensing.wire.raw import RawFrame

FOLDER = Path(__file__).parent.parent / "robots/ur10e/skin/firmware"
WARNINGS = ["-std=c++11", "-Wall", "-Wextra", "-Werror"]
TRAPS = ["-fsanitize=undefined", "-fsanitize-undefined-trap-on-error"]  # needs no library

HOST = r"""
#include <cstdio>
#include <cstring>
#include <vector>
#include "frame.h"

// encode: numbers in, packets out; decode: bytes in, numbers out
int main(int argc, char** argv) {
  if (argc > 1 && !std::strcmp(argv[1], "encode")) {
    int v[5];
    while (std::scanf("%d %d %d %d %d", v, v + 1, v + 2, v + 3, v + 4) == 5) {
      skin::Frame f;
      f.sensor = v[0]; f.resolution = v[1]; f.sequence = v[2]; f.t_us = v[3]; f.temperature = v[4];
      for (auto& d : f.distance_mm) { int x; if (std::scanf("%d", &x) != 1) return 1; d = x; }
      for (auto& s : f.status) { int x; if (std::scanf("%d", &x) != 1) return 1; s = x; }
      unsigned char out[skin::kWire];
      std::fwrite(out, 1, skin::encode(f, out), stdout);
    }
    return 0;
  }
  std::vector<unsigned char> packet;
  for (int c; (c = std::getchar()) != EOF;) {
    if (c) { packet.push_back(c); continue; }
    skin::Frame f;
    if (skin::decode(packet.data(), packet.size(), f)) {
      std::printf("%d %d %d %u %d", f.sensor, f.resolution, f.sequence, f.t_us, f.temperature);
      for (auto d : f.distance_mm) std::printf(" %d", d);
      for (auto s : f.status) std::printf(" %d", s);
      std::printf("\n");
    }
    packet.clear();
  }
}
"""

ARDUINO = r"""
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>
extern uint32_t now_us;
inline uint32_t micros() { return now_us; }
struct SerialPort {
  void begin(uint32_t baud) { if (baud != 2000000) std::abort(); }
  void write(const uint8_t* data, size_t size) { std::fwrite(data, 1, size, stdout); }
};
extern SerialPort Serial;
"""

WIRE = r"""
#pragma once
struct TwoWire {
  void begin() {}
  void setClock(uint32_t hz) { if (hz != 1000000) std::abort(); }
};
extern TwoWire Wire;
"""

SENSOR = r"""
#pragma once
#include <cstring>
#include <set>
#define VL53L8CX_RESOLUTION_8X8 64
#define VL53L8CX_TARGET_ORDER_CLOSEST 1
struct VL53L8CX_ResultsData {
  int8_t silicon_temp_degc;
  uint8_t nb_target_detected[64];
  int16_t distance_mm[64];
  uint8_t target_status[64];
};
// A sensor on a bus on which nobody may share an address, and number 4 is broken.
struct VL53L8CX {
  static std::set<int>& taken() { static std::set<int> s; return s; }
  static int count() { static int n; return n++; }
  int k = count(), lpn, address = 0x52, frames = 0;
  bool awake = true, set_up = false, ranging = false;
  VL53L8CX(TwoWire*, int pin) : lpn(pin) {}
  int begin() { return 0; }
  void off() { awake = false; if (address != 0x52) taken().erase(address); }
  void on() { awake = true; }
  uint8_t set_i2c_address(uint16_t a) {
    if (!awake || !taken().insert(a).second) std::abort();
    address = a;
    return 0;
  }
  uint8_t is_alive(uint8_t* p) { *p = k != 4; return 0; }
  uint8_t init() { if (address == 0x52) std::abort(); set_up = true; return 0; }
  uint8_t set_resolution(uint8_t r) { return r != 64 || !set_up; }
  uint8_t set_ranging_frequency_hz(uint8_t hz) { return hz != 15; }
  uint8_t set_target_order(uint8_t order) { return order != 1; }
  uint8_t start_ranging() { ranging = true; return 0; }
  uint8_t check_data_ready(uint8_t* p) {
    if (!ranging || !awake) std::abort();
    *p = now_us / 66667 > (uint32_t)frames;
    return 0;
  }
  uint8_t get_ranging_data(VL53L8CX_ResultsData* r) {
    ++frames;
    r->silicon_temp_degc = 40 + k;
    for (int z = 0; z < 64; ++z) {
      r->nb_target_detected[z] = z != 7;
      r->distance_mm[z] = 100 * k + z;
      r->target_status[z] = 5;
    }
    return 0;
  }
};
"""

RUN = r"""
#include <cstddef>
#include "Arduino.h"
uint32_t now_us = 0;
SerialPort Serial;
#include "Wire.h"
TwoWire Wire;
#include "firmware.ino"
int main() {
  setup();
  for (; now_us < 1000000; now_us += 500) loop();
}
"""


def build(folder, *sources):
    """A program of `sources`; without a compiler the test is skipped."""
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("no g++ here; install the package g++ to compile the firmware's framing")
    out = folder / "program"
    flags = (FOLDER / "build_opt.h").read_text().split()
    command = [
        compiler,
        *WARNINGS,
        *TRAPS,
        *flags,
        f"-I{FOLDER}",
        f"-I{folder}",
        *sources,
        "-o",
        str(out),
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture(scope="module")
def host(tmp_path_factory):
    folder = tmp_path_factory.mktemp("framing")
    (folder / "host.cpp").write_text(HOST)
    program = build(folder, str(folder / "host.cpp"), str(FOLDER / "frame.cpp"))

    def run(mode, data):
        done = subprocess.run([program, mode], input=data, capture_output=True, timeout=60)
        assert done.returncode == 0, done.stderr.decode()
        return done.stdout

    return run


def some(count, seed=0):
    """Frames with everything in them, zeros and extremes above all."""
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(count):
        kind = rng.integers(3)
        distance = rng.integers(-32768, 32768, 64)
        status = rng.choice([0, 1, 5, 9, 255], 64)
        if kind == 0:
            distance, status = np.zeros(64), np.zeros(64)
        elif kind == 1:
            distance = rng.choice([0, 1, 256, -1, 32767, -32768], 64)
        n = int(rng.choice([4, 8]))
        distance, status = distance[: n * n], status[: n * n]
        out.append(
            RawFrame(
                int(rng.integers(256)), int(rng.integers(1 << 16)), int(rng.integers(1 << 31)),
                (n, n), distance.astype(np.int16), status.astype(np.uint8),
                int(rng.integers(-128, 128)),
            )
        )  # fmt: skip
    return out


def numbers(f):
    head = (f.sensor, f.grid[0], f.sequence, f.t_us, f.temperature)
    unused = 64 - len(f.distance)  # a board has room for 64 zones
    return [*head, *f.distance.tolist(), *[0] * unused, *f.status.tolist(), *[255] * unused]


def test_the_boards_frames_are_byte_for_byte_the_hosts(host):
    frames = some(300)
    said = host("encode", "\n".join(" ".join(map(str, numbers(f))) for f in frames).encode())
    assert said == b"".join(map(binary.encode, frames))
    read = binary.Binary().feed(said)
    assert [numbers(f) for f in read] == [numbers(f) for f in frames]


def test_the_board_reads_what_the_host_writes(host):
    frames = some(300, seed=1)
    lines = host("decode", b"".join(map(binary.encode, frames))).decode().splitlines()
    assert [[int(v) for v in line.split()] for line in lines] == [numbers(f) for f in frames]


def test_both_refuse_the_same_garbage(host):
    rng = np.random.default_rng(2)
    stream = b""
    for f in some(400, seed=3):
        packet = bytearray(binary.encode(f))
        for bit in rng.integers(210 * 8, size=rng.integers(0, 4)):
            packet[bit // 8] ^= 1 << (bit % 8)
        stream += bytes(packet) + rng.bytes(int(rng.integers(0, 5))) + b"\0" * int(rng.integers(2))
    # right checksums around wrong fields
    for at, value in ((0, 0x21), (2, 5), (10, 0)):
        payload = bytearray(cobs.decode(binary.encode(some(1)[0])[:-1])[:204])
        payload[at] = value
        stream += b"\0" + cobs.encode(bytes(payload) + zlib.crc32(payload).to_bytes(4, "little"))
    stream += b"\0"
    ours = [numbers(f) for f in binary.Binary().feed(stream)]
    theirs = [
        [int(v) for v in line.split()] for line in host("decode", stream).decode().split("\n")[:-1]
    ]
    assert theirs == ours and 50 < len(ours) < 350


def test_the_sketch_gives_addresses_and_streams_every_sensor_that_lives(tmp_path):
    for name, text in (
        ("Arduino.h", ARDUINO), ("Wire.h", WIRE), ("vl53l8cx.h", SENSOR), ("run.cpp", RUN),
    ):  # fmt: skip
        (tmp_path / name).write_text(text)
    program = build(tmp_path, str(tmp_path / "run.cpp"), str(FOLDER / "frame.cpp"))
    done = subprocess.run([program], capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr.decode()
    decoder = binary.Binary()
    frames = decoder.feed(done.stdout)
    assert not decoder.refused and len(frames) == 9 * 14
    for k in (k for k in range(10) if k != 4):
        own = [f for f in frames if f.sensor == k]
        assert [f.sequence for f in own] == list(range(14))
        assert own[0].distance.tolist() == [100 * k + z for z in range(64)]
        assert own[0].status[7] == 255 and (own[0].status != 255).sum() == 63
        assert own[0].temperature == 40 + k
        assert np.diff([f.t_us for f in own]) == pytest.approx(66667, abs=600)
