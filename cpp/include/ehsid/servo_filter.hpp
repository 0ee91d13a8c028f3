// SPDX-License-Identifier: MIT
// An extended Kalman filter for the servo (5) on its physical parameters: position, velocity, acceleration, ln K,
// ln omega_n, ln xi and the null bias. The noise is that of the position sensor, and of a disturbance that acts as a
// velocity in front of the servo; both are tuned by the innovations.
//
// L. Ljung, "Asymptotic behavior of the extended Kalman filter as a parameter estimator for linear systems", IEEE TAC 24
// (1979) 36: the state and the parameters are estimated together, with the sensitivities of the state to them.
// R. Mehra, "On the identification of variances and adaptive Kalman filtering", IEEE TAC 15 (1970) 175: the size and the
// correlation of the innovations tell both noises apart. P. Huber 1964: an innovation counts up to a limit.
#pragma once

#include <ehsid/bounded_math.hpp>
#include <ehsid/servo_transition.hpp>
#include <ehsid/types.hpp>

#include <array>
#include <cmath>

namespace ehsid {

/// State of a ServoFilter in units of the position, of the command and of one sampling period. Plain data.
template <class Scalar>
struct ServoFilterState {
  static constexpr int kStates = 7;  // position, velocity, acceleration, ln k, ln h, ln xi, bias

  Scalar position;      // relative to the reference of the caller
  Scalar velocity;      // a sample
  Scalar acceleration;  // a sample^2
  Scalar gain;          // k = K dt
  Scalar rate;          // h = omega_n dt
  Scalar damping;       // xi
  Scalar bias;          // d, of the command
  std::array<Scalar, kStates*(kStates + 1) / 2> covariance;  // upper triangle by rows
  Scalar noise;                                              // R, variance of the sensor
  Scalar disturbance;         // alpha: velocity of the disturbance as a share of k |u|
  Scalar innovation;          // of the last sample, normalised, limited to 3
  Scalar innovation_square;   // mean square of these
  Scalar innovation_product;  // mean product of neighbouring ones
  Scalar likelihood;          // ln, over the samples since the start
  std::int32_t outliers;      // innovations beyond 4 deviations in a row
  std::int32_t samples;       // since the start; stops at its largest value

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ServoFilterState::position);
    visit(&ServoFilterState::velocity);
    visit(&ServoFilterState::acceleration);
    visit(&ServoFilterState::gain);
    visit(&ServoFilterState::rate);
    visit(&ServoFilterState::damping);
    visit(&ServoFilterState::bias);
    visit(&ServoFilterState::covariance);
    visit(&ServoFilterState::noise);
    visit(&ServoFilterState::disturbance);
    visit(&ServoFilterState::innovation);
    visit(&ServoFilterState::innovation_square);
    visit(&ServoFilterState::innovation_product);
    visit(&ServoFilterState::likelihood);
    visit(&ServoFilterState::outliers);
    visit(&ServoFilterState::samples);
  }
};

/// What the filter is told of each sample.
template <class Scalar>
struct ServoFilterTuning {
  Scalar drift;        // variance of ln K and ln omega_n a sample; 4 times that of ln xi
  Scalar command;      // mean square of the command, without rest
  Scalar least_noise;  // R never goes below
  Scalar adaptation;   // step of the adaptation of R and alpha; 0: none
  bool hold_servo;  // omega_n and xi are kept, though not taken as known (one sine shows neither)
};

/// One filter. Its functions need finite arguments; the result may be checked by finite().
template <class Scalar>
class ServoFilter {
 public:
  using State = ServoFilterState<Scalar>;
  using Tuning = ServoFilterTuning<Scalar>;
  static constexpr int kStates = State::kStates;
  /// Innovations count up to this many deviations; from the fourth in a row on the plant has changed and they count.
  static constexpr Scalar kLimit = Scalar(4);
  static constexpr int kPatience = 4;
  /// Where omega_n dt and xi are kept.
  static constexpr Scalar kLeastRate = Scalar(1e-4);
  static constexpr Scalar kMostRate = Scalar(20);
  static constexpr Scalar kLeastDamping = Scalar(0.01);
  static constexpr Scalar kMostDamping = Scalar(5);

  const State& state() const { return state_; }
  State& state() { return state_; }
  const ServoTransition<Scalar>& transition() const { return transition_; }

