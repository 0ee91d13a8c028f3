// SPDX-License-Identifier: MIT
// The order of everything here is that of the table in docs/hil_protocol.md.
#include "configuration.hpp"

#include <ehsid/forgetting.hpp>

#include "kernels.hpp"

namespace servo {

namespace {

struct Head {
  std::uint8_t policy, na, nb, nk, flags;

  bool has(std::uint8_t flag) const { return (flags & flag) != 0; }
  std::uint32_t parameters() const { return std::uint32_t{na} + nb + (has(kOffset) ? 1U : 0U); }
};

Head read_head(Reader& in) {
  Head head{};
  for (std::uint8_t* byte : {&head.policy, &head.na, &head.nb, &head.nk, &head.flags}) {
    *byte = in.u8();
  }
  return head;
}

std::size_t upper(std::size_t n) { return n * (n - 1) / 2; }

/// Each policy has its settings at places of its own among the numbers of the message.
void read_forgetting(Reader& in, std::uint32_t policy, ehsid_forgetting& forgetting) {
  float numbers[ehsid::kHilPlaces];
  for (float& number : numbers) {
    number = in.f32();
  }
  forgetting = {};
  ehsid::for_each_policy([&](auto place) {
    if (policy != place.value) {
      return;
    }
    ehsid::PolicyAt<place, float>::settings([&](const ehsid::SettingInfo& info, auto member) {
      member(forgetting) = numbers[info.hil_place];
    });
  });
}

void read_estimator(Reader& in, const Head& head, ehsid_configuration& c) {
  c.na = head.na;
  c.nb = head.nb;
  c.nk = head.nk;
  c.offset = head.has(kOffset);
  c.reset_enabled = head.has(kReset);
  for (float* value :
       {&c.command_scale, &c.position_scale, &c.command_offset, &c.position_offset}) {
    *value = in.f32();
  }
  read_forgetting(in, head.policy, c.forgetting);
  for (float* value : {&c.information_margin, &c.covariance_ceiling, &c.reset_short_window,
                       &c.reset_long_window, &c.reset_trigger_ratio, &c.reset_release_ratio}) {
    *value = in.f32();
  }
  c.reset_cool_down = in.i32();
  c.reset_floor = in.f32();
  c.convergence_tolerance = in.f32();
  c.convergence_magnitude = in.f32();
  c.convergence_hold = in.i32();
  c.variance0 = in.f32();
  c.input_limit = in.f32();
  c.seed = nullptr;  // set where the seed stays, in ControlLoop::configure
}

void read_controller(Reader& in, std::uint8_t flags, ControllerSettings& s) {
  for (float* value :
       {&s.sample_time_s, &s.fixed_gain_v_m, &s.feed_forward_v_s_m, &s.command_limit_v,
        &s.bandwidth_rad_s, &s.gain_min_v_m, &s.gain_max_v_m, &s.gain_step}) {
    *value = in.f32();
  }
  s.position_control = (flags & kPositionControl) != 0;
  s.follow_estimate = (flags & kFollowEstimate) != 0;
}

void read_seed(Reader& in, std::size_t n, ehsid_estimate& seed) {
  for (std::size_t i = 0; i < n; ++i) {
    seed.theta[i] = in.f32();
  }
  for (std::size_t i = 0; i < n; ++i) {
    seed.d[i] = in.f32();
  }
  for (std::size_t i = 0; i < upper(n); ++i) {
    seed.u[i] = in.f32();
  }
  seed.noise_variance = in.f32();
}

/// Whether watchdog and controller are.
Reason in_range(const Configuration& configuration) {
  const bool good = configuration.watchdog_ms >= 1 && configuration.watchdog_ms <= kMaxWatchdogMs &&
                    configuration.controller.valid();
  return good ? Reason::none : Reason::configuration;
}

}  // namespace

bool configure_length_right(Bytes body) {
  Reader in(body);
  const Head head = read_head(in);
  const std::size_t n = head.parameters();
  const bool seeded = head.has(kSeed) && n > 0;
  return in.good() && body.count == kConfigureBytes + (seeded ? 4 * (2 * n + upper(n) + 1) : 0);
}

Reason read_configuration(Bytes body, Configuration& configuration) {
  Reader in(body);
  const Head head = read_head(in);
  if ((head.flags & ~kKnownFlags) != 0) {
    return Reason::configuration;
  }
  configuration.estimator.kernel = find_kernel(head.policy, head.parameters());
  if (configuration.estimator.kernel == nullptr) {
    return Reason::not_in_firmware;  // before the seed, whose arrays have room for what it holds
  }
  read_estimator(in, head, configuration.estimator);
  read_controller(in, head.flags, configuration.controller);
  configuration.watchdog_ms = in.u32();
  configuration.has_seed = head.has(kSeed);
  if (configuration.has_seed) {
    read_seed(in, head.parameters(), configuration.seed);
  }
  return in_range(configuration);
}

Reason read_servo_configuration(Bytes body, Configuration& configuration) {
  Reader in(body);
  ehsid_servo_settings& servo = configuration.servo;
  configuration.tracks_servo = true;
  servo.delay = in.u8();
  const std::uint8_t flags = in.u8();
  if ((flags & ~kServoFlags) != 0) {
    return Reason::configuration;
  }
  servo.drift = in.f32();
  servo.tolerance = in.f32();
  read_controller(in, flags, configuration.controller);
  servo.dt_s = configuration.controller.sample_time_s;
  configuration.watchdog_ms = in.u32();
  return in_range(configuration);
}

}  // namespace servo
