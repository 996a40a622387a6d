// The binary skin frame, version 1: plain C++11 without a heap, the same on a board and a host.
//
// 204 bytes of little-endian payload and their CRC-32, stuffed with COBS and ended by a zero byte:
// 210 bytes on the wire. The fields are listed in app/sensing/wire/binary.py.

#pragma once

#include <stddef.h>
#include <stdint.h>

namespace skin {

constexpr size_t kZones = 64;
constexpr size_t kPayload = 12 + 2 * kZones + kZones;
constexpr size_t kPacket = kPayload + 4 + 1;  // with the CRC and the byte that COBS adds
constexpr size_t kWire = kPacket + 1;         // with the delimiter
constexpr uint8_t kKind = 0x11;               // version 1, type 1
constexpr uint8_t kNoTarget = 255;

struct Frame {
  uint8_t sensor;      // index in the skin's layout
  uint8_t resolution;  // zones a row: 8, or 4 for the first 16 zones
  uint16_t sequence;   // of this sensor, wraps
  uint32_t t_us;       // the board's clock at the measurement, wraps
  int8_t temperature;  // [degrees C]
  int16_t distance_mm[kZones];
  uint8_t status[kZones];  // the driver's target status; kNoTarget where there is none
};

// CRC-32 as Ethernet's and zlib's.
uint32_t crc32(const uint8_t* data, size_t size);

// Writes a frame with its delimiter; returns kWire.
size_t encode(const Frame& frame, uint8_t out[kWire]);

// Reads a packet without its delimiter; false, and `frame` untouched, if it is none.
bool decode(const uint8_t* packet, size_t size, Frame& frame);

}  // namespace skin
