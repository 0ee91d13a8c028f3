// SPDX-License-Identifier: MIT
// Where omega_n is not known at all, one filter that is linearised about a guess may never find it. Twelve filters that
// begin with different omega_n, and half of them with one more sample of delay, take every sample; their likelihoods tell
// which one is right (D. Magill, IEEE TAC 10 (1965) 434).
#pragma once

#include <ehsid/bounded_math.hpp>
#include <ehsid/servo_filter.hpp>

#include <array>
#include <cmath>

namespace ehsid {

/// The filters that compete at the start of a ServoEstimator.
template <class Scalar>
class ServoStarts {
 public:
  using Filter = ServoFilter<Scalar>;
  using Tuning = typename Filter::Tuning;

  /// Starts of omega_n dt, from 0.025 to 1.35 in equal ratios, each with the stated delay and one sample more.
  static constexpr int kRates = 6;
  static constexpr int kStarts = 2 * kRates;

  /// Back to filters that were never started. One behind the other: all in one piece would need as much stack.
  EHSID_RARE void clear() {
    for (Filter& one : filters_) {
      one = {};
    }
  }

  /// All begin at rest. gain: of the position, a sample and unit of the command, and the deviation of its logarithm; noise:
  /// variance of the sensor.
  EHSID_RARE void start(Scalar gain, Scalar gain_deviation, Scalar mean_square_command,
                        Scalar noise) {
    const std::array<Scalar, 4> deviations{gain_deviation, Scalar(0.35), Scalar(0.55),
                                           Scalar(0.2) * std::sqrt(mean_square_command)};
    for (int i = 0; i < kStarts; ++i) {
      const Scalar rate = bounded_exp(Scalar(-3.7) + Scalar(0.8) * static_cast<Scalar>(i % kRates));
      filters_[static_cast<std::size_t>(i)].start(gain, rate, Scalar(0.4), deviations,
                                                  mean_square_command, noise);
    }
  }

  /// Takes the measured position. A filter that is no longer finite is the least likely one.
  EHSID_RARE void update(Scalar measured, const Tuning& tuning) {
    for (Filter& one : filters_) {
      one.update(measured, tuning);
      if (!one.finite()) {
        one.state().likelihood = Scalar(-1e30);
      }
    }
  }

  /// To the next sample, while the command acts; before: the one of a sample before, for those with more delay.
  EHSID_RARE void predict(Scalar command, Scalar before, const Tuning& tuning) {
    for (int i = 0; i < kStarts; ++i) {
      Filter& one = filters_[static_cast<std::size_t>(i)];
      if (one.state().samples % 8 == 0) {
        one.renew();
      }
      one.predict(is_late(i) ? before : command, tuning);
    }
  }

  /// See ServoFilter::settle().
  EHSID_RARE void settle(Scalar position, Scalar mean_square_command) {
    for (Filter& one : filters_) {
      one.settle(position, mean_square_command);
    }
  }

  /// The reference of the positions moves by so much.
  EHSID_RARE void shift(Scalar by) {
    for (Filter& one : filters_) {
      one.state().position -= by;
    }
  }

  /// Once one start is in charge, the room of the others holds what it was: a state in place 0, and one in place 1.
  typename Filter::State& kept(int place) {
    return filters_[static_cast<std::size_t>(place)].state();
  }

  const Filter& operator[](int i) const { return filters_[static_cast<std::size_t>(i)]; }
  /// Since the start; all have taken the same number.
  std::int32_t samples() const { return filters_[0].state().samples; }
  /// Whether start i has one more sample of delay.
  static constexpr bool is_late(int i) { return i >= kRates; }

  int most_likely() const {
    int best = 0;
    for (int i = 1; i < kStarts; ++i) {
      best = score(i) > score(best) ? i : best;
    }
    return best;
  }

  /// Whether every start with another omega_n, or another delay where this is asked, is less likely by 10 nats.
  bool leads(int best, bool delay_asked) const {
    const auto& first = (*this)[best].state();
    for (int i = 0; i < kStarts; ++i) {
      const auto& other = (*this)[i].state();
      const bool apart = (delay_asked && is_late(i) != is_late(best)) ||
                         std::abs(bounded_log(other.rate / first.rate)) > Scalar(0.2);
      if (apart && other.likelihood > first.likelihood - Scalar(10)) {
        return false;
      }
    }
    return true;
  }

  /// Mean squares of how far the others are from the best one in ln K, ln omega_n and ln xi, weighted by likelihood.
  EHSID_RARE std::array<Scalar, 3> spread(int best) const {
    const auto& first = (*this)[best].state();
    Scalar weights = Scalar(0);
    std::array<Scalar, 3> sums{};
    for (const Filter& one : filters_) {
      if (!one.finite()) {  // a lost start says nothing of the spread
        continue;
      }
      const Scalar behind = one.state().likelihood - first.likelihood;
      const Scalar root = bounded_exp(behind / Scalar(4));  // down to -16 nats
      const Scalar weight = root * root * root * root;
      const Scalar apart[] = {bounded_log(one.state().gain / first.gain),
                              bounded_log(one.state().rate / first.rate),
                              bounded_log(one.state().damping / first.damping)};
      weights += weight;
      for (std::size_t i = 0; i < 3; ++i) {
        sums[i] += weight * apart[i] * apart[i];
      }
    }
    for (Scalar& sum : sums) {
      sum /= weights;
    }
    return sums;
  }

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ServoStarts::filters_);
  }

  /// Whether filters that were read can be those of a start.
  bool possible() const {
    bool good = true;
    for (const Filter& one : filters_) {
      good = one.possible() && good;
    }
    return good;
  }

 private:
  /// One more sample of delay has to be 5 nats more likely.
  Scalar score(int i) const {
    return (*this)[i].state().likelihood - (is_late(i) ? Scalar(5) : Scalar(0));
  }

  std::array<Filter, static_cast<std::size_t>(kStarts)> filters_{};
};

}  // namespace ehsid
