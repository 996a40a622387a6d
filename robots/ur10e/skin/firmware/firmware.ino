// Ten VL53L8CX on one I2C bus, streamed as binary skin frames: one ring of the forearm's skin.
//
// Boards: any with a 1 MHz I2C bus, ten free pins and either USB-CDC or a 2 Mbaud UART (STM32duino
// and Arduino-ESP32 cores). Library: STM32duino VL53L8CX, 2.0 or newer. `build_opt.h` trims what
// the sensors send: in full, ten of them at 15 Hz need twice what the bus can carry.

#include <Arduino.h>
#include <Wire.h>
#include <vl53l8cx.h>

#include "frame.h"

// --- what differs from board to board ---------------------------------------------------

constexpr uint8_t kFirstId = 0;  // id of this ring's first sensor: 0, 10, 20 for ring1, 2, 3
constexpr uint8_t kSensors = 10;
constexpr int kLpn[kSensors] = {2, 3, 4, 5, 6, 7, 8, 9, 10, 11};  // each sensor's LPn, ring order

// -----------------------------------------------------------------------------------------

constexpr uint32_t kBusHz = 1000000;   // the sensor's fastest (DS13754)
constexpr uint32_t kBaud = 2000000;    // three rings fill half of it; USB-CDC ignores it
constexpr uint8_t kRateHz = 15;        // the fastest at 8x8 (UM3109)
constexpr uint16_t kFirstAddress = 0x54;  // 8-bit; 0x52 is everyone's until it gets its own

static_assert(VL53L8CX_NB_TARGET_PER_ZONE == 1, "a frame holds one target a zone");

VL53L8CX* sensors[kSensors];
bool alive[kSensors];
uint16_t sequence[kSensors];

// Addresses are volatile and all sensors wake up with the same one. A sensor with LPn low keeps
// off the bus, so they are let on one by one and moved away before the next comes.
bool start(uint8_t k) {
  VL53L8CX& sensor = *sensors[k];
  sensor.on();
  if (sensor.set_i2c_address(kFirstAddress + 2 * k) != 0) return false;
  uint8_t here = 0;
  if (sensor.is_alive(&here) != 0 || here == 0) return false;
  return sensor.init() == 0  // uploads the sensor's own firmware, about 84 kB: a second
         && sensor.set_resolution(VL53L8CX_RESOLUTION_8X8) == 0
         && sensor.set_ranging_frequency_hz(kRateHz) == 0
         && sensor.set_target_order(VL53L8CX_TARGET_ORDER_CLOSEST) == 0
         && sensor.start_ranging() == 0;
}

void setup() {
  Serial.begin(kBaud);
  Wire.begin();
  Wire.setClock(kBusHz);
  for (uint8_t k = 0; k < kSensors; ++k) {
    sensors[k] = new VL53L8CX(&Wire, kLpn[k]);
    sensors[k]->begin();
    sensors[k]->off();
  }
  for (uint8_t k = 0; k < kSensors; ++k) {
    alive[k] = start(k);
    // one that does not start must not answer at an address that is meant for another; the
    // host sees that its id never speaks
    if (!alive[k]) sensors[k]->off();
  }
}

void send(uint8_t k, const VL53L8CX_ResultsData& results, uint32_t t_us) {
  skin::Frame frame;
  frame.sensor = kFirstId + k;
  frame.resolution = 8;
  frame.sequence = sequence[k]++;
  frame.t_us = t_us;
  frame.temperature = results.silicon_temp_degc;
  for (size_t z = 0; z < skin::kZones; ++z) {
    const bool seen = results.nb_target_detected[z] > 0;
    frame.distance_mm[z] = results.distance_mm[z];
    frame.status[z] = seen ? results.target_status[z] : skin::kNoTarget;
  }
  uint8_t wire[skin::kWire];
  Serial.write(wire, skin::encode(frame, wire));
}

void loop() {
  static VL53L8CX_ResultsData results;  // too large for the stack of a small board
  for (uint8_t k = 0; k < kSensors; ++k) {
    uint8_t ready = 0;
    if (!alive[k] || sensors[k]->check_data_ready(&ready) != 0 || !ready) continue;
    const uint32_t t_us = micros();  // the pulse was measured up to one round of this loop before
    if (sensors[k]->get_ranging_data(&results) == 0) send(k, results, t_us);
  }
}
