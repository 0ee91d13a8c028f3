// SPDX-License-Identifier: MIT
// A run, and what its answers say.
#pragma once

#include <servo/velocity_gain.hpp>

#include <algorithm>
#include <iterator>
#include <random>
#include <vector>

#include "host.hpp"

namespace test {

inline void expect_done(const Heard& heard, servo::State state) {
  EXPECT_EQ(heard.kind, 0x82);
  ASSERT_EQ(heard.body.size(), 1U);
  EXPECT_EQ(heard.body[0], static_cast<int>(state));
}

/// Refused, in the state that the target stays in.
inline void expect_refused(const Host& host, const Heard& heard, servo::Reason reason,
                           std::uint8_t status = 0) {
  EXPECT_EQ(heard.kind, 0x85);
  ASSERT_EQ(heard.body.size(), 7U);
  EXPECT_EQ(heard.body[0], static_cast<int>(reason));
  EXPECT_EQ(heard.body[1], static_cast<int>(host.target.state()));
  EXPECT_EQ(heard.body[2], status);
}

inline std::uint32_t expected_of(const Heard& refused) {
  return at<std::uint32_t>(refused.body, 3);
}

// Members of `result`
inline float command_of(const Heard& result) { return at<float>(result.body, 4); }
inline float gain_of(const Heard& result) { return at<float>(result.body, 8); }
inline std::uint8_t status_of(const Heard& result) { return at<std::uint8_t>(result.body, 16); }
inline std::uint8_t flags_of(const Heard& result) { return at<std::uint8_t>(result.body, 17); }
inline std::uint16_t bad_frames_of(const Heard& result) {
  return at<std::uint16_t>(result.body, 44);
}
inline std::uint16_t repeated_of(const Heard& result) { return at<std::uint16_t>(result.body, 46); }
inline std::uint16_t trips_of(const Heard& result) { return at<std::uint16_t>(result.body, 48); }
inline float velocity_gain_of(const Heard& result) { return at<float>(result.body, 12); }
inline std::vector<float> theta_of(const Heard& result) {
  std::vector<float> theta(at<std::uint8_t>(result.body, 50));
  for (std::size_t i = 0; i < theta.size(); ++i) {
    theta[i] = at<float>(result.body, 51 + 4 * i);
  }
  return theta;
}

template <class Wanted = Settings>
Host running(const Wanted& settings = {}, std::uint32_t first = 0) {
  Host host;
  host.hello();
  expect_done(host.configure(settings), servo::State::ready);
  expect_done(host.start(first), servo::State::running);
  return host;
}

/// Follows random references on the model (16) of Ghazali et al. (2011), a thousandth of its gain, without noise.
class Drive {
 public:
  Heard step(Host& host) {
    const float reference = random_() % 2 == 0 ? 0.1F : -0.1F;
    const Heard result = host.sample(number, y_[0], reference);
    EXPECT_TRUE(result.kind == 0x84 || result.kind == 0x87);
    ++number;
    std::rotate(std::begin(u_), std::end(u_) - 1, std::end(u_));
    u_[0] = command_of(result);
    const float next = 2.239F * y_[0] - 1.782F * y_[1] + 0.543F * y_[2] + 385e-6F * u_[0] -
                       581e-6F * u_[1] + 295e-6F * u_[2];
    std::rotate(std::begin(y_), std::end(y_) - 1, std::end(y_));
    y_[0] = next;
    return result;
  }

  std::uint32_t number = 0;

 private:
  std::mt19937 random_{1};
  float y_[3] = {};
  float u_[3] = {};
};

}  // namespace test