  /// P_ij, also of the parameters: 3 is ln K, 4 ln omega_n, 5 ln xi, 6 the bias.
  EHSID_ALWAYS_INLINE Scalar& covariance(int i, int j) { return state_.covariance[place(i, j)]; }
  EHSID_ALWAYS_INLINE Scalar covariance(int i, int j) const {
    return state_.covariance[place(i, j)];
  }

  /// Starts at rest. deviations: of ln K, ln omega_n, ln xi and of the bias.
  EHSID_RARE void start(Scalar gain, Scalar rate, Scalar damping,
                        const std::array<Scalar, 4>& deviations, Scalar mean_square_command,
                        Scalar noise) {
    state_ = State{};
    state_.gain = gain;
    state_.rate = rate;
    state_.damping = damping;
    state_.noise = noise;
    state_.disturbance = Scalar(0.1);
    state_.innovation_square = Scalar(1);
    EHSID_UNROLL
    for (int i = 0; i < 4; ++i) {
      const Scalar deviation = deviations[static_cast<std::size_t>(i)];
      covariance(3 + i, 3 + i) = deviation * deviation;
    }
    settle(Scalar(0), mean_square_command);
    renew();
  }

  /// The position is the measured one, and its derivatives may be whatever a command of this mean square can cause.
  EHSID_RARE void settle(Scalar position, Scalar mean_square_command) {
    state_.position = position;
    state_.velocity = Scalar(0);
    state_.acceleration = Scalar(0);
    EHSID_UNROLL
    for (int i = 0; i < 3; ++i) {
      EHSID_UNROLL
      for (int j = 0; j < kStates; ++j) {
        covariance(i, j) = Scalar(0);
      }
    }
    covariance(0, 0) = state_.noise;
    covariance(1, 1) = state_.gain * state_.gain * mean_square_command;
    covariance(2, 2) = covariance(1, 1) * state_.rate * state_.rate;
  }

  /// Takes the coefficients of the transition from the parameters of now.
  EHSID_ONCE void renew() { transition_ = servo_transition(state_.rate, state_.damping); }

