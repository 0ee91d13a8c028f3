// SPDX-License-Identifier: MIT
// tests/golden/trace.csv or servo_trace.csv, linked into the program as it is, row by row; and the estimator of the first,
// whose settings are those of tests/golden/make_trace.py.
#pragma once

#include <cstdint>
#include <cstring>

#include "policies.hpp"
#include "report.hpp"

extern "C" const char golden_trace_begin[];
extern "C" const char golden_trace_end[];

namespace firmware {

constexpr std::uint32_t kSamples = 660;  // of each policy

/// One row of a trace; numbers are the bits of a float32.
template <int kColumns>
struct AnyRow {
  const char* policy;             // or run; ends with a comma
  std::uint32_t words[kColumns];  // command, position, status, ...

  bool is_of(const char* name) const {
    const std::size_t length = std::strlen(name);
    return std::strncmp(policy, name, length) == 0 && policy[length] == ',';
  }
};
using Row = AnyRow<17>;

/// Reads rows one behind the other, without copies.
class Trace {
 public:
  Trace() { skip_line(); }

  /// False at the end, and where the row is not as it should be.
  template <int kColumns>
  bool next(AnyRow<kColumns>& row) {
    row.policy = at_;
    while (at_ < golden_trace_end && *at_ != ',') {
      ++at_;
    }
    for (std::uint32_t& word : row.words) {
      if (at_ >= golden_trace_end || *at_ != ',') {
        return false;
      }
      ++at_;
      word = 0;
      for (int digit = 0; at_ < golden_trace_end && (digit = value(*at_)) >= 0; ++at_) {
        word = word << 4U | static_cast<std::uint32_t>(digit);
      }
    }
    if (at_ >= golden_trace_end || *at_ != '\n') {
      return false;
    }
    ++at_;
    return true;
  }

  bool at_end() const { return at_ == golden_trace_end; }

 private:
  static int value(char digit) {
    const bool letter = digit >= 'a' && digit <= 'f';
    return digit >= '0' && digit <= '9' ? digit - '0' : letter ? digit - 'a' + 10 : -1;
  }

  void skip_line() {
    while (at_ < golden_trace_end && *at_++ != '\n') {
    }
  }

  const char* at_ = golden_trace_begin;
};

inline std::uint32_t bits(float number) {
  std::uint32_t word = 0;
  std::memcpy(&word, &number, sizeof word);
  return word;
}

inline float number(std::uint32_t word) {
  float value = 0.0F;
  std::memcpy(&value, &word, sizeof value);
  return value;
}

template <class Forgetting>
ehsid::Status configure_golden(Estimator<Forgetting>& estimator) {
  typename Estimator<Forgetting>::Options options;
  options.scaling = {5.0F, 0.3F, 0.25F, -0.02F};
  options.reset.short_window = 5.0F;
  options.reset.long_window = 60.0F;
  options.reset.trigger_ratio = 8.0F;
  options.reset.cool_down = 20;
  options.theta0 << -1.5F, 0.5F, 0.0F, 0.02F, 0.0F, 0.0F;
  options.variance0 << 1e6F, 1e6F, 1e6F, 2.5e5F, 2.5e5F, 2.5e5F;
  return estimator.configure(options);
}

/// One step on the inputs of the row; every number must then be that of the row, to the last bit.
template <class Forgetting>
bool step_as_traced(Estimator<Forgetting>& estimator, const Row& row, const char* policy,
                    std::uint32_t sample, Report& report) {
  const ehsid::Status status = estimator.step(number(row.words[0]), number(row.words[1]));
  const auto theta = estimator.theta_hat();
  const auto deviation = estimator.standard_deviation();
  bool same_theta = true;
  bool same_deviation = true;
  for (int i = 0; i < 6; ++i) {
    same_theta = bits(theta[i]) == row.words[5 + i] && same_theta;
    same_deviation = bits(deviation[i]) == row.words[11 + i] && same_deviation;
  }
  // Not &&: all that differs is reported.
  bool good = report.check(row.is_of(policy), policy, "row of another policy", sample);
  good &=
      report.check(static_cast<std::uint32_t>(status) == row.words[2], policy, "status", sample);
  good &= report.check(bits(estimator.innovation()) == row.words[3], policy, "innovation", sample);
  good &= report.check(bits(estimator.forgetting_factor()) == row.words[4], policy,
                       "forgetting factor", sample);
  good &= report.check(same_theta, policy, "theta", sample);
  good &= report.check(same_deviation, policy, "standard deviation", sample);
  return good;
}

}  // namespace firmware
