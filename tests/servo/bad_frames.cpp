// SPDX-License-Identifier: MIT
// Prints what the firmware answers to bad frames and requests: what is wrong, the bytes or the request, the answer; tabs
// in between. The output is kept in bad_frames.txt, from which docs/bad_input.md takes it. After each of them the
// target still answers `hello`.
#include <cmath>
#include <cstdio>
#include <limits>

#include "session.hpp"

namespace {

using test::Body;
using test::Host;
using test::Packet;
using test::Settings;

bool sound = true;

const char* words(std::uint8_t reason) {
  switch (static_cast<servo::Reason>(reason)) {
    case servo::Reason::state:
      return "refused: not in this state";
    case servo::Reason::order:
      return "refused: another sample is expected";
    case servo::Reason::unknown:
      return "refused: an unknown request, or a body of another length";
    case servo::Reason::configuration:
      return "refused: a setting is out of its range";
    case servo::Reason::not_in_firmware:
      return "refused: the firmware has no such estimator";
    case servo::Reason::none:
      break;
  }
  return "?";
}

/// Prints the outcome and checks that a host is still answered.
void say(const char* wrong, const char* shown, Host& host, const test::Heard& heard) {
  const char* answer = "dropped, and counted as a bad frame";
  if (heard.kind == 0x85) {
    answer = words(heard.body[0]);
  } else if (heard.kind != 0) {
    answer = "answered";
  }
  std::printf("%s\t%s\t%s\n", wrong, shown, answer);
  sound = host.hello().kind == 0x81 && sound;
}

/// Bytes on the line of a target that has just been switched on.
void line(const char* wrong, const char* shown, const Packet& bytes) {
  Host host;
  say(wrong, shown, host, test::hear(host.send(bytes)));
}

/// A packet with the right check sum.
void packet(const char* wrong, const char* shown, const Packet& bytes) {
  line(wrong, shown, test::framed(bytes));
}

template <class Wanted>
void configuration(const char* wrong, const char* shown, const Wanted& settings) {
  Host host;
  host.hello();
  say(wrong, shown, host, host.configure(settings));
}

void frames() {
  Packet hello = test::framed({1, 1, 0, 1, 0});
  Packet flipped = hello;
  flipped[2] ^= 4U;
  line("a bit flipped on the way", "hello with another byte 2", flipped);
  Packet cut(hello.begin(), hello.end() - 3);
  cut.push_back(0);
  line("a frame cut short", "hello without its last bytes", cut);
  line("a block that ends too early", "05 61 62 00", {5, 0x61, 0x62, 0});
  line("a frame of one byte", "01 00", {1, 0});
  line("a packet of four bytes", "05 01 01 01 01 00", {5, 1, 1, 1, 1, 0});
  Packet flood(1000, 0x55);
  flood.push_back(0);
  line("1000 bytes without a zero", "55 55 ... 55 00", flood);
  Packet text{'A', 'T', '\r', '\n', 0};
  line("text for a modem", "\"AT\\r\\n\" 00", text);
}

void packets() {
  packet("no such request", "kind 0x77", {0x77, 1, 0});
  packet("an answer for a request", "kind 0x84", {0x84, 1, 0});
  packet("a hello without its version", "hello of 0 bytes", {1, 1, 0});
  packet("a hello that is too long", "hello of 3 bytes", {1, 1, 0, 1, 0, 9});
  packet("a configuration cut short", "configure of 10 bytes",
         {2, 1, 0, 3, 3, 3, 3, 1, 0, 0, 0, 0, 0});
  packet("a configuration of a servo cut short", "configure_servo of 4 bytes",
         {7, 1, 0, 1, 4, 0, 0});
  packet("a start without its number", "start of 0 bytes", {3, 1, 0});
  packet("a sample that is too short", "sample of 4 bytes", {4, 1, 0, 0, 0, 0, 0});
  packet("a start before a configuration", "start(0)", {3, 1, 0, 0, 0, 0, 0});
  packet("a stop before a configuration", "stop()", {6, 1, 0});
  packet("resume of a valve that is not closed", "resume()", {5, 1, 0});
}

void samples() {
  Host host = test::running();
  say("a number that is too far ahead", "sample(1001) in place of sample(0)", host,
      host.sample(1001, 0.0F));
  Host stopped = test::running();
  stopped.stop();
  say("a sample behind a stop", "sample(0)", stopped, stopped.sample(0, 0.0F));
  Host late = test::running();
  late.wait(101);
  say("a sample behind the watchdog", "sample(0)", late, late.sample(0, 0.0F));
  Host odd = test::running();
  const test::Heard heard = odd.sample(0, std::nanf(""));
  const float volts = test::command_of(heard);
  std::printf(
      "a position that is not a number\tsample(0, NaN)\tanswered with status invalid_input "
      "and a command of %g V\n",
      static_cast<double>(volts));
  sound = test::status_of(heard) == 5 && volts == 0.0F && sound;
}

void configurations() {
  Settings settings;
  settings.policy = 99;
  configuration("no such forgetting policy", "configure(policy = 99)", settings);
  settings = {};
  settings.na = 6;
  settings.nb = 6;
  configuration("orders without an estimator in the firmware", "configure(na = 6, nb = 6)",
                settings);
  settings = {};
  settings.na = 0;
  configuration("an order of 0", "configure(na = 0)", settings);
  settings = {};
  settings.nk = 200;
  configuration("a delay of 200 samples", "configure(nk = 200)", settings);
  settings = {};
  settings.scaling[0] = 0.0F;
  configuration("a scale of 0", "configure(command_scale = 0)", settings);
  settings = {};
  settings.scaling[1] = std::numeric_limits<float>::quiet_NaN();
  configuration("a scale that is not a number", "configure(position_scale = NaN)", settings);
  settings = {};
  settings.controller[0] = 0.0F;
  configuration("a sampling time of 0", "configure(dt_s = 0)", settings);
  settings = {};
  settings.hold = 0;
  configuration("a hold of 0 samples", "configure(hold = 0)", settings);
  settings = {};
  settings.watchdog_ms = 0;
  configuration("a watchdog of 0 ms", "configure(watchdog_ms = 0)", settings);
  test::ServoSettings servo;
  servo.delay = 0;
  configuration("a servo without a delay", "configure_servo(delay = 0)", servo);
  servo = {};
  servo.tolerance = std::numeric_limits<float>::quiet_NaN();
  configuration("a tolerance that is not a number", "configure_servo(tolerance = NaN)", servo);
  servo = {};
  servo.flags |= ::servo::kSeed;
  configuration("a servo from an estimate", "configure_servo(flags = seed)", servo);
}

}  // namespace

int main() {
  frames();
  packets();
  samples();
  configurations();
  return sound ? 0 : 1;
}