  /// To the next sample, while the command u acts.
  EHSID_ONCE void predict(Scalar command, const Tuning& tuning) {
    const auto& t = transition_;
    const Scalar demand = state_.gain * (command - state_.bias);
    const Scalar error = state_.velocity - demand;
    const Scalar a = state_.acceleration;
    // Rows 0 to 2 of the Jacobian F but for its first column, which is 1, 0, 0; the parameters stay.
    const std::array<std::array<Scalar, 6>, 3> f{{
        {Scalar(1) - t.s.value, t.i.value, t.s.value * demand,
         t.i.by_rate * a - t.s.by_rate * error, t.i.by_damping * a - t.s.by_damping * error,
         -state_.gain * t.s.value},
        {Scalar(1) - t.w.value, t.e.value, t.w.value * demand,
         t.e.by_rate * a - t.w.by_rate * error, t.e.by_damping * a - t.w.by_damping * error,
         -state_.gain * t.w.value},
        {-t.pull.value, t.decay.value, t.pull.value * demand,
         t.decay.by_rate * a - t.pull.by_rate * error,
         t.decay.by_damping * a - t.pull.by_damping * error, -state_.gain * t.pull.value},
    }};
    state_.position += state_.velocity - t.s.value * error + t.i.value * a;
    state_.velocity += t.e.value * a - t.w.value * error;
    state_.acceleration = t.decay.value * a - t.pull.value * error;

    // P = F P F' + g g' q + D, where g is what a velocity in front of the servo does in one sample
    std::array<std::array<Scalar, 7>, 3> product;
    EHSID_UNROLL
    for (int j = 0; j < kStates; ++j) {
      const auto column = static_cast<std::size_t>(j);
      product[0][column] = covariance(0, j);
      product[1][column] = Scalar(0);
      product[2][column] = Scalar(0);
    }
    for (std::size_t i = 0; i < 3; ++i) {  // not unrolled, nor is the next one: their code is long
      EHSID_UNROLL
      for (int j = 0; j < kStates; ++j) {
        Scalar sum = product[i][static_cast<std::size_t>(j)];
        int at = j;  // P_lj, down the column to the diagonal and then along the row
        EHSID_UNROLL
        for (int l = 1; l < kStates; ++l) {
          at += l <= j ? kStates - l : 1;
          sum += f[i][static_cast<std::size_t>(l - 1)] *
                 state_.covariance[static_cast<std::size_t>(at)];
        }
        product[i][static_cast<std::size_t>(j)] = sum;
      }
    }
    const std::array<Scalar, 3> g{t.s.value, t.w.value, t.pull.value};
    const Scalar size = state_.disturbance * state_.gain;
    const Scalar shifted = command - state_.bias;
    const Scalar q = size * size * Scalar(0.5) * (shifted * shifted + tuning.command);
    Scalar* entry = state_.covariance.data();
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = i; j < 3; ++j) {
        Scalar sum = g[i] * g[j] * q + (j == 0 ? product[i][0] : Scalar(0));
        EHSID_UNROLL
        for (std::size_t l = 1; l < 7; ++l) {
          sum += product[i][l] * f[j][l - 1];
        }
        *entry++ = sum;
      }
      EHSID_UNROLL
      for (std::size_t j = 3; j < 7; ++j) {
        *entry++ = product[i][j];
      }
    }
    let_drift(tuning);
  }

  /// The parameters may have moved by one sample.
  void let_drift(const Tuning& tuning) {
    covariance(3, 3) += tuning.drift;
    covariance(4, 4) += tuning.drift;
    covariance(5, 5) += Scalar(4) * tuning.drift;
    covariance(6, 6) += Scalar(0.1) * tuning.drift * tuning.command;
  }

  /// Takes the measured position, relative to the reference of the state.
  EHSID_ONCE void update(Scalar measured, const Tuning& tuning) {
    const Scalar variance = covariance(0, 0) + state_.noise;
    const Scalar deviation = std::sqrt(variance);
    const Scalar raw = (measured - state_.position) / deviation;
    state_.likelihood -= Scalar(0.5) * (bounded_log(variance) + least(raw * raw, kLimit * kLimit));
    const bool outlier = std::abs(raw) > kLimit;
    state_.outliers = outlier ? state_.outliers + (state_.outliers < 1000 ? 1 : 0) : 0;
    const Scalar limit = outlier && state_.outliers >= kPatience ? Scalar(30) : kLimit;
    const Scalar normalised = bounded(raw, limit);

    const Scalar per_deviation = Scalar(1) / deviation;
    std::array<Scalar, 7> gain;
    EHSID_UNROLL
    for (int i = 0; i < kStates; ++i) {
      gain[static_cast<std::size_t>(i)] = covariance(0, i) * per_deviation;
    }
    // A parameter that is held keeps its value and its variance; what it shares with the others still changes (Schmidt 1966).
    const std::array<Scalar, 2> held{gain[4], gain[5]};
    if (tuning.hold_servo) {
      gain[4] = Scalar(0);
      gain[5] = Scalar(0);
    }
    state_.position += gain[0] * normalised;
    state_.velocity += gain[1] * normalised;
    state_.acceleration += gain[2] * normalised;
    state_.gain *= factor(gain[3] * normalised);
    state_.rate *= factor(gain[4] * normalised);
    state_.damping *= factor(gain[5] * normalised);
    state_.bias += gain[6] * normalised;
    state_.rate = between(state_.rate, kLeastRate, kMostRate);
    state_.damping = between(state_.damping, kLeastDamping, kMostDamping);
    Scalar* entry = state_.covariance.data();
    EHSID_UNROLL
    for (std::size_t i = 0; i < gain.size(); ++i) {
      EHSID_UNROLL
      for (std::size_t j = i; j < gain.size(); ++j) {
        *entry++ -= gain[i] * gain[j];
      }
    }
    if (tuning.hold_servo) {
      hold(held, gain);
    }
    EHSID_UNROLL
    for (int i = 0; i < kStates; ++i) {
      Scalar& variance_i = covariance(i, i);
      if (!(variance_i > Scalar(0))) {
        variance_i = Scalar(1e-12) * (i < 3 ? state_.noise : Scalar(1));
      }
    }
    tune(bounded(normalised, Scalar(3)), state_.noise / variance, tuning);
  }

  template <class Visit>
  EHSID_ALWAYS_INLINE static constexpr void fields(Visit visit) {
    visit(&ServoFilter::state_);
    visit(&ServoFilter::transition_);
  }

  /// Whether a state that was read can be one of a filter, but for numbers that are not finite: those of one that was
  /// started and lost need not be.
  bool possible() const {
    return state_.outliers >= 0 && state_.outliers <= 1000 && state_.samples >= 0 &&
           state_.samples <= 2000000000 &&
           (!started() || (!(state_.rate < kLeastRate) && !(state_.rate > kMostRate) &&
                           !(state_.damping < kLeastDamping) && !(state_.damping > kMostDamping)));
  }
  /// Whether start() was called.
  bool started() const { return state_.rate != Scalar(0); }

  /// Whether every number of the state is finite.
  EHSID_ONCE bool finite() const {
    // The exponent of a number that is not finite is all ones: one more of it carries into the sign.
    using Finite = Bits<Scalar>;
    const auto carry = [](Scalar value) {
      return (bits_of(value) & Finite::kExponent) + Finite::kLeastNormal;
    };
    auto carries = carry(state_.position) | carry(state_.velocity) | carry(state_.acceleration) |
                   carry(state_.gain) | carry(state_.bias) | carry(state_.likelihood);
    static_assert(kStates * (kStates + 1) / 2 % 4 == 0, "four at a time");
    const Scalar* const end = state_.covariance.data() + state_.covariance.size();
    for (const Scalar* at = state_.covariance.data(); at != end; at += 4) {
      carries |= carry(at[0]) | carry(at[1]) | carry(at[2]) | carry(at[3]);
    }
    return carries <= Finite::kExponent && state_.gain > Scalar(0);
  }

 private:
  EHSID_ALWAYS_INLINE static constexpr std::size_t place(int i, int j) {
    const int row = i < j ? i : j;
    const int column = i < j ? j : i;
    return static_cast<std::size_t>(row * (2 * kStates - 1 - row) / 2 + column);
  }
  static Scalar least(Scalar a, Scalar b) { return a < b ? a : b; }
  static Scalar between(Scalar x, Scalar low, Scalar high) {
    return x < low ? low : x > high ? high : x;
  }
  static Scalar bounded(Scalar x, Scalar most) { return between(x, -most, most); }

  /// The factor by which a parameter moves in one sample.
  static Scalar factor(Scalar logarithm) { return bounded_exp(bounded(logarithm, Scalar(0.3))); }

  /// What parameters that are held share with the others.
  EHSID_RARE void hold(const std::array<Scalar, 2>& held, const std::array<Scalar, 7>& gain) {
    for (int i = 0; i < kStates; ++i) {
      if (i != 4 && i != 5) {
        covariance(4, i) -= held[0] * gain[static_cast<std::size_t>(i)];
        covariance(5, i) -= held[1] * gain[static_cast<std::size_t>(i)];
      }
    }
  }

  /// The size of the innovations sets R, their correlation the disturbance. sensor_share: R / S.
  void tune(Scalar innovation, Scalar sensor_share, const Tuning& tuning) {
    const Scalar excess = innovation * innovation - Scalar(1);
    const Scalar product = innovation * state_.innovation;
    if (tuning.adaptation > Scalar(0)) {
      // R of a filter that was led astray may be too large by many powers of ten: then it falls far faster.
      const Scalar faster = state_.innovation_square < Scalar(0.01) ? Scalar(30) : Scalar(1);
      state_.noise *= bounded_exp(Scalar(0.7) * tuning.adaptation * faster * excess * sensor_share);
      state_.noise = state_.noise > tuning.least_noise ? state_.noise : tuning.least_noise;
      state_.disturbance *=
          bounded_exp(Scalar(10) * tuning.adaptation *
                      (Scalar(2) * product + Scalar(0.35) * excess * (Scalar(1) - sensor_share)));
      state_.disturbance = between(state_.disturbance, Scalar(1e-4), Scalar(1));
    }
    constexpr Scalar kMemory = Scalar(0.005);
    state_.innovation_square += kMemory * (excess + Scalar(1) - state_.innovation_square);
    state_.innovation_product += kMemory * (product - state_.innovation_product);
    state_.innovation = innovation;
    state_.samples += state_.samples < 2000000000 ? 1 : 0;
  }

  State state_{};
  ServoTransition<Scalar> transition_{};
};

}  // namespace ehsid
