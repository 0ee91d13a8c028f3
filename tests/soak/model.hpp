// SPDX-License-Identifier: MIT
// Model (16) of Ghazali et al. (2011) with noise in its equation, as the soak of the estimator sees it.
#pragma once

#include <cstdint>

namespace soak {

constexpr int kN = 6;
constexpr double kModel[kN] = {-2.2390, 1.7820, -0.5427, 0.3850, -0.5810, 0.2954};
constexpr double kNoise = 1e-3;  // standard deviation, units of the position

/// y(k) = -a1 y(k-1) - .. - a3 y(k-3) + b1 u(k-1) + .. + b3 u(k-3) + e(k). Plain data.
class Model {
 public:
  explicit Model(std::uint64_t seed) : word_(seed * 0x9E3779B97F4A7C15ULL + 1) {}

  /// The position at t_k. Then `command` is what acts from t_k on.
  void advance() {
    double next = kNoise * gaussian();
    for (int i = 0; i < 3; ++i) {
      next += -kModel[i] * y_[i] + gain_ * kModel[3 + i] * u_[i];
    }
    for (int i = 2; i > 0; --i) {
      y_[i] = y_[i - 1];
      u_[i] = u_[i - 1];
    }
    y_[0] = next;
  }
  void command(double value) { u_[0] = value; }

  float position() const { return static_cast<float>(y_[0]); }

  /// -1 or 1, by chance.
  double sign() { return (draw() >> 63U) != 0 ? 1.0 : -1.0; }

  /// Another random stream from here on, e.g. to try the same return many times.
  void reseed(std::uint64_t seed) { word_ = seed * 0x9E3779B97F4A7C15ULL + 1; }

  /// b1, b2, b3 become so many times those of the model.
  void change(double gain) { gain_ = gain; }
  double truth(int i) const { return i < 3 ? kModel[i] : gain_ * kModel[i]; }

 private:
  /// Marsaglia's xorshift64.
  std::uint64_t draw() {
    word_ ^= word_ << 13U;
    word_ ^= word_ >> 7U;
    word_ ^= word_ << 17U;
    return word_;
  }

  /// Sum of the four 16-bit parts of a random word, each uniform: close to a normal distribution of variance 1.
  double gaussian() {
    const std::uint64_t word = draw();
    double sum = 0.0;
    for (unsigned i = 0; i < 4; ++i) {
      sum += static_cast<double>((word >> (16U * i)) & 0xFFFFU) / 65536.0 - 0.5;
    }
    return sum * 1.7320508075688772;  // the variance of the sum is 4 / 12
  }

  std::uint64_t word_;
  double y_[3] = {};
  double u_[3] = {};
  double gain_ = 1.0;
};

}  // namespace soak
