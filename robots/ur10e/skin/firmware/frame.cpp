#include "frame.h"

namespace skin {
namespace {

// COBS: every zero becomes the distance to the next one; `out` has room for size + 1 bytes,
// which is enough below 254.
void stuff(const uint8_t* in, size_t size, uint8_t* out) {
  size_t code = 0;
  for (size_t i = 0; i < size; ++i) {
    out[i + 1] = in[i];
    if (in[i] == 0) {
      out[code] = static_cast<uint8_t>(i + 1 - code);
      code = i + 1;
    }
  }
  out[code] = static_cast<uint8_t>(size + 1 - code);
}

bool unstuff(const uint8_t* in, size_t size, uint8_t* out) {
  for (size_t i = 0; i < size;) {
    const size_t next = i + in[i];
    if (in[i] == 0 || next > size) return false;
    while (++i < next) {
      if (in[i] == 0) return false;
      out[i - 1] = in[i];
    }
    if (next < size) out[next - 1] = 0;
  }
  return true;
}

void put(uint8_t*& at, uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) *at++ = static_cast<uint8_t>(value >> (8 * i));
}

uint32_t get(const uint8_t*& at, int bytes) {
  uint32_t value = 0;
  for (int i = 0; i < bytes; ++i) value |= static_cast<uint32_t>(*at++) << (8 * i);
  return value;
}

uint8_t count_targets(const uint8_t* status) {
  uint8_t count = 0;
  for (size_t z = 0; z < kZones; ++z) count += status[z] != kNoTarget;
  return count;
}

}  // namespace

uint32_t crc32(const uint8_t* data, size_t size) {
  // by nibbles: sixteen words of table instead of 256
  static const uint32_t table[16] = {
      0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4,
      0x4db26158, 0x5005713c, 0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c,
      0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c};
  uint32_t crc = 0xffffffff;
  for (size_t i = 0; i < size; ++i) {
    crc = table[(crc ^ data[i]) & 15] ^ (crc >> 4);
    crc = table[(crc ^ (data[i] >> 4)) & 15] ^ (crc >> 4);
  }
  return ~crc;
}

size_t encode(const Frame& frame, uint8_t out[kWire]) {
  uint8_t payload[kPayload + 4];
  uint8_t* at = payload;
  put(at, kKind, 1);
  put(at, frame.sensor, 1);
  put(at, frame.resolution, 1);
  put(at, frame.sequence, 2);
  put(at, frame.t_us, 4);
  put(at, static_cast<uint8_t>(frame.temperature), 1);
  put(at, count_targets(frame.status), 1);
  put(at, 0, 1);
  for (size_t z = 0; z < kZones; ++z) put(at, static_cast<uint16_t>(frame.distance_mm[z]), 2);
  for (size_t z = 0; z < kZones; ++z) put(at, frame.status[z], 1);
  put(at, crc32(payload, kPayload), 4);
  stuff(payload, sizeof payload, out);
  out[kPacket] = 0;
  return kWire;
}

bool decode(const uint8_t* packet, size_t size, Frame& frame) {
  uint8_t payload[kPacket];
  if (size != kPacket || !unstuff(packet, size, payload)) return false;
  const uint8_t* at = payload + kPayload;
  if (get(at, 4) != crc32(payload, kPayload)) return false;
  at = payload;
  Frame read;
  if (get(at, 1) != kKind) return false;
  read.sensor = static_cast<uint8_t>(get(at, 1));
  read.resolution = static_cast<uint8_t>(get(at, 1) & 15);
  read.sequence = static_cast<uint16_t>(get(at, 2));
  read.t_us = get(at, 4);
  read.temperature = static_cast<int8_t>(get(at, 1));
  const uint8_t targets = static_cast<uint8_t>(get(at, 1));
  get(at, 1);
  for (size_t z = 0; z < kZones; ++z) read.distance_mm[z] = static_cast<int16_t>(get(at, 2));
  for (size_t z = 0; z < kZones; ++z) read.status[z] = static_cast<uint8_t>(get(at, 1));
  if (read.resolution != 4 && read.resolution != 8) return false;
  if (targets != count_targets(read.status)) return false;
  frame = read;
  return true;
}

}  // namespace skin
