// SPDX-License-Identifier: MIT
// The loop: at each tick of 1 kHz, and at each byte that comes. On a rig of its own the valve's output would be set
// here from valve_command_v(); docs/porting.md says how.
#include "../port.hpp"
#include "servo.hpp"

namespace {

servo::Servo target;  // ~5 KiB, and constants only: no constructor has to run

void send(servo::Bytes bytes) {
  if (bytes.count > 0) {
    port::write(bytes.data, bytes.count);
  }
}

}  // namespace

int main() {
  port::start();
  send(target.power_up(port::board_name(), port::cycles));
  for (;;) {
    send(target.tick(port::milliseconds()));
    std::uint8_t byte = 0;
    while (port::read(byte)) {
      send(target.receive(byte, port::milliseconds()));
    }
    port::wait_for_interrupt();
  }
}
